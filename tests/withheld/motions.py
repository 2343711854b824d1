"""True motions: smooth pose curves, differentiated from their own quintic splines, never from a noisy reference."""
import glob
import os

import numpy as np
from scipy.interpolate import make_interp_spline
from scipy.signal import butter, sosfiltfilt
from scipy.spatial.transform import Rotation

KNOT_RATE = 240.0
MARGIN = 5.0  # s of motion beyond both ends: time offsets and filter warm-up reach there


def quaternion_product(a, b):
    """Hamilton product, w first."""
    scalar = a[..., :1] * b[..., :1] - np.sum(a[..., 1:] * b[..., 1:], axis=-1, keepdims=True)
    return np.concatenate([scalar, a[..., :1] * b[..., 1:] + b[..., :1] * a[..., 1:] + np.cross(a[..., 1:], b[..., 1:])], -1)


def continuous(quaternion):
    """The same rotations without jumps of sign."""
    flips = np.cumprod(np.where(np.sum(quaternion[1:] * quaternion[:-1], axis=1) < 0, -1.0, 1.0))
    return quaternion * np.concatenate([[1.0], flips])[:, None]


class Motion:
    """position [m] and quaternion wxyz (world_from_segment) on a grid that starts at `start`, in session seconds."""

    def __init__(self, start, position, quaternion, rate=KNOT_RATE):
        quaternion = quaternion / np.linalg.norm(quaternion, axis=1, keepdims=True)
        quaternion = continuous(quaternion)
        times = start + np.arange(len(position)) / rate
        self.span = (times[0], times[-1])
        self._curves = [make_interp_spline(times, np.hstack([position, quaternion]), k=5)]
        self._curves += [self._curves[0].derivative(order) for order in (1, 2)]

    def pose(self, times):
        value = self._curves[0](times)
        return value[:, :3], Rotation.from_quat(value[:, [4, 5, 6, 3]])

    def kinematics(self, times):
        """Rotation, acceleration, angular velocity and its derivative, all in world axes.
        The quaternion spline s is not unit: the vector part of s' s^-1 is w/2 at any length."""
        value, first, second = (curve(times) for curve in self._curves)
        quaternion = value[:, 3:]
        inverse = quaternion * [1, -1, -1, -1] / np.sum(quaternion**2, axis=1, keepdims=True)
        rate = quaternion_product(first[:, 3:], inverse)
        change = quaternion_product(second[:, 3:], inverse) - quaternion_product(rate, rate)
        return Rotation.from_quat(quaternion[:, [1, 2, 3, 0]]), second[:, :3], 2 * rate[:, 1:], 2 * change[:, 1:]


def _smootherstep(x):
    x = np.clip(x, 0, 1)
    return x**4 * (35 - 84 * x + 70 * x**2 - 20 * x**3)


def _bursts(rng, times):
    """Activity between rest and full, with smooth changes."""
    level = np.full(len(times), 1.0)
    cursor, current = times[0], 1.0
    while cursor < times[-1]:
        cursor += rng.uniform(3, 12)
        target = rng.choice([rng.uniform(0.0, 0.06), rng.uniform(0.3, 0.7), 1.0, rng.uniform(1.0, 1.4)], p=[0.25, 0.2, 0.35, 0.2])
        level += (target - current) * _smootherstep((times - cursor) / rng.uniform(0.6, 2.0))
        current = target
    return level


def synthetic_kind(rng):
    """The kind of motion, shared by fit and check: limb, vigour and mean posture."""
    limb = rng.choice(["wrist", "ankle", "pelvis"])
    return {"limb": str(limb), "vigour": float(rng.uniform(0.5, 1.3)), "terms": int(rng.integers(8, 21)),
            "gait_hz": float(rng.uniform(0.75, 1.1)), "posture": [float(x) for x in rng.uniform(-0.7, 0.7, 3)],
            "bursts": bool(rng.random() < 0.75)}


