#!/usr/bin/env python3
"""Cases of a fourth generator, written from the contract alone by somebody who had seen none of the others: its own motions (`fourth_motions.py`, splines through poses at 2 kHz), sizes,
rates and nuisances, its own reading of the measurement model and of what can be seen; it shares only the files' form with the rest. Times are seconds from the session's base (whole
nanoseconds since 1970 are kept apart)."""
import hashlib
import json
import zlib
from pathlib import Path as File

import numpy as np
from scipy import signal
from scipy.interpolate import CubicSpline, make_interp_spline
from scipy.spatial.transform import Rotation, Slerp

import fourth_motions as motions
import generate as first_hand
import recording

SUITES = ("fourth-single", "fourth-pair", "fourth-triple", "fourth-none", "fourth-placement")
REFERENCE = ("reference_noise", "reference_smoothing", "reference_interpolation", "reference_tilt", "reference_scale", "reference_units")
EFFECTS = REFERENCE + (
    "mount_rotation", "lever_arm", "mount_slip", "soft_tissue", "time_offset", "clock_drift", "channel_delay", "dropped_samples", "accel_bias", "gyro_bias", "accel_scale", "gyro_scale",
    "accel_misalignment", "gyro_misalignment", "accel_noise", "gyro_noise", "accel_bias_drift", "gyro_bias_drift", "accel_saturation", "gyro_saturation", "accel_quantization",
    "gyro_quantization", "low_pass", "gyro_g_sensitivity", "vibration", "axis_convention", "accel_units", "gyro_units", "gravity_convention")
RANDOM = ("reference_noise", "accel_noise", "gyro_noise", "accel_quantization", "gyro_quantization", "dropped_samples")
GROSS = ("reference_units", "accel_units", "gyro_units", "axis_convention", "gravity_convention")
PLAIN = ("time_offset", "mount_rotation", "lever_arm", "accel_bias", "gyro_bias")
FILTERS = ("low_pass", "reference_smoothing", "reference_interpolation")
G = 9.80665
IMU_RATES = (25, 50, 52, 60, 64, 100, 100, 104, 119, 125, 128, 148, 200, 200, 208, 238, 256, 400, 416, 500)
REFERENCE_RATES = (30, 50, 60, 60, 90, 100, 100, 120, 120, 150, 200, 240, 250, 300)
LEAST_ENERGY, LEAST_RIVAL, LEAST_RATIO = 400.0, 80.0, 0.7

# Pairs that are not hidden together: one mimics or masks the other, or their parameters cannot be told apart.
APART = {frozenset(pair.split()) for pair in (
    "reference_scale reference_units", "reference_noise reference_units", "reference_smoothing reference_interpolation", "reference_noise reference_smoothing",
    "reference_noise reference_interpolation", "reference_smoothing low_pass", "reference_interpolation low_pass", "reference_smoothing soft_tissue",
    "reference_interpolation soft_tissue", "soft_tissue low_pass", "reference_noise accel_noise", "reference_noise gyro_noise",
    "reference_noise accel_quantization", "reference_noise gyro_quantization", "mount_rotation axis_convention", "mount_rotation mount_slip",
    "axis_convention mount_slip", "time_offset low_pass", "channel_delay low_pass", "time_offset clock_drift", "vibration low_pass",
    "accel_saturation accel_units", "gyro_saturation gyro_units", "accel_quantization accel_units", "gyro_quantization gyro_units", "accel_scale accel_units",
    "gyro_scale gyro_units", "accel_noise accel_quantization", "gyro_noise gyro_quantization", "accel_saturation accel_scale", "gyro_saturation gyro_scale",
    "gravity_convention axis_convention", "gravity_convention accel_units", "gravity_convention soft_tissue", "gravity_convention reference_tilt",
    "gravity_convention accel_scale", "gravity_convention accel_saturation", "gravity_convention accel_misalignment", "gravity_convention gyro_g_sensitivity",
    "gravity_convention reference_scale", "reference_tilt accel_bias", "accel_misalignment gyro_misalignment", "gyro_g_sensitivity gyro_misalignment",
    "accel_bias accel_bias_drift", "gyro_bias gyro_bias_drift", "mount_slip accel_bias_drift", "mount_slip gyro_bias_drift", "time_offset channel_delay")}

def between(rng, low, high):
    return float(np.exp(rng.uniform(np.log(low), np.log(high))))

def direction(rng):
    return (v := rng.normal(size=3)) / np.linalg.norm(v)

# ---- the device: the measurement model -----------------------------------------------------------------------------------------------------
def true_times(stamps, fx, t0):
    """Stage 9 backwards: the true time behind each stamp."""
    late, ppm = fx.get("time_offset", {}).get("seconds", 0.0), fx.get("clock_drift", {}).get("ppm", 0.0)
    return t0 + (stamps - t0 - late) / (1 + ppm * 1e-6)

def specific_force(path, t, fx):
    """Stage 1: f, w and alpha, all in segment axes."""
    _, a, q, w, alpha = path.at(t)
    lever = np.asarray(fx.get("lever_arm", {}).get("offset", np.zeros(3)), float)
    weight = {"removed": 0.0, "negated": -1.0}.get(fx.get("gravity_convention", {}).get("mode"), 1.0)
    inverse = q * np.array([-1.0, -1.0, -1.0, 1.0])
    f = motions.qrotate(inverse, a + np.array([0.0, 0.0, weight * G]))
    return f + np.cross(alpha, lever) + np.cross(w, np.cross(w, lever)), w, alpha

