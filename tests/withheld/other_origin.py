#!/usr/bin/env python3
"""Cases of the contract from a second hand: motions, numbers and integrators of its own, so that what was tuned on generate.py meets others.

Nothing of model.py, effects.py and motions.py is used; only the files' form (recording.py) and the labels' (generate.py).
The mass on a spring is integrated by the implicit midpoint rule, with the contract's equation as it stands there."""
import hashlib
import os

import numpy as np
from scipy.interpolate import CubicSpline
from scipy.signal import butter, lfilter, sosfiltfilt
from scipy.spatial.transform import Rotation, Slerp

import generate as first_hand
import recording
from other_motions import DEGREE, MOTIONS, STEP, UP, Motion

SUITES = {"other-single": 1, "other-placement": 1, "other-none": 0, "other-pair": 2, "other-triple": 3, "other-long": 1, "other-several": 1}
PLACES = ("helmet", "tool0", "shank_l", "saddle", "hand_right", "trunk", "imu_07")
REFERENCE = "reference_noise reference_smoothing reference_interpolation reference_tilt reference_scale reference_units".split()
EFFECTS = REFERENCE + (
    "mount_rotation lever_arm mount_slip soft_tissue time_offset clock_drift channel_delay dropped_samples accel_bias gyro_bias accel_scale gyro_scale "
    "accel_misalignment gyro_misalignment accel_noise gyro_noise accel_bias_drift gyro_bias_drift accel_saturation gyro_saturation accel_quantization "
    "gyro_quantization low_pass gyro_g_sensitivity vibration axis_convention accel_units gyro_units gravity_convention").split()
CHOICES = {"reference_units", "axis_convention", "accel_units", "gyro_units", "gravity_convention"}
SESSION = set(REFERENCE) | {"mount_slip", "time_offset", "clock_drift", "dropped_samples", "accel_bias", "gyro_bias", "accel_bias_drift", "gyro_bias_drift", "vibration"}
# one is a case of the other, or takes away what the other would show by
APART = [{"axis_convention", "mount_rotation"}, {"axis_convention", "gravity_convention"}, {"accel_units", "accel_scale"}, {"gyro_units", "gyro_scale"},
         {"reference_units", "reference_scale"}, {"gravity_convention", "reference_tilt"}, {"gravity_convention", "accel_saturation"},
         {"gravity_convention", "accel_units"}, {"reference_noise", "reference_smoothing"}, {"reference_noise", "reference_interpolation"},
         {"reference_smoothing", "reference_interpolation"}, {"accel_noise", "accel_quantization"}, {"gyro_noise", "gyro_quantization"}]


# --- what the device reads (stages 1 to 9 of the contract)

def spring_mass(force, rate, change, natural_hz, damping_ratio):
    """d'' = -wn^2 d - 2 z wn d' - f - 2 w x d' - alpha x d - w x (w x d) by the implicit midpoint rule; wn is prewarped."""
    natural = 2 / STEP * np.tan(np.pi * natural_hz * STEP)
    damping = 2 * damping_ratio * natural
    middle = [(x[1:] + x[:-1]) / 2 for x in (force, rate, change)]
    cross = lambda v: np.stack([np.stack([0 * v[:, 0], -v[:, 2], v[:, 1]], 1), np.stack([v[:, 2], 0 * v[:, 0], -v[:, 0]], 1), np.stack([-v[:, 1], v[:, 0], 0 * v[:, 0]], 1)], 1)
    spin, turn = cross(middle[1]), cross(middle[2])
    system = np.zeros((len(spin), 6, 6))
    system[:, :3, 3:] = np.eye(3)
    system[:, 3:, :3] = -natural**2 * np.eye(3) - turn - spin @ spin
    system[:, 3:, 3:] = -damping * np.eye(3) - 2 * spin
    right = np.concatenate([np.eye(6) + STEP / 2 * system, np.zeros((len(spin), 6, 1))], 2)
    right[:, 3:, 6] = -STEP * middle[0]
    both = np.linalg.solve(np.eye(6) - STEP / 2 * system, right)
    state, out = np.concatenate([-force[0] / natural**2, np.zeros(3)]), np.zeros_like(force)
    out[0] = force[0]
    for index, step in enumerate(both):
        state = step[:, :6] @ state + step[:, 6]
        out[index + 1] = -(natural**2 * state[:3] + damping * state[3:])
    return out