def synthetic(rng, kind, start, seconds):
    times = start + np.arange(int(seconds * KNOT_RATE)) / KNOT_RATE
    # (acceleration rms m/s2, rate rms rad/s) before vigour
    accel_rms, rate_rms = {"wrist": (4.0, 2.0), "ankle": (5.0, 2.2), "pelvis": (1.5, 0.5)}[kind["limb"]]
    series = []
    for axis in range(6):
        periodic = kind["limb"] != "wrist"
        if periodic:  # gait: harmonics of the stride, and slow wandering
            frequencies = np.concatenate([kind["gait_hz"] * np.arange(1, 6), rng.uniform(0.1, 0.5, max(3, kind["terms"] - 5))])
        else:
            frequencies = np.exp(rng.uniform(np.log(0.1), np.log(5.0), kind["terms"]))
        order = 1.6 if axis < 3 else 0.8
        weights = rng.uniform(0.3, 1.0, len(frequencies)) / frequencies**order
        phases = rng.uniform(0, 2 * np.pi, len(frequencies))
        value = np.sin(2 * np.pi * frequencies * times[:, None] + phases) @ weights
        power = 2 if axis < 3 else 1
        derivative_rms = np.sqrt(0.5 * np.sum((weights * (2 * np.pi * frequencies) ** power) ** 2))
        target = (accel_rms if axis < 3 else rate_rms) * kind["vigour"] / np.sqrt(3) * rng.uniform(0.6, 1.3)
        value *= target / derivative_rms
        limit = 0.45 if axis < 3 else 0.9  # m, rad: reach of a limb
        value *= min(1.0, limit / value.std())
        series.append(value)
    series = np.array(series).T
    if kind["bursts"]:
        series *= _bursts(rng, times)[:, None]
    posture = Rotation.from_rotvec(kind["posture"])
    rotation = posture * Rotation.from_euler("ZYX", series[:, 3:])
    return Motion(start, series[:, :3] + [0, 0, 1.0], rotation.as_quat()[:, [3, 0, 1, 2]])


def data_folder():
    here = os.path.dirname(os.path.abspath(__file__))
    for folder in (os.environ.get("CROMOSIM_DATA"), os.path.join(here, "../../../shared/data")):
        if folder and os.path.isdir(folder):
            return folder
    return None


def _clean_runs(good, shortest):
    edges = np.flatnonzero(np.diff(np.concatenate([[0], good.astype(int), [0]])))
    return [(a, b) for a, b in zip(edges[::2], edges[1::2]) if b - a >= shortest]


def _lowpass(position, quaternion, rate, cutoff):
    quaternion = continuous(quaternion)
    sections = butter(4, cutoff / (rate / 2), output="sos")
    both = sosfiltfilt(sections, np.hstack([position, quaternion]), axis=0)
    trim = int(0.15 * rate)  # the filter's edges
    return both[trim:-trim, :3], both[trim:-trim, 3:]


def _pieces(kind):
    """Clean low-passed stretches (rate, pos, quat) of the kind's clips."""
    folder = data_folder()
    pieces = []
    for clip in kind["clips"]:
        data = np.load(os.path.join(folder, clip))
        if kind["source"] == "mocap":
            rate, joint = float(data["fps"]), list(data["joints"]).index(kind["joint"])
            position, quaternion = data["pos"][:, joint].astype(float), data["quat_wxyz"][:, joint].astype(float)
            good, cutoff = ~data["suspect"], 10.0
            good[: int(0.1 * rate)] = False
        else:
            rate, position, quaternion = float(data["fs"]), data["pos"].astype(float), data["quat_wxyz"].astype(float)
            good, cutoff = np.isfinite(position).all(1) & np.isfinite(quaternion).all(1) & data["movement"], 8.0
        for first, last in _clean_runs(good, int(1.8 * rate)):
            pieces.append((rate, *_lowpass(position[first:last], quaternion[first:last], rate, cutoff)))
    return pieces


