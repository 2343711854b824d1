#!/usr/bin/env python3
"""Cases whose gap arises from mechanics rather than from the contract's formulas: an arm of servos, or a body moved by hand, in MuJoCo.

    pip install -r tests/withheld/requirements.txt -r tests/withheld/requirements-mechanics.txt
    python tests/withheld/run.py --suite mechanics --cromosim ... --out ...      # or mechanics.py OUT, for the recordings alone

The engine's own accelerometer and gyroscope at a site are what the IMU reads. One continuous run of 0.5 ms steps (RK4) a case; fit and check
are two stretches of it. --verify also says how far model.py's formulas, at the true parameters, are from the engine without any noise."""
import argparse
import os
import sys

for threads in ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS"):
    os.environ.setdefault(threads, "1")

import mujoco
import numpy as np
from scipy.spatial.transform import Rotation

import effects as library
import generate as suites
import model
import motions
import recording

STEP = 5e-4  # s
SETTLE, FIT, PAUSE, CHECK, REST = 3.0, 45.0, 3.0, 25.0, 0.5  # s
REFERENCE_EVERY = 10  # steps: 200 Hz
MECHANISMS = ("nothing", "displaced", "turned", "flesh", "motor", "late_gyro", "clock", "bias", "saturated", "loose")
SECOND = ("displaced", "turned", "clock", "bias")  # what may join another mechanism
KNOCKS = 30  # in the fit recording, at least
HOUSING = 0.03  # kg: the IMU with its case
SERVOS = ("z 40", "y 40", "x 20", "y 12", "x 4", "y 4")  # axis and stiffness [Nm/rad] from shoulder to wrist
BODY_MASS = 0.8  # kg, moved by hand


def _text(vector):
    return " ".join(f"{value:.9g}" for value in vector)


def sensor_xml(parts):
    """The site of the IMU, on whatever joints its mechanism has."""
    placed = f'pos="{_text(parts.get("offset", np.zeros(3)))}"'
    turn = parts.get("mount", Rotation.identity()).as_quat()[[3, 0, 1, 2]]
    joints = ""
    if "flesh" in parts:
        natural, ratio = 2 * np.pi * parts["flesh"]["natural_hz"], parts["flesh"]["damping_ratio"]
        for axis in np.eye(3):
            joints += f'<joint type="slide" axis="{_text(axis)}" stiffness="{HOUSING * natural**2:.9g}" damping="{2 * ratio * natural * HOUSING:.9g}"/>'
    if "loose" in parts:  # free between two stops that are hard and bounce a little
        loose = parts["loose"]
        joints += (f'<joint name="play" type="{loose["type"]}" axis="{_text(loose["axis"])}" range="{-loose["play"]:.9g} {loose["play"]:.9g}" limited="true" '
                   f'solreflimit="0.004 0.4" damping="{loose["damping"]:.9g}"/>')
    return (f'<body name="housing" {placed} quat="{_text(turn)}">{joints}<inertial pos="0 0 0" mass="{HOUSING}" diaginertia="8e-6 8e-6 8e-6"/>'
            '<site name="sensor"/></body>')


def motor_xml(parts):
    """An eccentric rotor behind the mount; armature keeps its speed steady."""
    if "motor" not in parts:
        return "", ""
    motor = parts["motor"]
    body = (f'<body name="rotor" pos="{_text(motor["place"])}" quat="{_text(motor["turn"].as_quat()[[3, 0, 1, 2]])}"><joint name="spin" type="hinge" axis="0 0 1" armature="2e-4"/>'
            f'<inertial pos="{motor["radius"]:.9g} 0 0" mass="{motor["mass"]:.9g}" diaginertia="1e-7 1e-7 1e-7"/></body>')
    return body, '<general name="spin" joint="spin" biastype="affine" gainprm="2" biasprm="0 -2 -0.03"/>'