def tissue(path, start, end, fx, rate=1000.0):
    """Stage 2: the displacement's equation by fourth-order Runge-Kutta, which is linear in the state and so one 6x6 matrix a step."""
    count = int(np.ceil((end - start) * rate)) + 2
    times = start + np.arange(2 * count + 1) / (2 * rate)
    f, w, alpha = specific_force(path, times, fx)
    wn, z = 2 * np.pi * fx["soft_tissue"]["natural_hz"], fx["soft_tissue"]["damping_ratio"]
    cross = lambda v: np.cross(v[:, None, :], np.eye(3)).swapaxes(1, 2)  # the matrix of v x
    spin = cross(w)
    system = np.zeros((len(times), 7, 7))  # state (d, d', 1)
    system[:, :3, 3:6] = np.eye(3)
    system[:, 3:6, :3] = -wn ** 2 * np.eye(3) - cross(alpha) - spin @ spin
    system[:, 3:6, 3:6] = -2 * z * wn * np.eye(3) - 2 * spin
    system[:, 3:6, 6] = -f
    h, one = 1 / rate, np.eye(7)
    first, middle, last = system[:-2:2], system[1:-1:2], system[2::2]
    k2 = middle @ (one + h / 2 * first)
    k3 = middle @ (one + h / 2 * k2)
    steps = one + h / 6 * (first + 2 * k2 + 2 * k3 + last @ (one + h * k3))
    state = np.empty((count + 1, 7))
    state[0] = np.r_[-f[0] / wn ** 2, 0, 0, 0, 1]
    for i in range(count):
        state[i + 1] = steps[i] @ state[i]
    return CubicSpline(times[::2], -(wn ** 2 * state[:, :3] + 2 * z * wn * state[:, 3:6]))

def mounted(path, t, fx, t0, soft):
    """Stages 1 to 5 at any times."""
    f, w, _ = specific_force(path, t, fx)
    if soft is not None:
        f = soft(t)
    turn = Rotation.from_rotvec(fx.get("mount_rotation", {}).get("rotvec", np.zeros(3)))
    slip = fx.get("mount_slip", {"at": np.inf, "rotvec": np.zeros(3)})
    after = (turn * Rotation.from_rotvec(slip["rotvec"])).inv()
    f, w = (np.where((t >= slip["at"])[:, None], after.apply(x), turn.inv().apply(x)) for x in (f, w))
    if "axis_convention" in fx:
        m = np.asarray(fx["axis_convention"]["matrix"], float)
        f, w = f @ m.T, w @ m.T
    if "vibration" in fx:
        v = {key: np.asarray(value, float) for key, value in fx["vibration"].items()}
        angle = 2 * np.pi * v["hz"] * (t - t0)[:, None]
        f, w = f + v["amplitude"] * np.sin(angle + v["phase"]), w + v["gyro_amplitude"] * np.sin(angle + v["gyro_phase"])
    if "gyro_g_sensitivity" in fx:
        w = w + f @ np.asarray(fx["gyro_g_sensitivity"]["matrix"], float).T
    return f, w

def analog(path, t, fx, t0):
    """Stages 1 to 6: what the sensing elements feel."""
    delay = fx.get("channel_delay", {}).get("seconds", 0.0)
    first, last = t.min() - 1.0 - abs(delay), t.max() + 0.1 + abs(delay)
    soft = tissue(path, first, last, fx) if "soft_tissue" in fx else None
    if "low_pass" not in fx:
        f, w = mounted(path, t, fx, t0, soft)
        return f, w if not delay else mounted(path, t - delay, fx, t0, soft)[1]
    rate = 2000.0
    grid = first + 0.01 + np.arange(int((last - first - 0.02) * rate)) / rate
    b, a = signal.butter(2, 2 * np.pi * fx["low_pass"]["cutoff_hz"], analog=True)
    b, a, _ = signal.cont2discrete((b, a), 1 / rate, "foh")
    b, settle = np.ravel(b), signal.lfilter_zi(np.ravel(b), a)
    passed = [CubicSpline(grid, signal.lfilter(b, a, x, axis=0, zi=np.outer(settle, x[0]))[0]) for x in mounted(path, grid, fx, t0, soft)]
    return passed[0](t), passed[1](t - delay)

def digital(x, channel, t, fx, t0, sigma=0.0, rate=1.0, rng=None, units=True, rounding=True):
    """Stages 7 and 8 of one channel ("accel" or "gyro"); without rng nothing random is added."""
    get = lambda effect, key, default: np.asarray(fx.get(f"{channel}_{effect}", {}).get(key, default), float)
    xy, xz, yz = get("misalignment", "upper", np.zeros(3))
    x = x @ np.array([[1, xy, xz], [0, 1, yz], [0, 0, 1]]).T * get("scale", "scale", np.ones(3))
    x = x + get("bias", "bias", np.zeros(3)) + np.outer(t - t0, get("bias_drift", "rate", np.zeros(3)))
    if rng is not None:
        x = x + np.hypot(sigma, get("noise", "density", 0.0) * np.sqrt(rate)) * rng.normal(size=x.shape)
    limit, lsb = get("saturation", "limit", np.inf), get("quantization", "lsb", 0.0)
    x = np.clip(x, -limit, limit)
    if rounding and np.any(lsb > 0):
        x = np.round(x / lsb) * lsb
    return x * get("units", "factor", 1.0) if units else x

