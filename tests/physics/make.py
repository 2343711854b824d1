"""Motion whose accelerations are known: a humanoid in a physics engine, with what IMUs on it read.

    python -m venv physics && physics/bin/pip install -r requirements.txt
    physics/bin/python make.py ../../bags/truth

Writes one npz a motion; the same machine and versions give the same bytes. README.md in bags/truth says what is in them.
"""

import io
import sys
import zipfile
from pathlib import Path

import mujoco
import numpy as np

from humanoid import SERVO, SITES, xml
from motions import MOTIONS, NAMES

STEP_HZ = 2400  # a multiple of RATE_HZ, so that poses stand at steps
RATE_HZ = 240
CUTOFF_HZ = 47.0  # -3 dB of what is written
BEFORE_S = 1.5  # to settle on the floor, not written
AFTER_S = 0.25  # for the low-pass, not written
KP, KV = np.array([SERVO[name.removeprefix("left_").removeprefix("right_")][2:4] for name in NAMES], float).T


def low_pass(series):
    """Butterworth of second order forward and back, together -3 dB at CUTOFF_HZ; along the first axis."""
    # Both ways the power gain is 1 / (1 + (f / fc)^4)^2, which is a half at CUTOFF_HZ.
    k = np.tan(np.pi * CUTOFF_HZ / (np.sqrt(2) - 1) ** 0.25 / STEP_HZ)
    scale = 1 / (1 + np.sqrt(2) * k + k * k)
    b, a1, a2 = k * k * scale, 2 * (k * k - 1) * scale, (1 - np.sqrt(2) * k + k * k) * scale
    for _ in range(2):
        out = np.empty_like(series)
        x1 = x2 = y1 = y2 = series[0]
        for n, x in enumerate(series):
            out[n] = b * (x + 2 * x1 + x2) - a1 * y1 - a2 * y2
            x1, x2, y1, y2 = x, x1, out[n], y1
        series = out[::-1]
    return series


def command(model, data, body, asked, speed):
    """Sets servos and forces; `speed` is that of the support's place."""
    model.actuator_gainprm[:, 0] = KP * asked.stiffness
    model.actuator_biasprm[:, 1] = -KP * asked.stiffness
    model.actuator_biasprm[:, 2] = -KV * np.sqrt(asked.stiffness)
    data.ctrl[:] = [asked.targets[name] for name in NAMES]
    support = asked.support
    rotation = data.xmat[body].reshape(3, 3)
    upright = np.cross(rotation[:, 2], [0, 0, 1])
    heading = np.arctan2(rotation[1, 0], rotation[0, 0])
    away = (support.heading - heading + np.pi) % (2 * np.pi) - np.pi
    turn = upright + [0, 0, away]
    velocity, rate = data.qvel[:3], rotation @ data.qvel[3:6]
    mass, inertia = 75.0, 8.0  # kg, kg m2: for the damping alone
    torque = support.upright * turn - 1.4 * np.sqrt(support.upright * inertia) * rate
    stiffness = np.array([support.along, support.along, support.lift])
    force = stiffness * (np.array(support.place) - data.qpos[:3]) - 1.4 * np.sqrt(stiffness * mass) * (velocity - speed)
    data.xfrc_applied[:] = 0
    data.xfrc_applied[body] = np.concatenate([force, torque])
    data.xfrc_applied[model.body("torso").id, :3] = asked.push


def simulate(motion, seconds):
    """Times of the steps, and poses and readings of all sites at the same state: (steps, sites, ...)."""
    model = mujoco.MjModel.from_xml_string(xml(1 / STEP_HZ))
    data = mujoco.MjData(model)
    sites = [model.site(name).id for name in SITES]
    body = model.body("pelvis").id
    steps = int(round((BEFORE_S + seconds + AFTER_S) * STEP_HZ)) + 1
    place, turn, force, rate = (np.empty((steps, len(SITES), *shape)) for shape in ((3,), (9,), (3,), (3,)))
    for n in range(steps):
        t = n / STEP_HZ - BEFORE_S
        asked = motion(max(t, 0.0))
        place_now = np.array(asked.support.place)
        speed = (place_now - before) * STEP_HZ if n else np.zeros(3)
        before = place_now
        command(model, data, body, asked, speed)
        # Sensors and poses of this very state; what mj_step leaves is from within its step.
        mujoco.mj_forward(model, data)
        place[n], turn[n] = data.site_xpos[sites], data.site_xmat[sites]
        readings = data.sensordata.reshape(len(SITES), 2, 3)
        force[n], rate[n] = readings[:, 0], readings[:, 1]
        # Targets are held over a step: those of its middle, or the sensors would lead the motion by half a step.
        command(model, data, body, motion(max(t + 0.5 / STEP_HZ, 0.0)), speed)
        mujoco.mj_step(model, data)
    if data.warning.number.any() or not np.isfinite(place).all():
        raise SystemExit(f"{motion.__name__}: the engine warns; see MUJOCO_LOG.TXT")
    return place, turn.reshape(steps, len(SITES), 3, 3), force, rate