def xml(body, parts):
    inside = '<site name="reference"/>' + sensor_xml(parts)
    rotor, drive = motor_xml(parts)
    head = f'<mujoco><option timestep="{STEP}" integrator="RK4" gravity="0 0 -9.80665"><flag contact="disable"/></option><compiler angle="radian" autolimits="false"/><worldbody>'
    foot = '</worldbody><actuator>{}</actuator><sensor><accelerometer site="sensor"/><gyro site="sensor"/></sensor></mujoco>'
    if body == "free":
        return head + f'<body name="limb" pos="0 0 1"><freejoint/><inertial pos="0 0 0" mass="{BODY_MASS}" diaginertia="2.5e-3 2e-3 1.5e-3"/>{inside}{rotor}</body>' + foot.format(drive)
    links, motors, close = "", "", ""
    lengths, masses = (0.0, 0.0, 0.28, 0.12, 0.13, 0.0), (0.5, 0.4, 1.5, 0.5, 0.6, 0.4)
    for index, (servo, length, mass) in enumerate(zip(SERVOS, lengths, masses)):
        axis, stiffness = servo.split()
        vector = dict(x="1 0 0", y="0 1 0", z="0 0 1")[axis]
        links += (f'<body pos="{length if index else 0} 0 {0 if index else 1.2}"><joint name="servo{index}" type="hinge" axis="{vector}" armature="0.01" damping="0.02"/>'
                  f'<inertial pos="0.04 0 0" mass="{mass}" diaginertia="1.5e-3 2e-3 2e-3"/>')
        gain = float(stiffness)
        motors += f'<general joint="servo{index}" biastype="affine" gainprm="{gain}" biasprm="0 {-gain} {-0.11 * gain**0.75:.6g}"/>'
        close += "</body>"
    return head + links + f'<body name="limb" pos="0.05 0 0">{inside}{rotor}</body>' + close + foot.format(motors + drive)


def parts_of(rng, mechanism, level):
    """What the mechanism adds to the model or to the device, and the effect that it is: (parts, effects)."""
    size = lambda *sizes: float(sizes[level] * rng.uniform(0.85, 1.2))
    direction = lambda length: np.array(library._direction(rng, length))
    if mechanism == "displaced":
        offset = direction(size(0.02, 0.05, 0.12))
        return {"offset": offset}, {"lever_arm": {"offset": offset.tolist()}}
    if mechanism == "turned":
        turn = direction(np.radians(size(3, 8, 25)))
        return {"mount": Rotation.from_rotvec(turn)}, {"mount_rotation": {"rotvec": turn.tolist()}}
    if mechanism == "flesh":
        flesh = {"natural_hz": size(13, 9, 6), "damping_ratio": float(rng.uniform(0.2, 0.4))}
        return {"flesh": flesh}, {"soft_tissue": flesh}
    if mechanism == "motor":
        hz, mass, radius = float(rng.uniform(14, 38)), 0.02, 0.01
        mass *= size(0.4, 1.2, 3.5) * BODY_MASS / (mass * radius * (2 * np.pi * hz) ** 2)  # so that the limb shakes with so many m/s2
        return {"motor": {"hz": hz, "mass": mass, "radius": radius, "place": direction(0.03), "turn": Rotation.random(rng=rng)}}, {"vibration": {"hz": hz}}
    if mechanism == "late_gyro":
        seconds = size(0.003, 0.008, 0.020)
        return {"late": seconds}, {"channel_delay": {"seconds": seconds}}
    if mechanism == "clock":
        seconds = float(rng.choice([-1.0, 1.0])) * size(0.008, 0.025, 0.080)
        return {"clock": seconds}, {"time_offset": {"seconds": seconds}}
    if mechanism == "bias":
        which = rng.choice(["accel", "gyro", "both"])
        biases = {channel: direction(size(*sizes)) for channel, sizes in (("accel", (0.1, 0.3, 0.8)), ("gyro", (0.01, 0.03, 0.1))) if which in (channel, "both")}
        return {"bias": biases}, {f"{channel}_bias": {"bias": bias.tolist()} for channel, bias in biases.items()}
    if mechanism == "saturated":
        channel = str(rng.choice(["accel", "gyro"]))
        return {"clipped": (channel, size(0.01, 0.03, 0.08))}, {f"{channel}_saturation": {}}
    if mechanism == "loose":
        slide = bool(rng.random() < 0.4)
        play = size(1e-3, 2e-3, 4e-3) if slide else np.radians(size(2, 4, 8))
        # turns about its own centre: about another, its weight would hold it at one stop
        loose = {"type": "slide" if slide else "hinge", "axis": direction(1.0), "play": play, "damping": 0.02 if slide else 1e-5}
        return {"loose": loose}, {"unknown": {}}
    return {}, {}