def lost_samples(rng, count, fraction, mean_burst):
    """True for what is kept; bursts have geometric lengths and the first sample stays."""
    keep, lost = np.ones(count, bool), 0
    while lost < fraction * count:
        start, length = rng.integers(1, count - 1), rng.geometric(1 / max(mean_burst, 1.0))
        lost += int(keep[start:start + length].sum())
        keep[start:start + length] = False
    return keep

# ---- the reference -------------------------------------------------------------------------------------------------------------------------
def unit_noise(rng, count, correlation):
    x = rng.normal(size=(count, 3))
    return x if not correlation else signal.lfilter([np.sqrt(1 - correlation ** 2)], [1, -correlation], x, axis=0, zi=(correlation * rng.normal(size=(1, 3))))[0]

def report(path, times, rate, fx, noise=None, rng=None):
    """The reported poses on an even lattice of `times`; noise: position [m], rotation [rad], correlation of the frames as they are made."""
    frames = fx.get("reference_interpolation")
    at = times
    if frames:
        hz = frames["rate_hz"]
        first = frames["start"] + np.floor((times[0] - frames["start"]) * hz - 1) / hz
        at = first + np.arange(int((times[-1] - first) * hz) + 3) / hz
    p, _, q, _, _ = path.at(at)
    turn = Rotation.from_quat(q)
    tilt = Rotation.from_rotvec(fx.get("reference_tilt", {}).get("rotvec", np.zeros(3)))
    p, turn = tilt.apply(p * fx.get("reference_scale", {}).get("factor", 1.0)), tilt * turn
    if noise is not None:
        p = p + noise["position"] * unit_noise(rng, len(at), noise["correlation"])
        turn = turn * Rotation.from_rotvec(noise["rotation"] * unit_noise(rng, len(at), noise["correlation"]))
    if frames:
        cell = np.clip(np.searchsorted(at, times, side="right") - 1, 0, len(at) - 2)
        share = ((times - at[cell]) * hz)[:, None]
        p, turn = p[cell] * (1 - share) + p[cell + 1] * share, Slerp(at, turn)(times)
    q = continuous(turn.as_quat())
    if "reference_smoothing" in fx:
        sos = signal.butter(2, fx["reference_smoothing"]["cutoff_hz"], fs=rate, output="sos")
        p, q = signal.sosfiltfilt(sos, p, axis=0), signal.sosfiltfilt(sos, q, axis=0)
        q /= np.linalg.norm(q, axis=1, keepdims=True)
    return p * fx.get("reference_units", {}).get("factor", 1.0), q

def continuous(q):
    flips = np.cumsum(np.sum(q[1:] * q[:-1], axis=1) < 0) % 2
    return q * np.r_[1.0, np.where(flips, -1.0, 1.0)][:, None]

def predicted(times, p, q, t):
    """Specific force and angular velocity at t that a quintic spline through reported poses gives (only to judge visibility)."""
    ps, qs = make_interp_spline(times, p, k=5), make_interp_spline(times, q, k=5)
    u, du = qs(t), qs(t, 1)
    inverse = u * np.array([-1.0, -1.0, -1.0, 1.0])
    norm = np.sum(u * u, axis=1, keepdims=True)
    return motions.qrotate(inverse / np.sqrt(norm), ps(t, 2) + [0, 0, G]), 2 * motions.qmul(inverse, du)[:, :3] / norm