def dense_readings(motion, effects, t0):
    """Stages 1 to 6 on the dense grid."""
    gravity = {"removed": 0 * UP, "negated": UP}.get(effects.get("gravity_convention", {}).get("mode"), -UP)
    force = motion.rotation.apply(motion.acceleration - gravity, inverse=True)
    rate, change, time = motion.rate, motion.change, motion.time
    arm = np.array(effects.get("lever_arm", {}).get("offset", np.zeros(3)))
    force = force + np.cross(change, arm) + np.cross(rate, np.cross(rate, arm))
    if "soft_tissue" in effects:
        force = spring_mass(force, rate, change, **effects["soft_tissue"])
    turn = Rotation.from_rotvec(effects.get("mount_rotation", {}).get("rotvec", np.zeros(3)))
    slip = effects.get("mount_slip", {"at": np.inf, "rotvec": np.zeros(3)})
    turn = Rotation.concatenate([turn, turn * Rotation.from_rotvec(slip["rotvec"])])[(time >= slip["at"]).astype(int)]
    axes = np.array(effects.get("axis_convention", {}).get("matrix", np.eye(3)))
    force, rate = (turn.apply(x, inverse=True) @ axes.T for x in (force, rate))
    if "vibration" in effects:
        wave = effects["vibration"]
        angle = 2 * np.pi * wave["hz"] * (time[:, None] - t0)
        force = force + np.array(wave["amplitude"]) * np.sin(angle + np.array(wave["phase"]))
        rate = rate + np.array(wave["gyro_amplitude"]) * np.sin(angle + np.array(wave["gyro_phase"]))
    if "gyro_g_sensitivity" in effects:
        rate = rate + force @ np.array(effects["gyro_g_sensitivity"]["matrix"]).T
    if "low_pass" in effects:
        b, a = butter(2, effects["low_pass"]["cutoff_hz"], fs=1 / STEP)
        force, rate = (x[0] + lfilter(b, a, x - x[0], axis=0) for x in (force, rate))
    return force, rate


def readings(motion, effects, t0, times):
    """Stages 1 to 7 at true times, without noise."""
    force, rate = dense_readings(motion, effects, t0)
    late = effects.get("channel_delay", {}).get("seconds", 0.0)
    out = []
    for channel, value in (("accel", CubicSpline(motion.time, force)(times)), ("gyro", CubicSpline(motion.time, rate)(times - late))):
        xy, xz, yz = effects.get(f"{channel}_misalignment", {}).get("upper", (0, 0, 0))
        matrix = np.diag(effects.get(f"{channel}_scale", {}).get("scale", np.ones(3))) @ np.array([[1, xy, xz], [0, 1, yz], [0, 0, 1]])
        drift = np.outer(times - t0, effects.get(f"{channel}_bias_drift", {}).get("rate", np.zeros(3)))
        out.append(value @ matrix.T + effects.get(f"{channel}_bias", {}).get("bias", np.zeros(3)) + drift)
    return out


def true_times(stamps, t0, effects):
    return t0 + (stamps - t0 - effects.get("time_offset", {}).get("seconds", 0.0)) / (1 + effects.get("clock_drift", {}).get("ppm", 0.0) * 1e-6)


def read_out(rng, value, channel, sigma, rate, effects):
    """Stage 8."""
    extra = effects.get(f"{channel}_noise", {}).get("density", 0.0) * np.sqrt(rate)
    value = value + np.hypot(sigma, extra) * rng.standard_normal(value.shape)
    limit = effects.get(f"{channel}_saturation", {}).get("limit", np.inf)
    value = np.clip(value, -limit, limit)
    if f"{channel}_quantization" in effects:
        lsb = effects[f"{channel}_quantization"]["lsb"]
        value = lsb * np.round(value / lsb)
    return value * effects.get(f"{channel}_units", {}).get("factor", 1.0)