def check(name, place, turn, force, rate):
    """Readings against differences of the poses, both low-passed: root mean square, m/s2 and rad/s."""
    second = (place[2:] - 2 * place[1:-1] + place[:-2]) * STEP_HZ**2 + [0, 0, 9.80665]
    differences = np.einsum("nsji,nsj->nsi", turn[1:-1], second)
    step = np.einsum("nsji,nsjk->nsik", turn[:-2], turn[2:]) - np.einsum("nsji,nsjk->nsik", turn[2:], turn[:-2])
    turned = np.stack([step[..., 2, 1], step[..., 0, 2], step[..., 1, 0]], -1) * STEP_HZ / 4
    inner = slice(STEP_HZ // 10, -STEP_HZ // 10)
    for what, own, other in (("m/s2", force, differences), ("rad/s", rate, turned)):
        own, other = low_pass(own[1:-1])[inner], low_pass(other)[inner]
        error, size = np.sqrt(np.mean((own - other) ** 2)), np.sqrt(np.mean((own - own.mean(0)) ** 2))
        print(f"{name}: differences of poses leave {error:.5f} of {size:.3f} {what}, largest {np.abs(own).max():.1f}")


def quaternions(turn):
    """w, x, y, z, without jumps of sign along the first axis."""
    flat = turn.reshape(-1, 9)
    found = np.empty((len(flat), 4))
    for own, matrix in zip(found, flat):
        mujoco.mju_mat2Quat(own, matrix)
    found = found.reshape(*turn.shape[:2], 4)
    for n in range(1, len(found)):
        found[n] *= np.where(np.sum(found[n] * found[n - 1], -1) < 0, -1, 1)[:, None]
    return found


def write(path, arrays):
    """An npz with fixed time stamps."""
    with zipfile.ZipFile(path, "w", zipfile.ZIP_DEFLATED, compresslevel=9) as archive:
        for key, array in arrays.items():
            file = io.BytesIO()
            np.lib.format.write_array(file, np.ascontiguousarray(array), allow_pickle=False)
            entry = zipfile.ZipInfo(f"{key}.npy", (1980, 1, 1, 0, 0, 0))
            entry.compress_type = zipfile.ZIP_DEFLATED
            archive.writestr(entry, file.getvalue())


def main():
    folder = Path(sys.argv[1])
    folder.mkdir(parents=True, exist_ok=True)
    chosen = sys.argv[2:]
    for motion, seconds in MOTIONS.items():
        name = motion.__name__
        if chosen and name not in chosen:
            continue
        place, turn, force, rate = simulate(motion, seconds)
        check(name, place, turn, force, rate)
        first, count, every = int(BEFORE_S * STEP_HZ), int(seconds * RATE_HZ) + 1, STEP_HZ // RATE_HZ
        kept = slice(first, first + (count - 1) * every + 1, every)
        force, rate, turn = low_pass(force)[kept], low_pass(rate)[kept], quaternions(turn[kept])
        arrays = {"rate_hz": np.float64(RATE_HZ)}
        for k, site in enumerate(SITES):
            arrays[f"{site}_position"] = place[kept][:, k].astype(np.float32)
            arrays[f"{site}_quat_wxyz"] = turn[:, k].astype(np.float32)
            arrays[f"{site}_specific_force"] = force[:, k].astype(np.float32)
            arrays[f"{site}_angular_velocity"] = rate[:, k].astype(np.float32)
        write(folder / f"{name}.npz", arrays)


if __name__ == "__main__":
    main()