# ---- how visible an effect is --------------------------------------------------------------------------------------------------------------
class Judge:
    """Weighs noise-free differences against sensor noise and the ordinary reference error, after the plain calibration and after each rival effect."""

    def __init__(self, place, fx):
        self.place, self.fx = place, fx
        t0, rate, noise = place["t0"], place["rate"], place["noise"]
        self.stamps = t0 + np.arange(int(place["seconds"] * rate)) / rate
        self.every = 1 if fx.get("vibration", {}).get("hz", 0.0) > 30 else max(1, int(rate / 90))
        size = len(self.stamps) // self.every
        self.taper = signal.windows.tukey(size, 0.1)[:, None]
        self.f = np.fft.rfftfreq(size, self.every / rate)
        plain, extra = place["reference_rate"], (1 + noise["correlation"]) / (1 - noise["correlation"])
        omega, fs = 2 * np.pi * self.f, rate / self.every
        seen = extra * fs / plain * (self.f < plain / 2)
        accel = place["sigmas"][0] ** 2 / self.every + seen * (noise["position"] ** 2 * omega ** 4 + (G * noise["rotation"]) ** 2)
        gyro = place["sigmas"][1] ** 2 / self.every + seen * noise["rotation"] ** 2 * omega ** 2
        self.spread = np.stack([accel] * 3 + [gyro] * 3, 1)
        self.full = self.series(fx)
        own = np.abs(np.fft.rfft(self.fold(self.full) * self.taper, axis=0)) ** 2 / np.sum(self.taper ** 2)
        self.floor = self.spread + 0.003 ** 2 * own  # nothing is known to better than 0.3 %

    def fold(self, x):
        size = len(self.taper) * self.every
        return x[:size].reshape((-1, self.every) + x.shape[1:]).mean(1)

    def series(self, fx):
        t0 = self.place["t0"]
        t = true_times(self.stamps, fx, t0)
        f, w = analog(self.place["path"], t, fx, t0)
        return np.hstack([digital(x, channel, t, fx, t0, units=False, rounding=False) for x, channel in ((f, "accel"), (w, "gyro"))])

    def reported(self, fx):
        rate = self.place["reference_rate"]
        times = self.place["reference_start"] + np.arange(-int(rate), int((self.place["seconds"] + 2) * rate)) / rate
        return np.hstack(predicted(times, *report(self.place["path"], times, rate, fx), self.stamps))

    def spectrum(self, x):
        return np.fft.rfft(self.fold(x) * self.taper.reshape((-1,) + (1,) * (x.ndim - 1)), axis=0)

    def deficit(self):
        """What an undisturbed reference at this rate fails to carry of this motion, as a multiple of the noise in the worst octave."""
        off = self.spectrum(self.reported({}) - self.series({}))
        return max(ratio for ratio, _, _ in self.bands(off / np.sqrt(self.spread * np.sum(self.taper ** 2) + 1e-30)))

    def bands(self, white):
        out, edge = [], 0.0
        while edge < self.f[-1]:
            upper = max(0.25, 2 * edge)
            inside = (self.f >= edge) & (self.f < upper)
            for channel, columns in (("accel", slice(0, 3)), ("gyro", slice(3, 6))):
                if inside.any():
                    out.append((float(np.sqrt(np.mean(np.abs(white[inside, columns]) ** 2))), channel, [edge, min(upper, float(self.f[-1]))]))
            edge = upper
        return out

    def columns(self):
        """Small changes of the readings per effect, about the full series (axes of the sensor)."""
        x, rate, t = self.full, self.place["rate"], self.stamps - self.place["t0"]
        f, w = x[:, :3], x[:, 3:]
        slope = np.gradient(x, 1 / rate, axis=0)
        bend = np.gradient(slope, 1 / rate, axis=0)
        nothing = np.zeros_like(f)
        _, a, q, omega, alpha = self.place["path"].at(self.stamps)
        inverse = q * np.array([-1.0, -1.0, -1.0, 1.0])
        turn = Rotation.from_rotvec(self.fx.get("mount_rotation", {}).get("rotvec", np.zeros(3))).as_matrix().T
        turn = np.asarray(self.fx.get("axis_convention", {}).get("matrix", np.eye(3)), float) @ turn
        accel, gyro = lambda v: np.hstack([v, nothing]), lambda v: np.hstack([nothing, v])
        axis = lambda v, i, j: np.stack([v[:, j] if k == i else nothing[:, 0] for k in range(3)], 1)
        one, eye = np.ones_like(f), np.eye(3)
        turned = [np.hstack([np.cross(f, e), np.cross(w, e)]) for e in eye]
        late = (t > t[-1] / 2)[:, None]
        return {"time_offset": [slope], "clock_drift": [slope * t[:, None]], "channel_delay": [gyro(slope[:, 3:])], "mount_rotation": turned,
                "mount_slip": [late * c for c in turned], "lever_arm": [accel((np.cross(alpha, e) + np.cross(omega, np.cross(omega, e))) @ turn.T) for e in eye],
                "accel_bias": [accel(axis(one, i, i)) for i in range(3)], "gyro_bias": [gyro(axis(one, i, i)) for i in range(3)],
                "accel_bias_drift": [accel(axis(one, i, i) * t[:, None]) for i in range(3)], "gyro_bias_drift": [gyro(axis(one, i, i) * t[:, None]) for i in range(3)],
                "accel_scale": [accel(axis(f, i, i)) for i in range(3)], "gyro_scale": [gyro(axis(w, i, i)) for i in range(3)],
                "accel_misalignment": [accel(axis(f, i, j)) for i, j in ((0, 1), (0, 2), (1, 2))],
                "gyro_misalignment": [gyro(axis(w, i, j)) for i, j in ((0, 1), (0, 2), (1, 2))],
                "gyro_g_sensitivity": [gyro(axis(f, i, j)) for i in range(3) for j in range(3)], "low_pass": [bend],
                "soft_tissue": [accel(bend[:, :3]), accel(np.gradient(bend[:, :3], 1 / rate, axis=0))],
                "reference_tilt": [accel(motions.qrotate(inverse, np.cross(e, [0, 0, G])) @ turn.T) for e in eye[:2]],
                "reference_scale": [accel(motions.qrotate(inverse, a) @ turn.T)]}

    def weigh(self, effect):
        """None when the effect is not visible enough, else how visible it is."""
        rest = {name: value for name, value in self.fx.items() if name != effect}
        if effect in RANDOM:
            return self.weigh_random(effect)
        if effect in REFERENCE:
            gap = self.reported(rest) - self.reported({**rest, effect: self.fx[effect]})
        elif effect.endswith("_units"):
            part = slice(0, 3) if effect.startswith("accel") else slice(3, 6)
            gap = np.zeros_like(self.full)
            gap[:, part] = self.full[:, part] * (self.fx[effect]["factor"] - 1)
        else:
            gap = self.full - self.series(rest)
        if effect.endswith("_saturation") and not 25 <= np.sum(np.any(np.abs(gap) > 0, axis=1)) <= 0.15 * len(gap):
            return None
        weight = 1 / np.sqrt(self.floor * np.sum(self.taper ** 2) + 1e-30)
        white = self.spectrum(gap) * weight
        if effect in GROSS:
            return self.verdict(effect, white, 2 * float(np.sum(np.abs(white) ** 2)), {})
        groups = self.columns()
        names = [name for name, own in groups.items() for _ in own]
        table = self.spectrum(np.stack([c for own in groups.values() for c in own], -1)) * weight[:, :, None]
        flat = table.reshape(-1, len(names))
        flat = np.vstack([flat.real, flat.imag])
        flat /= np.linalg.norm(flat, axis=0) + 1e-30
        target = np.r_[white.real.ravel(), white.imag.ravel()]
        gram, mixed, whole = flat.T @ flat, flat.T @ target, float(target @ target)

        def left(members):
            chosen = np.array([name in members and name != effect for name in names])
            answer = np.linalg.solve(gram[np.ix_(chosen, chosen)] + 1e-10 * np.eye(chosen.sum()), mixed[chosen])
            return 2 * max(0.0, whole - 2 * answer @ mixed[chosen] + answer @ gram[np.ix_(chosen, chosen)] @ answer), chosen, answer
        base = set(PLAIN) | set(rest)
        energy, chosen, answer = left(base)
        rest_target = target - flat[:, chosen] @ answer
        residual = (rest_target[:white.size] + 1j * rest_target[white.size:]).reshape(white.shape)
        alike = FILTERS if effect in FILTERS else ()  # their leading term is the same by nature; they differ beyond it
        rivals = {name: left(base | {name})[0] for name in groups if name not in base and name != effect and name not in alike}
        return self.verdict(effect, residual, energy, rivals)

    def verdict(self, effect, white, energy, rivals):
        ratio, channel, band = max(self.bands(white))
        nearest = min(rivals, key=rivals.get) if rivals else None
        if energy < LEAST_ENERGY or ratio < LEAST_RATIO or (nearest and rivals[nearest] < LEAST_RIVAL):
            return None
        return {"energy": round(float(energy), 1), "best_ratio": round(ratio, 3), "channel": channel, "band_hz": [round(v, 3) for v in band],
                "nearest_rival": nearest, "energy_beside_rival": round(float(rivals[nearest]), 1) if nearest else None}

    def weigh_random(self, effect):
        value, place = self.fx[effect], self.place
        if effect == "dropped_samples":
            lost = value["fraction"] * len(self.stamps)
            return None if lost < 30 or lost / value["mean_burst"] < 6 else {"lost": int(lost), "bursts": int(lost / value["mean_burst"])}
        if effect == "reference_noise":
            ordinary = place["ordinary"]
            limits = {"position": 1e-3, "rotation": np.radians(0.25)}
            return {key: {"times_limit": round(value[key] / limits[key], 2), "times_ordinary": round(value[key] / ordinary[key], 2) if ordinary[key] else None} for key in limits}
        channel = 0 if effect.startswith("accel") else 3
        added = (value["density"] ** 2 * place["rate"] if "density" in value else value["lsb"] ** 2 / 12) / self.every
        ratio = np.sqrt(added / self.spread[:, channel])
        share = float(np.mean(ratio >= LEAST_RATIO))
        return None if share < 0.15 else {"best_ratio": round(float(ratio.max()), 2), "share_of_band_above_0.7": round(share, 3)}