def losses(rng, count, loss):
    """Runs of losses with geometric lengths; the first message stays."""
    keep, at = np.ones(count, bool), 1
    gap = loss["mean_burst"] * (1 - loss["fraction"]) / loss["fraction"]
    while at < count:
        at += int(rng.geometric(min(1.0, 1 / gap)))
        burst = int(rng.geometric(1 / loss["mean_burst"]))
        keep[at:at + burst], at = False, at + burst
    return keep


# --- the reference

def coloured(rng, count, sigma, memory):
    """Noise of that standard deviation, of first order with that memory in samples (0: white)."""
    if memory < 0.2:
        return sigma * rng.standard_normal((count, 3))
    pole = np.exp(-1 / memory)
    return sigma * lfilter([np.sqrt(1 - pole**2)], [1, -pole], rng.standard_normal((count + 200, 3)), axis=0)[200:]


def disturb(rng, position, rotation, effects, quality, rate):
    added, memory = effects.get("reference_noise", {}), quality["memory"] * rate
    shift, turn = (coloured(rng, len(position), quality[key], memory) + added.get(key, 0.0) * rng.standard_normal((len(position), 3)) for key in ("position", "rotation"))
    return position + shift, rotation * Rotation.from_rotvec(turn)


def reported(rng, motion, times, rate, effects, quality):
    """What motion capture says: noise before or behind its filter, then tilt, scale and units."""
    slow, smooth = effects.get("reference_interpolation"), effects.get("reference_smoothing")
    frames = np.arange(times[0], times[-1] + 1 / slow["rate_hz"] + 1e-9, 1 / slow["rate_hz"]) if slow else times
    position, rotation = motion.pose(frames)
    early = quality["early"] and (slow or smooth)
    if early:
        position, rotation = disturb(rng, position, rotation, effects, quality, 1 / (frames[1] - frames[0]))
    if slow:
        position, rotation = np.stack([np.interp(times, frames, x) for x in position.T], 1), Slerp(frames, rotation)(times)
    if smooth:
        sos = butter(2, smooth["cutoff_hz"], fs=rate, output="sos")
        quaternion = rotation.as_quat()
        quaternion[1:] *= np.cumprod(np.where((quaternion[1:] * quaternion[:-1]).sum(1) < 0, -1.0, 1.0))[:, None]
        position, rotation = sosfiltfilt(sos, position, axis=0), Rotation.from_quat(sosfiltfilt(sos, quaternion, axis=0))
    tilt = Rotation.from_rotvec(effects.get("reference_tilt", {}).get("rotvec", np.zeros(3)))
    position, rotation = tilt.apply(effects.get("reference_scale", {}).get("factor", 1.0) * position), tilt * rotation
    if not early:
        position, rotation = disturb(rng, position, rotation, effects, quality, rate)
    return position * effects.get("reference_units", {}).get("factor", 1.0), rotation


# --- cases