def servo_targets(rng, times):
    """Angles that the arm's servos are asked for at half steps: sines between 0.15 and 1.8 Hz, in bursts."""
    out = []
    for reach in (0.9, 0.7, 0.8, 0.9, 0.8, 0.6):
        frequencies = np.exp(rng.uniform(np.log(0.15), np.log(1.8), 7))
        weights, phases = rng.uniform(0.4, 1.0, 7) / frequencies**0.8, rng.uniform(0, 2 * np.pi, 7)
        value = sum(weight * np.sin(2 * np.pi * hz * times + phase) for weight, hz, phase in zip(weights, frequencies, phases))
        out.append(0.4 * reach * value / np.sqrt(np.mean(value**2)))
    return np.array(out).T * motions._bursts(rng, times)[:, None]


class Hand:
    """Pulls and turns the free body along a smooth motion, softly: critically damped at 4 Hz, by the body's own mass and inertia."""

    def __init__(self, rng, seconds):
        kind = {**motions.synthetic_kind(rng), "limb": str(rng.choice(["wrist", "ankle"])), "bursts": True}
        path, times = motions.synthetic(rng, kind, -motions.MARGIN, seconds + 2 * motions.MARGIN), np.arange(0.0, seconds, STEP)
        rotation, _, self.turning, _ = path.kinematics(times)
        self.place, self.quaternion = path.pose(times)[0], rotation.as_quat()[:, [3, 0, 1, 2]]
        self.speed = np.gradient(self.place, STEP, axis=0)
        self.stiffness, self.error, self.now = (2 * np.pi * 4.0) ** 2, np.zeros(3), None

    def begin(self, data):
        data.qpos[:3], data.qpos[3:7] = self.place[0], self.quaternion[0]

    def pull(self, data, body, index):
        rate, damping = data.xmat[body].reshape(3, 3) @ data.qvel[3:6], 2 * np.sqrt(self.stiffness)
        mujoco.mju_subQuat(self.error, self.quaternion[index], data.qpos[3:7])  # in body axes
        torque = 2e-3 * (self.stiffness * (data.xmat[body].reshape(3, 3) @ self.error) + damping * (self.turning[index] - rate))
        force = BODY_MASS * (self.stiffness * (self.place[index] - data.qpos[:3]) + damping * (self.speed[index] - data.qvel[:3]) + [0, 0, 9.80665])
        before, self.now = self.now, np.concatenate([force, torque])
        data.xfrc_applied[body] = self.now
        self.middle = self.now if before is None else 1.5 * self.now - 0.5 * before