# ---- drawing a case ------------------------------------------------------------------------------------------------------------------------
def draw_effect(name, rng, place):
    """Sizes that devices and laboratories have, from modest to strong."""
    sign = float(rng.choice([-1.0, 1.0]))
    seconds, rate = place["seconds"], place["rate"]
    channel = 0 if name.startswith("accel") else 1
    axes = lambda low, high: [float(rng.choice([-1, 1])) * between(rng, low, high) for _ in range(3)]
    if name == "reference_noise":
        which, ordinary = rng.integers(3), place["ordinary"]
        position = between(rng, 1.4e-3, 6e-3) if which != 1 else max(ordinary["position"], 5e-5)
        return {"position": position, "rotation": np.radians(between(rng, 0.35, 2.0)) if which != 0 else max(ordinary["rotation"], 2e-4)}
    if name == "reference_interpolation":
        rates = [r for r in (5, 8, 10, 12, 12.5, 15, 20, 24, 25, 30, 50) if r <= place["reference_rate"] / 2.4]
        return {"rate_hz": float(rng.choice(rates)), "start": place["reference_start"] + rng.uniform(0, 0.2) * rng.integers(2)}
    if name == "reference_tilt":
        angle = rng.uniform(0, 2 * np.pi)
        return {"rotvec": (np.radians(between(rng, 0.7, 6)) * np.array([np.cos(angle), np.sin(angle), 0.0])).tolist()}
    if name == "axis_convention":
        while True:
            matrix = np.eye(3)[rng.permutation(3)] * rng.choice([-1, 1], (3, 1)) + 0.0
            if not np.array_equal(matrix, np.eye(3)) and (np.linalg.det(matrix) > 0 or rng.random() < 0.2):
                return {"matrix": matrix.tolist()}
    if name == "vibration":
        shape = lambda size: (size * rng.uniform(0.25, 1.0, 3)).tolist()
        phase = lambda: rng.uniform(-np.pi, np.pi, 3).tolist()
        return {"hz": between(rng, min(6.0, 0.2 * rate), min(110.0, 0.42 * rate)), "amplitude": shape(between(rng, 0.1, 4)), "phase": phase(),
                "gyro_amplitude": shape(between(rng, 0.004, 0.15)), "gyro_phase": phase()}
    if name.endswith("saturation"):
        x = np.abs(np.hstack(analog(place["path"], place["t0"] + np.arange(int(seconds * rate)) / rate, {}, place["t0"]))[:, 3 * channel:3 * channel + 3]).max(1)
        ladder = [G * g for g in (1.5, 1.7, 2, 3, 4, 6, 8, 16)] if channel == 0 else [np.radians(d) for d in (75, 100, 125, 150, 250, 300, 450, 500, 1000, 2000)]
        fits = [limit for limit in ladder if 0.003 < np.mean(x > limit) < 0.1]
        return {"limit": float(rng.choice(fits)) if fits else float(max(np.quantile(x, 1 - between(rng, 0.005, 0.06)), 14.0 if channel == 0 else 1.2))}
    if name.endswith("quantization"):
        ladder = [G * v for v in (0.001, 0.002, 0.0039, 0.0078, 0.0156, 0.03125, 0.0625)] if channel == 0 else [np.radians(v) for v in (0.061, 0.07, 0.122, 0.25, 0.5, 1.0, 2.0, 4.0)]
        fits = [lsb for lsb in ladder if 4 < lsb / place["sigmas"][channel] < 60]
        return {"lsb": float(rng.choice(fits)) if fits else place["sigmas"][channel] * between(rng, 4, 25)}
    draws = {
        "reference_smoothing": lambda: {"cutoff_hz": between(rng, 1.5, min(10.0, place["reference_rate"] / 5))},
        "reference_scale": lambda: {"factor": 1 + sign * between(rng, 0.015, 0.12)},
        "reference_units": lambda: {"factor": float(rng.choice([1000.0, 100.0, 1 / 0.0254, 1 / 0.3048], p=[0.6, 0.2, 0.1, 0.1]))},
        "mount_rotation": lambda: {"rotvec": (np.radians(between(rng, 2, 32)) * direction(rng)).tolist()},
        "lever_arm": lambda: {"offset": (between(rng, 0.015, 0.2) * direction(rng)).tolist()},
        "mount_slip": lambda: {"at": place["t0"] + seconds * rng.uniform(0.35, 0.65), "rotvec": (np.radians(between(rng, 3, 30)) * direction(rng)).tolist()},
        "soft_tissue": lambda: {"natural_hz": between(rng, 4, 25), "damping_ratio": rng.uniform(0.08, 0.6)},
        "time_offset": lambda: {"seconds": sign * between(rng, 0.006, 0.25)},
        "clock_drift": lambda: {"ppm": sign * between(rng, 40, 1500)},
        "channel_delay": lambda: {"seconds": (1 if rng.random() < 0.75 else -1) * between(rng, 0.002, 0.04)},
        "dropped_samples": lambda: {"fraction": between(rng, 0.01, 0.25), "mean_burst": between(rng, 1.0, 15.0)},
        "accel_bias": lambda: {"bias": (between(rng, 0.05, 1.0) * direction(rng)).tolist()}, "gyro_bias": lambda: {"bias": (between(rng, 0.004, 0.15) * direction(rng)).tolist()},
        "accel_scale": lambda: {"scale": (1 + np.array(axes(0.006, 0.06))).tolist()}, "gyro_scale": lambda: {"scale": (1 + np.array(axes(0.006, 0.06))).tolist()},
        "accel_misalignment": lambda: {"upper": axes(0.006, 0.06)}, "gyro_misalignment": lambda: {"upper": axes(0.006, 0.06)},
        "accel_noise": lambda: {"density": place["sigmas"][0] / np.sqrt(rate) * between(rng, 2, 12)},
        "gyro_noise": lambda: {"density": place["sigmas"][1] / np.sqrt(rate) * between(rng, 2, 12)},
        "accel_bias_drift": lambda: {"rate": (between(rng, 0.1, 1.0) / seconds * direction(rng)).tolist()},
        "gyro_bias_drift": lambda: {"rate": (between(rng, 0.008, 0.1) / seconds * direction(rng)).tolist()},
        "low_pass": lambda: {"cutoff_hz": between(rng, 2.0, min(20.0, 0.35 * rate))},
        "gyro_g_sensitivity": lambda: {"matrix": (between(rng, 3e-4, 5e-3) * rng.normal(size=(3, 3))).tolist()},
        "accel_units": lambda: {"factor": float(rng.choice([1 / G, 1000 / G, 100.0]))}, "gyro_units": lambda: {"factor": float(rng.choice([180 / np.pi, 180 / np.pi, 1000.0, 30 / np.pi]))},
        "gravity_convention": lambda: {"mode": str(rng.choice(["removed", "negated"]))}}
    return draws[name]()