def draw(rng, effect, facts):
    """Parameters, medium to strong. facts: sigma by channel, rate, t0, seconds, force and rate rms of the motion, reference_rate."""
    ball = lambda low, high: (rng.uniform(low, high) * (v := rng.standard_normal(3)) / np.linalg.norm(v)).tolist()
    odd = lambda low, high, n=3: (rng.uniform(low, high) * rng.uniform(0.2, 1, n) * rng.choice([-1, 1], n)).tolist()
    between = lambda low, high: float(np.exp(rng.uniform(np.log(low), np.log(high))))
    sign = float(rng.choice([-1, 1]))
    channel, _, kind = effect.partition("_")
    sigma = facts["sigmas"].get(channel, 0.0)
    table = {
        "reference_noise": lambda: {"position": 0.0, "rotation": 0.0} | dict([[("position", between(1.6e-3, 8e-3))], [("rotation", between(0.45, 2) * DEGREE)]][rng.integers(2)]),
        "reference_smoothing": lambda: {"cutoff_hz": between(1.5, 5)}, "reference_interpolation": lambda: {"rate_hz": between(15, facts["reference_rate"] / 2)},
        "reference_tilt": lambda: {"rotvec": [(angle := between(2, 12) * DEGREE) * np.cos(turn := rng.uniform(0, 6.28)), angle * np.sin(turn), 0.0]},
        "reference_scale": lambda: {"factor": 1 + sign * between(0.04, 0.25)}, "reference_units": lambda: {"factor": 1000.0},
        "mount_rotation": lambda: {"rotvec": ball(5 * DEGREE, 150 * DEGREE)}, "lever_arm": lambda: {"offset": ball(0.03, 0.25)},
        "mount_slip": lambda: {"at": facts["t0"] + facts["seconds"] * rng.uniform(0.35, 0.65), "rotvec": ball(6 * DEGREE, 30 * DEGREE)},
        "soft_tissue": lambda: {"natural_hz": between(4, 12), "damping_ratio": rng.uniform(0.1, 0.6)},
        "time_offset": lambda: {"seconds": sign * between(0.012, 0.6)}, "clock_drift": lambda: {"ppm": sign * between(150, 2000) * min(1, 60 / facts["seconds"])},
        "channel_delay": lambda: {"seconds": sign * between(0.005, 0.025)}, "dropped_samples": lambda: {"fraction": between(0.02, 0.2), "mean_burst": between(1, 8)},
        "accel_bias": lambda: {"bias": ball(0.15, 1.0)}, "gyro_bias": lambda: {"bias": ball(0.01, 0.12)},
        "scale": lambda: {"scale": (1 + np.array(odd(0.03, 0.15))).tolist()}, "misalignment": lambda: {"upper": odd(0.03, 0.12)},
        "noise": lambda: {"density": between(4, 30) * sigma / np.sqrt(facts["rate"])}, "quantization": lambda: {"lsb": between(8, 60) * sigma},
        "accel_bias_drift": lambda: {"rate": ball(0.3 / facts["seconds"], 1.2 / facts["seconds"])}, "gyro_bias_drift": lambda: {"rate": ball(0.03 / facts["seconds"], 0.12 / facts["seconds"])},
        "saturation": lambda: {"clipped": between(0.01, 0.1)}, "low_pass": lambda: {"cutoff_hz": between(3, 12)},
        "gyro_g_sensitivity": lambda: {"matrix": np.reshape(odd(1e-3, 6e-3, 9), (3, 3)).tolist()},
        "axis_convention": lambda: {"matrix": (np.eye(3)[rng.permutation(3)] * rng.choice([-1.0, 1.0], 3)).tolist()},
        "accel_units": lambda: {"factor": float(rng.choice([1 / UP[2], 1000 / UP[2]]))}, "gyro_units": lambda: {"factor": 180 / np.pi},
        "gravity_convention": lambda: {"mode": str(rng.choice(["removed", "negated"]))},
        "vibration": lambda: {"hz": rng.uniform(0.15, 0.44) * facts["rate"], "amplitude": np.abs(ball(0.4, 4)).tolist(), "phase": rng.uniform(0, 6.28, 3).tolist(),
                              "gyro_amplitude": (rng.integers(2) * np.abs(ball(0.05, 0.4))).tolist(), "gyro_phase": rng.uniform(0, 6.28, 3).tolist()}}
    return (table.get(effect) or table[kind])()