def run(rng, body, parts):
    """Times, poses of the reference frame and readings of the sensor, all of the same states."""
    engine = mujoco.MjModel.from_xml_string(xml(body, parts))
    data, seconds = mujoco.MjData(engine), SETTLE + FIT + PAUSE + CHECK + REST
    limb, site, steps = engine.body("limb").id, engine.site("reference").id, int(seconds / STEP)
    halves = np.arange(2 * steps + 1) * STEP / 2
    hand = Hand(rng, seconds + 1.0) if body == "free" else None
    control = np.zeros((len(halves), 0)) if hand else servo_targets(rng, halves)
    if "motor" in parts:
        control = np.column_stack([control, 2 * np.pi * parts["motor"]["hz"] * halves])
    if hand:
        hand.begin(data)
    place, turn, reading = np.empty((steps, 3)), np.empty((steps, 9)), np.empty((steps, 6))
    play = engine.joint("play").qposadr[0] if "loose" in parts else 0
    travel = np.empty(steps)

    for n in range(steps):
        data.ctrl[:] = control[2 * n]
        if hand:
            hand.pull(data, limb, n)
        mujoco.mj_forward(engine, data)
        place[n], turn[n], reading[n], travel[n] = data.site_xpos[site], data.site_xmat[site], data.sensordata, data.qpos[play]
        data.ctrl[:] = control[2 * n + 1]  # held over the step: that of its middle, or the readings would lead
        if hand:
            data.xfrc_applied[limb] = hand.middle
        mujoco.mj_step(engine, data)
    if data.warning.number.any() or not np.isfinite(reading).all():
        raise SystemExit("the engine warns; see MUJOCO_LOG.TXT")
    if "loose" in parts:
        parts["loose"]["knocks"] = knocks(travel[int(SETTLE / STEP):int((SETTLE + FIT) / STEP)], parts["loose"]["play"])
    return np.arange(steps) * STEP, place, Rotation.from_matrix(turn.reshape(-1, 3, 3)), reading[:, :3], reading[:, 3:]


def knocks(travel, play):
    """How often it goes from one stop to the other."""
    sides = np.sign(travel[np.abs(travel) > 0.8 * play])
    return int(np.sum(sides[1:] != sides[:-1]))


def at_times(times, values, wanted):
    return np.stack([np.interp(wanted, times, column) for column in values.T], axis=1)


class Device:
    """Turns the engine's readings into a device's messages, and its poses into a reference."""

    def __init__(self, rng, parts, effects, simulated):
        self.rng, self.parts, self.effects = rng, parts, effects
        self.times, self.place, self.turn, self.force, self.spin = simulated
        self.rate = 100.0 * rng.uniform(0.995, 1.005)
        self.sigmas, self.ordinary = (0.014, 0.0012), (rng.uniform(0.05e-3, 0.3e-3), np.radians(rng.uniform(0.02, 0.1)))
        self.ppm = rng.uniform(-suites.CLOCK_PPM, suites.CLOCK_PPM) if rng.random() < 0.7 else 0.0
        self.t0 = round(SETTLE + rng.uniform(0.3, 1.0), 9)  # the first stamp
        if "clipped" in parts:
            self._set_limit(*parts["clipped"])

    def _set_limit(self, channel, clipped):
        largest = np.abs(self.force if channel == "accel" else self.spin).max(axis=1)[int(SETTLE / STEP):]
        self.effects[f"{channel}_saturation"] = {"limit": float(np.quantile(largest, 1 - clipped))}

    def readings(self, stamps):
        """Without noise, at the device's own stamps."""
        true = stamps - self.parts.get("clock", 0.0)
        force, spin = at_times(self.times, self.force, true), at_times(self.times, self.spin, true - self.parts.get("late", 0.0))
        return [value + self.parts.get("bias", {}).get(channel, np.zeros(3)) for channel, value in (("accel", force), ("gyro", spin))]

    def record(self, base, first, seconds):
        rng, begin = self.rng, int(np.ceil((first + 0.3 - self.t0) * self.rate))
        stamps = self.t0 + np.arange(max(0, begin), int((first + seconds - 0.1 - self.t0) * self.rate)) / self.rate
        imu = []
        for channel, value, sigma in zip(("accel", "gyro"), self.readings(stamps), self.sigmas):
            limit = self.effects.get(f"{channel}_saturation", {}).get("limit", np.inf)
            imu.append(np.clip(value + sigma * rng.standard_normal(value.shape), -limit, limit))
        chosen = slice(int(first / STEP), int((first + seconds) / STEP), REFERENCE_EVERY)
        position = self.place[chosen] + self.ordinary[0] * rng.standard_normal((len(self.place[chosen]), 3))
        rotation = self.turn[chosen] * Rotation.from_rotvec(self.ordinary[1] * rng.standard_normal((len(position), 3)))
        own = first + (self.times[chosen] - first) * (1 - self.ppm * 1e-6)
        nanoseconds = lambda times: base * 1_000_000_000 + np.round(times * 1e9).astype(np.int64)
        return {"reference": (nanoseconds(own), position, motions.continuous(rotation.as_quat())), "imu": (nanoseconds(stamps), imu[1], imu[0]),
                "variances": (self.sigmas[1] ** 2, self.sigmas[0] ** 2)}

    def verify(self):
        """Root mean square of engine minus formulas over the fit (accel, gyro), and of the engine's readings; None where no formula is meant to hold."""
        if {"vibration", "unknown"} & set(self.effects):
            return None
        every = 5
        motion = motions.Motion(self.times[0], self.place[::every], self.turn.as_quat()[::every][:, [3, 0, 1, 2]], 1 / (every * STEP))
        stamps = np.arange(SETTLE + 1.0, SETTLE + FIT - 1.0, 1 / self.rate)
        formulas = {name: value for name, value in self.effects.items() if not name.endswith("_saturation")}
        said = model.inner_stages(motion, model.true_times(stamps, self.t0, formulas), self.t0, formulas)
        rms = lambda value: float(np.sqrt(np.mean(np.sum(value**2, axis=1))))
        return [(rms(a - b), rms(a - a.mean(0))) for a, b in zip(self.readings(stamps), said)]