def draw_hidden(suite, rng, index):
    if suite in ("fourth-none", "fourth-single"):
        return [EFFECTS[index % len(EFFECTS)]] if suite == "fourth-single" else []
    count = {"fourth-placement": 1, "fourth-pair": 2, "fourth-triple": 3}[suite]
    while True:
        chosen = [str(e) for e in rng.choice(EFFECTS, count, replace=False)]
        if not any({a, b} in APART for i, a in enumerate(chosen) for b in chosen[:i]):
            return chosen

def draw_session(rng, suite, hidden):
    """Everything about a session but its effects: motion, placements, clocks, rates, noises."""
    family = str(rng.choice(motions.FAMILIES))
    seconds, check = rng.uniform(40, 150), rng.uniform(25, 60)
    width = between(rng, 0.010, 0.024)
    names = motions.SEGMENTS[family]
    chosen = [str(n) for n in rng.choice(names, 3 if suite == "fourth-placement" else 1, replace=False)]
    turns = {n: Rotation.random(rng=rng) if rng.random() < 0.6 else Rotation.from_rotvec(rng.normal(size=3) * 0.15) for n in chosen}
    seeds = rng.integers(1 << 62, size=4)
    reference_rate, reference_start = float(rng.choice(REFERENCE_RATES)), float(rng.uniform(-0.6, 0.6))
    ordinary = {"position": 0.0, "rotation": 0.0, "correlation": 0.0}
    if rng.random() > 0.15:
        ordinary = {"position": between(rng, 2e-5, 3e-4), "rotation": np.radians(between(rng, 0.008, 0.1)), "correlation": max(0.0, rng.uniform(-1.5, 0.7))}
    side = str(rng.choice(["", "", "left_", "right_", "l_"])) if family in motions.PEOPLE else ""
    grade = str(rng.choice(["consumer", "consumer", "industrial", "cheap"]))
    paths = motions.body(family, np.random.default_rng(seeds[0]), 0.0, seconds, width, turns, chosen)
    density = {"consumer": ((1.2e-3, 4e-3), (7e-5, 3e-4)), "industrial": ((2.5e-4, 8e-4), (1.5e-5, 6e-5)), "cheap": ((4e-3, 1e-2), (3e-4, 1.2e-3))}[grade]
    places, rate = {}, 0.0
    for name in chosen:
        if not rate or rng.random() < 0.15:
            rate = float(rng.choice(IMU_RATES)) * (1 if rng.random() < 0.6 else 1 + rng.uniform(-0.008, 0.008))
        places[name] = {"topic": name if name in ("pelvis", "chest", "head") else side + name, "path": paths[name], "t0": round(float(rng.uniform(0, 0.3)), 9), "rate": rate,
                        "seconds": seconds, "sigmas": [between(rng, *d) * np.sqrt(rate) for d in density], "reference_rate": reference_rate,
                        "reference_start": reference_start, "ordinary": ordinary, "noise": ordinary, "seed": int(rng.integers(1 << 62))}
    kinds = [f for f in motions.PEOPLE if set(chosen) <= set(motions.SEGMENTS[f])] if family in motions.PEOPLE else [family]
    declared = bool(rng.random() > 0.15 or any("_noise" in h or "_quant" in h for h in hidden))
    return {"family": family, "check_family": family if rng.random() < 0.65 else str(rng.choice(kinds)), "seconds": seconds, "check_seconds": check, "pause": between(rng, 3, 90),
            "width": width, "turns": turns, "check_motion": int(seeds[1]), "places": places, "affected": str(rng.choice(chosen)) if hidden else None, "grade": grade,
            "base_ns": int(rng.integers(1_500_000_000, 1_800_000_000)) * 10 ** 9 + int(rng.integers(10 ** 9)), "declared": declared,
            "gaps": bool(rng.random() < 0.35), "lost_frames": bool(rng.random() < 0.3)}