class Device:
    """One IMU on one motion; `begin` draws what is a session's own."""

    def __init__(self, rng, names, undeclared, seconds, capture):
        self.rng, self.names, self.seconds, self.capture = rng, names, seconds, capture
        self.kind = MOTIONS[rng.integers(len(MOTIONS))]
        self.rate = float(rng.choice([25, 50, 52, 100, 104, 128, 200, 256, 400])) * rng.uniform(0.995, 1.005)
        density = np.exp(rng.uniform(np.log(0.4), np.log(3), 2))
        self.sigmas = {"accel": 0.0014 * density[0] * np.sqrt(self.rate), "gyro": 0.00012 * density[1] * np.sqrt(self.rate)}
        self.said = 0.0 if undeclared else float(rng.choice([1, 1, 1, rng.uniform(2, 4)]))  # some data sheets promise less than the device holds
        self.device = {}

    def begin(self, base, check):
        rng, self.base = self.rng, base
        self.start, self.t0 = rng.uniform(0, 0.1), round(rng.uniform(-0.1, 0.8), 6)
        for _ in range(20):
            self.motion = Motion(rng, self.kind, self.seconds + check)
            facts = {"sigmas": self.sigmas, "rate": self.rate, "t0": self.t0, "seconds": self.seconds, "reference_rate": self.capture["rate"]}
            self.effects = {name: self.device.get(name) or draw(rng, name, facts) for name in self.names}
            if self.visible():
                break
        self.device = {name: value for name, value in self.effects.items() if name not in SESSION}

    def visible(self):
        """Draws again what nobody could see: a change of the readings below three times their noise, an accelerometer that what the reference loses does not move."""
        motion, times = self.motion, np.arange(self.t0, self.seconds, 1 / self.rate)
        for channel, index in (("accel", 0), ("gyro", 1)):
            limit = self.effects.get(f"{channel}_saturation", {})
            if "clipped" in limit:
                limit["limit"] = float(np.quantile(np.abs(readings(motion, self.effects, self.t0, times)[index]).max(1), 1 - limit.pop("clipped")))
        change = lambda effects: readings(motion, effects, self.t0, true_times(times, self.t0, effects))
        whole, inner = change(self.effects), motion.acceleration[4000:-4000]
        for name in self.names:
            if name in ("reference_smoothing", "reference_interpolation", "reference_scale"):
                cutoff = self.effects[name].get("cutoff_hz", self.effects[name].get("rate_hz", 12.0) / 3)
                lost = inner - sosfiltfilt(butter(2, cutoff, fs=1 / STEP, output="sos"), inner, axis=0) if name != "reference_scale" else 0.1 * inner
                if np.sqrt(np.mean(lost**2)) < 0.12:
                    return False
            elif name not in REFERENCE and name.split("_")[-1] not in ("noise", "quantization", "saturation", "samples"):
                without = change({key: value for key, value in self.effects.items() if key != name})
                if not any(np.sqrt(np.mean((a - b) ** 2)) > 3 * self.sigmas[key] for key, a, b in zip(("accel", "gyro"), whole, without)):
                    return False
        return True

    def record(self, first, seconds):
        rng, effects, t0 = self.rng, self.effects, self.t0
        begin = 0 if first == 0 else int(np.ceil((first + rng.uniform(-0.2, 0.5) - t0) * self.rate))
        stamps = t0 + np.arange(begin, int((first + seconds - t0) * self.rate)) / self.rate
        accel, gyro = (read_out(rng, value, channel, self.sigmas[channel], self.rate, effects) for channel, value in
                       zip(("accel", "gyro"), readings(self.motion, effects, t0, true_times(stamps, t0, effects))))
        keep = losses(rng, len(stamps), effects["dropped_samples"]) if "dropped_samples" in effects else np.ones(len(stamps), bool)
        rate = self.capture["rate"]
        times = first + self.start + np.arange(0, seconds, 1 / rate)
        position, rotation = reported(rng, self.motion, times, rate, effects, self.capture)
        seen = rng.random(len(times)) >= self.capture["blinks"]
        for _ in range(int(rng.integers(0, 6)) if self.capture["blinks"] else 0):
            seen &= np.abs(times - rng.uniform(first, first + seconds)) > rng.uniform(0.03, 0.8)
        variances = tuple((self.said * self.sigmas[channel]) ** 2 for channel in ("gyro", "accel"))
        stamp = lambda value: self.base * 10**9 + np.round(value * 1e9).astype(np.int64)
        return {"reference": (stamp(times)[seen], position[seen], rotation.as_quat()[seen]), "imu": (stamp(stamps)[keep], gyro[keep], accel[keep]), "variances": variances}

    def label(self):
        effects = {name: dict(value) for name, value in self.effects.items()}
        if "mount_slip" in effects:
            effects["mount_slip"]["at"] += self.base
        return {"effects": effects, "epoch_ns": self.base * 10**9 + round(self.t0 * 1e9), "imu_rate": self.rate, "sigmas": [self.sigmas["accel"], self.sigmas["gyro"]],
                "declared": self.said, "motion": self.kind.__name__, "capture": self.capture, "sizes": {}}