def _pingpong(piece, seconds, phase):
    """The piece played forth and back: time runs along a triangle whose corners are rounded over 0.8 s, so nothing jerks."""
    rate, position, quaternion = piece
    length = (len(position) - 1) / rate
    flat = np.hstack([position, quaternion])
    curve = make_interp_spline(np.arange(len(position)) / rate, flat, k=5)
    width = int(min(0.8, 0.5 * length) * KNOT_RATE) | 1
    kernel = np.hanning(width + 2)[1:-1] ** 2
    count = int(seconds * KNOT_RATE)
    run = (np.arange(count + width - 1) / KNOT_RATE + phase * 2 * length) % (2 * length)
    warped = np.convolve(np.where(run < length, run, 2 * length - run), kernel / kernel.sum(), mode="valid")
    out = curve(warped)
    return out[:, :3], out[:, 3:] / np.linalg.norm(out[:, 3:], axis=1, keepdims=True)


def _yaw(quaternion):
    w, x, y, z = quaternion
    return np.arctan2(2 * (w * z + x * y), 1 - 2 * (y * y + z * z))


def recorded(rng, kind, start, seconds):
    """Pieces of real motion, each for 8 to 25 s, cross-faded over 1.2 s where one follows another."""
    pieces = _pieces(kind)
    total, fade = int(seconds * KNOT_RATE), int(1.2 * KNOT_RATE)
    position = quaternion = None
    while position is None or len(position) < total:
        piece = pieces[rng.integers(len(pieces))]
        new_position, new_quaternion = _pingpong(piece, rng.uniform(8, 25), rng.random())
        if position is None:
            position, quaternion = new_position - new_position[0] + [0, 0, 1.0], new_quaternion
            continue
        # the next piece takes over place and heading in the middle of the fade
        turn = Rotation.from_euler("z", _yaw(quaternion[-fade // 2]) - _yaw(new_quaternion[fade // 2]))
        new_position = turn.apply(new_position)
        new_quaternion = (turn * Rotation.from_quat(new_quaternion[:, [1, 2, 3, 0]])).as_quat()[:, [3, 0, 1, 2]]
        new_position += position[-fade // 2] - new_position[fade // 2]
        new_quaternion = continuous(new_quaternion)
        if new_quaternion[fade // 2] @ quaternion[-fade // 2] < 0:
            new_quaternion = -new_quaternion
        weight = _smootherstep(np.linspace(0, 1, fade))[:, None]
        mixed = quaternion[-fade:] * (1 - weight) + new_quaternion[:fade] * weight
        position = np.vstack([position[:-fade], position[-fade:] * (1 - weight) + new_position[:fade] * weight, new_position[fade:]])
        quaternion = np.vstack([quaternion[:-fade], mixed / np.linalg.norm(mixed, axis=1, keepdims=True), new_quaternion[fade:]])
    return Motion(start, position[:total], quaternion[:total])


JOINTS = {"wrist": ["rHand", "lHand", "rForeArm", "lForeArm"], "ankle": ["rFoot", "lFoot", "rShin", "lShin"], "pelvis": ["hip", "chest"]}


def draw_kind(rng):
    """synthetic, mocap or BROAD, by chance; synthetic only where the data are absent."""
    source = rng.choice(["synthetic", "mocap", "broad"], p=[0.45, 0.35, 0.2])
    kind, folder = synthetic_kind(rng), data_folder()
    if folder is None:
        return {"source": "synthetic", **kind}
    pattern = {"mocap": "mocap_cmu/*.npz", "broad": "paired_broad/*.npz"}.get(str(source))
    clips = sorted(os.path.relpath(path, folder) for path in glob.glob(os.path.join(folder, pattern))) if pattern else []
    if not clips:
        return {"source": "synthetic", **kind}
    if source == "mocap":  # clips of one subject: the same kind of motion
        subjects = sorted({os.path.basename(clip).split("_")[0] for clip in clips})
        subject = rng.choice(subjects)
        clips = [clip for clip in clips if os.path.basename(clip).startswith(f"{subject}_")]
        limb = str(rng.choice(sorted(JOINTS)))
        return {"source": "mocap", "limb": limb, "joint": str(rng.choice(JOINTS[limb])), "clips": clips}
    return {"source": "broad", "limb": "wrist", "clips": [str(rng.choice(clips))]}


def make(rng, kind, first, last):
    """The motion over [first, last] (session seconds) and MARGIN beyond."""
    build = synthetic if kind["source"] == "synthetic" else recorded
    return build(rng, kind, first - MARGIN, last - first + 2 * MARGIN)