def record(session, place, fx, path, first, last, rng):
    """One placement over one stretch: what `recording.write` takes."""
    t0, rate, base = place["t0"], place["rate"], session["base_ns"]
    ticks = np.arange(np.ceil((first - t0) * rate - 1e-6), np.floor((last - t0) * rate))
    stamps = base + np.round((t0 + ticks / rate) * 1e9).astype(np.int64)
    t = true_times((stamps - base) * 1e-9, fx, t0)
    f, w = analog(path, t, fx, t0)
    accel, gyro = (digital(x, channel, t, fx, t0, place["sigmas"][i], rate, rng) for i, (x, channel) in enumerate(((f, "accel"), (w, "gyro"))))
    if "dropped_samples" in fx:
        stamps, accel, gyro = (x[kept] for kept in [lost_samples(rng, len(stamps), **fx["dropped_samples"])] for x in (stamps, accel, gyro))
    hz, start = place["reference_rate"], place["reference_start"]
    pad = int(1.2 * hz)  # a smoothing filter ran over more than what was kept
    ticks = np.arange(np.ceil(first * hz) - pad, np.floor((last + rng.uniform(-0.4, 0.4) - start) * hz) + pad)
    when = np.round((start + ticks / hz) * 1e9).astype(np.int64)
    noise = {**place["ordinary"], **fx.get("reference_noise", {})}
    p, q = report(path, when * 1e-9, hz, fx, noise, rng)
    keep = np.pad(np.ones(len(when) - 2 * pad, bool), pad)
    if session["lost_frames"]:
        keep &= rng.random(len(keep)) > between(rng, 5e-4, 5e-3)
    if session["gaps"]:
        for at in rng.uniform(first + 2, last - 4, rng.integers(1, 4)):
            keep &= ~((when * 1e-9 > at) & (when * 1e-9 < at + between(rng, 0.1, 2.0)))
    variances = [np.full(3, place["sigmas"][i] ** 2 if session["declared"] else 0.0) for i in (1, 0)]
    return {"reference": (base + when[keep], p[keep], q[keep]), "imu": (stamps, gyro, accel), "variances": tuple(variances)}