def choose(rng, number, undeclared, several):
    barred = {"accel_noise", "gyro_noise"} if undeclared else set()
    while True:
        names = [str(x) for x in rng.choice([name for name in EFFECTS if name not in barred], number, replace=False)]
        if not any(pair <= set(names) for pair in APART) and not (several and set(names) <= SESSION):
            return names


def build(job):
    """Writes one case, returns its label."""
    out, suite, seed, index, only = job
    case = hashlib.sha256(f"other {suite} {seed} {index}".encode()).hexdigest()[:10]
    rng = np.random.default_rng([seed, 77, list(SUITES).index(suite), index])
    undeclared, blinks = bool(rng.random() < 0.15), float(rng.choice([0.0, 0.0, 0.01]))
    number = {"other-placement": 3, "other-long": 5}.get(suite) or int(rng.choice([1, 1, 1, 2]))
    places = [str(x) for x in rng.permutation(PLACES)[:number]]
    chosen = [EFFECTS[(index * 11 + seed) % len(EFFECTS)]] if suite == "other-single" else choose(rng, SUITES[suite], undeclared, suite == "other-several")
    undeclared = undeclared and not {"accel_noise", "gyro_noise"} & set(chosen)
    seconds = 600.0 if suite == "other-long" else float(rng.choice([20, 30, 45, 60, 60, 90, 150]))
    affected = places[0] if chosen else None
    rates = [60.0, 100.0, 120.0, 200.0, 240.0, 300.0, float(rng.uniform(60, 300))]
    capture = {"position": rng.uniform(3e-5, 3e-4), "rotation": rng.uniform(0.01, 0.1) * DEGREE, "memory": float(rng.choice([0, 0, 0, rng.uniform(0.003, 0.012)])),
               "early": bool(rng.random() < 0.4), "rate": float(rng.choice(rates)), "blinks": blinks}
    devices = {place: Device(np.random.default_rng([seed, 78, list(SUITES).index(suite), index, k]), chosen if place == affected else [], undeclared, seconds, dict(capture))
               for k, place in enumerate(places)}
    os.makedirs(os.path.join(out, case), exist_ok=True)
    base, check, sessions = int(rng.choice([12, 1_234_567_890, 1_700_000_000, 2_100_000_000])), 30.0, []
    for session in range(int(rng.integers(2, 4)) if suite == "other-several" else 1):
        suffix = f"-{session + 1}" if suite == "other-several" else ""
        for device in devices.values():
            device.begin(base, check + 1)
        for file, first, length in ((f"fit{suffix}", 0.0, seconds), (f"check{suffix}", seconds + 1, check)):
            recording.write(os.path.join(out, case, f"{file}.mcap"), {place: device.record(first, length) for place, device in devices.items()})
        sessions.append({place: device.label() for place, device in devices.items()})
        base += int(rng.integers(5_000, 90_000))
    return {"case": case, "suite": suite, "seconds": seconds, "affected": affected, "strength": {name: "drawn" for name in chosen}, "gaps": blinks > 0,
            "undeclared": undeclared, "sessions": sessions}


def generate(out, suite, seed, count, jobs=1):
    return first_hand.write_all(out, build, [(out, suite, seed, index, None) for index in range(count or 20)], jobs)


if __name__ == "__main__":
    first_hand.command_line(__doc__, SUITES, generate)