def plan(count):
    """Each mechanism on the arm and on the free body, medium and strong; the motor on the free body alone: what it does to an arm
    changes with the arm's posture, which no single wave describes."""
    out = [(name, body, level) for level in (1, 2) for name in MECHANISMS for body in ("arm", "free") if (name, body) != ("motor", "arm")]
    return [out[index % len(out)] for index in range(count or len(out))]


def build(job):
    folder, seed, index, (mechanism, body, level), verify = job
    name, rng = suites.case_name("mechanics", seed, index, FIT), np.random.default_rng([seed, 1000, index])
    parts, effects = parts_of(rng, mechanism, level)
    if mechanism in SECOND and rng.random() < 0.5:  # two of the plain ones together
        more = parts_of(rng, str(rng.choice([other for other in SECOND if other != mechanism])), level)
        parts, effects = {**parts, **more[0]}, {**effects, **more[1]}
    simulated = run(rng, body, parts)
    while "loose" in parts and parts["loose"]["knocks"] < KNOCKS:  # at rest at one stop it is a mount like any other
        parts, effects = parts_of(rng, mechanism, level)
        simulated = run(rng, body, parts)
    device = Device(rng, parts, effects, simulated)
    base, place = 1_700_000_000 + int(rng.integers(0, 20_000_000)), str(rng.choice(["wrist", "ankle"]))
    os.makedirs(os.path.join(folder, name), exist_ok=True)
    for file, first, seconds in (("fit", SETTLE, FIT), ("check", SETTLE + FIT + PAUSE, CHECK)):
        recording.write(os.path.join(folder, name, f"{file}.mcap"), {place: device.record(base, first, seconds)})
    if verify:
        print(name, mechanism, body, sorted(device.effects), parts.get("loose", {}).get("knocks", ""), device.verify(), flush=True)
    item = {"effects": device.effects, "epoch_ns": base * 1_000_000_000 + int(round(device.t0 * 1e9)), "imu_rate": device.rate, "sigmas": device.sigmas, "declared": True,
            "ordinary": device.ordinary, "reference_ppm": device.ppm, "body": body, "outside": None}
    return {"case": name, "suite": "mechanics", "seconds": FIT, "affected": place if effects else None, "formula": False,
            "strength": {} if mechanism == "nothing" else {mechanism: library.STRENGTHS[level]}, "sessions": [{place: item}]}


def generate(out, seed=1, count=None, jobs=1, verify=False):
    return suites.write_all(out, build, [(out, seed, index, planned, verify) for index, planned in enumerate(plan(count))], jobs)


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("out")
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--count", type=int)
    parser.add_argument("--jobs", type=int, default=1)
    parser.add_argument("--verify", action="store_true")
    options = parser.parse_args()
    print("\n".join(generate(options.out, options.seed, options.count, options.jobs, options.verify)), file=sys.stderr)