def later_motion(session):
    """The check recording's motion, drawn until this reference can carry it too."""
    begin, places = session["seconds"] + session["pause"], session["places"]
    for number in range(4):
        session["check_family"] = family = session["check_family"] if number < 2 else session["family"]
        seconds, rng = session["check_seconds"], np.random.default_rng([session["check_motion"], number])
        paths = motions.body(family, rng, begin, seconds, session["width"], session["turns"], list(places))
        if all(Judge({**place, "path": paths[name], "t0": begin, "reference_start": begin, "seconds": seconds}, {}).deficit() < 0.35 for name, place in places.items()):
            return paths
    return None

def attempt(rng, suite, hidden):
    """A session in which every hidden effect is visible, or the name of what was not."""
    places = (session := draw_session(rng, suite, hidden))["places"]
    for place in places.values():
        while (deficit := Judge(place, {}).deficit()) > 0.35:  # such a motion needs a faster reference
            faster = [r for r in (60.0, 100.0, 150.0, 200.0, 300.0) if r > place["reference_rate"]]
            if not faster:
                return "motion", None, None
            for other in places.values():
                other["reference_rate"] = faster[0]
        place["deficit"] = round(deficit, 3)
    place = places.get(session["affected"])
    for _ in range(4):
        fx = {name: draw_effect(name, rng, place) for name in sorted(hidden, key=EFFECTS.index)}
        if fx:
            place["noise"] = {**place["ordinary"], **fx.get("reference_noise", {})}
            judge = Judge(place, fx)
        seen = {name: judge.weigh(name) for name in fx}
        failed = next((name for name in fx if seen[name] is None), None)
        if failed is None:
            later = later_motion(session)
            return (None, session, (fx, seen, later)) if later else ("check motion", None, None)
    return failed, None, None

def build(job):
    out, suite, seed, index = job
    rng = np.random.default_rng([zlib.crc32(suite.encode()), int(seed), int(index)])
    case = hashlib.sha256(f"fourth origin/{suite}/{seed}/{index}".encode()).hexdigest()[:10]
    hidden, failures = draw_hidden(suite, rng, index), []
    for number in range(60):
        if number % 12 == 11 and suite != "fourth-single":
            hidden = draw_hidden(suite, rng, index)
        failed, session, found = attempt(rng, suite, hidden)
        if failed is None:
            break
        failures.append(failed)
    else:
        return None
    (fx, seen, paths), places, base = found, session["places"], session["base_ns"]
    fit, check, later, labels = {}, {}, session["seconds"] + session["pause"], {}
    for name, place in places.items():
        own, noises = fx if name == session["affected"] else {}, np.random.default_rng(place["seed"])
        fit[place["topic"]] = record(session, place, own, place["path"], place["t0"], session["seconds"], noises)
        check[place["topic"]] = record(session, place, own, paths[name], later, later + session["check_seconds"], noises)
        named = {e: {key: value + base * 1e-9 if key == "at" else value for key, value in p.items() if key != "start"} for e, p in own.items()}
        labels[place["topic"]] = {"epoch_ns": int(fit[place["topic"]]["imu"][0][0]), "imu_rate": place["rate"], "sigmas": [float(s) for s in place["sigmas"]], "effects": named}
    (folder := File(out) / case).mkdir(parents=True, exist_ok=True)
    recording.write(folder / "fit.mcap", fit)
    recording.write(folder / "check.mcap", check)
    one = next(iter(places.values()))
    nuisances = {"motion": session["family"], "check_motion": session["check_family"], "motion_smoothing_s": session["width"], "reference_noise": one["ordinary"],
                 "reference_deficit": {p["topic"]: p["deficit"] for p in places.values()}, "interpolation_start": fx.get("reference_interpolation", {}).get("start"),
                 "visible": seen, "redraws": failures, **{key: one[key] for key in ("reference_rate", "reference_start")},
                 **{key: session[key] for key in ("pause", "grade", "declared", "gaps", "lost_frames")}}
    label = {"case": case, "suite": suite, "seed": int(seed), "index": int(index), "affected": places[session["affected"]]["topic"] if hidden else None,
             "strength": {name: "medium" for name in fx}, "seconds": session["seconds"], "check_seconds": session["check_seconds"], "placements": labels,
             "sessions": [labels], "nuisances": nuisances}
    return json.loads(json.dumps(label))  # plain numbers only


def generate(out, suite, seed, count, jobs=1):
    return first_hand.write_all(out, build, [(out, suite, seed, index) for index in range(count or len(EFFECTS))], jobs)


if __name__ == "__main__":
    first_hand.command_line(__doc__, SUITES, generate)
