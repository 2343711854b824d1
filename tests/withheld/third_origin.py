#!/usr/bin/env python3
"""Cases of a third generator, written from the contract alone by somebody who had seen neither of the others: its own motions (`third_motions.py`), strengths, rates and nuisances,
its own reading of the measurement model; it shares only the files' form with the rest. Times are seconds from t0 throughout."""
import os

import numpy as np
from scipy import signal
from scipy.interpolate import CubicSpline
from scipy.ndimage import gaussian_filter1d
from scipy.spatial.transform import Rotation, Slerp

import generate as first_hand
import recording
import third_motions

SUITES = ("third-single", "third-pair", "third-triple", "third-none", "third-placement", "third-smoothing")
G = np.array([0, 0, -9.80665])
RAD = np.pi / 180


# ---------------------------------------------------------------- measurement model
def soft_tissue(f, w, alpha, wn, z, h):
    """d'' = -wn^2 d - 2 z wn d' - f - 2 w x d' - alpha x d - w x (w x d) by RK4 of step 2 h on the grid of step h, in many pieces side by side:
    each piece carries six basis solutions and a particular one, which are then joined. Returns the reading on the grid."""
    n, pieces = len(f), 96
    steps = int(np.ceil((n - 1) / 2 / pieces))
    pad = 2 * steps * pieces + 1 - n
    f, w, alpha = (np.concatenate([x, np.repeat(x[-1:], pad, 0)]) for x in (f, w, alpha))

    def cross(v):
        m = np.zeros((len(v), 3, 3))
        m[:, 0, 1], m[:, 0, 2], m[:, 1, 2] = -v[:, 2], v[:, 1], -v[:, 0]
        return m - m.transpose(0, 2, 1)
    W = cross(w)
    stiff = -(wn ** 2 * np.eye(3) + cross(alpha) + W @ W)
    damp = -(2 * z * wn * np.eye(3) + 2 * W)
    begin = np.arange(pieces) * 2 * steps

    def slope(x, k):
        i = begin + k
        out = np.empty_like(x)
        out[:, :3] = x[:, 3:]
        out[:, 3:] = stiff[i] @ x[:, :3] + damp[i] @ x[:, 3:]
        out[:, 3:, 6] -= f[i]
        return out
    x = np.zeros((pieces, 6, 7))
    x[:, :, :6] = np.eye(6)
    path = np.empty((steps + 1, pieces, 6, 7))
    path[0], dt = x, 2 * h
    for s in range(steps):
        k1 = slope(x, 2 * s)
        k2 = slope(x + dt / 2 * k1, 2 * s + 1)
        k3 = slope(x + dt / 2 * k2, 2 * s + 1)
        k4 = slope(x + dt * k3, 2 * s + 2)
        x = x + dt / 6 * (k1 + 2 * k2 + 2 * k3 + k4)
        path[s + 1] = x
    start = np.empty((pieces, 6))
    now = np.concatenate([-f[0] / wn ** 2, np.zeros(3)])  # its sag
    for p in range(pieces):
        start[p] = now
        now = path[-1, p, :, :6] @ now + path[-1, p, :, 6]
    state = np.einsum("spij,pj->psi", path[:-1, :, :, :6], start) + path[:-1, :, :, 6].transpose(1, 0, 2)
    state = np.concatenate([state.reshape(-1, 6), now[None]])
    read = -(wn ** 2 * state[:, :3] + 2 * z * wn * state[:, 3:])
    return CubicSpline(np.arange(len(read)) * 2, read)(np.arange(n))


def butterworth(x, cutoff, fs):
    wc = 2 * np.pi * cutoff
    num, den, _ = signal.cont2discrete(([wc ** 2], [1, np.sqrt(2) * wc, wc ** 2]), 1 / fs, method="foh")
    num = np.ravel(num)
    return signal.lfilter(num, den, x, axis=0, zi=signal.lfilter_zi(num, den)[:, None] * x[0])[0]


def device(motion, t, e, fs=2000.0, slip_at=None):
    """Stages 1 to 7 at true times t. Returns gyro, accel."""
    grid = np.arange(np.floor((t[0] - 1.0) * fs), np.ceil((t[-1] + 0.3) * fs) + 1) / fs
    a, R, w, alpha = motion.full(grid)
    mode = e.get("gravity_convention", {}).get("mode")
    f = R.inv().apply(a - (G if mode is None else 0 * G if mode == "removed" else -G))
    if "lever_arm" in e:
        arm = np.broadcast_to(e["lever_arm"]["offset"], f.shape)
        f = f + np.cross(alpha, arm) + np.cross(w, np.cross(w, arm))
    if "soft_tissue" in e:
        f = soft_tissue(f, w, alpha, 2 * np.pi * e["soft_tissue"]["natural_hz"], e["soft_tissue"]["damping_ratio"], 1 / fs)
    if "mount_rotation" in e or "mount_slip" in e:
        mount = Rotation.from_rotvec(e["mount_rotation"]["rotvec"] if "mount_rotation" in e else np.zeros(3))
        f0, w0, f, w = f, w, mount.inv().apply(f), mount.inv().apply(w)
        if "mount_slip" in e:
            after = grid >= slip_at
            turned = mount * Rotation.from_rotvec(e["mount_slip"]["rotvec"])
            if after.any():
                f[after], w[after] = turned.inv().apply(f0[after]), turned.inv().apply(w0[after])
    if "axis_convention" in e:
        M = np.array(e["axis_convention"]["matrix"])
        f, w = f @ M.T, w @ M.T
    if "vibration" in e:
        v = e["vibration"]
        f = f + np.array(v["amplitude"]) * np.sin(2 * np.pi * v["hz"] * grid[:, None] + np.array(v["phase"]))
        w = w + np.array(v["gyro_amplitude"]) * np.sin(2 * np.pi * v["hz"] * grid[:, None] + np.array(v["gyro_phase"]))
    if "gyro_g_sensitivity" in e:
        w = w + f @ np.array(e["gyro_g_sensitivity"]["matrix"]).T
    if "low_pass" in e:
        f, w = butterworth(f, e["low_pass"]["cutoff_hz"], fs), butterworth(w, e["low_pass"]["cutoff_hz"], fs)
    late = e.get("channel_delay", {}).get("seconds", 0.0)
    # straddling a slip the cubic would ring within a millisecond; nothing to speak of
    f, w = CubicSpline(grid, f)(t), CubicSpline(grid, w)(t - late)
    out = []
    for channel, x in (("gyro", w), ("accel", f)):
        matrix = np.eye(3)
        if f"{channel}_misalignment" in e:
            xy, xz, yz = e[f"{channel}_misalignment"]["upper"]
            matrix[0, 1], matrix[0, 2], matrix[1, 2] = xy, xz, yz
        if f"{channel}_scale" in e:
            matrix = np.diag(e[f"{channel}_scale"]["scale"]) @ matrix
        x = x @ matrix.T
        if f"{channel}_bias" in e:
            x = x + e[f"{channel}_bias"]["bias"]
        if f"{channel}_bias_drift" in e:
            x = x + np.array(e[f"{channel}_bias_drift"]["rate"]) * t[:, None]
        out.append(x)
    return out


def finish(x, channel, e, sigma, rate, rng):
    """Stage 8."""
    if rng is not None:
        x = x + sigma * rng.normal(size=x.shape)
        if f"{channel}_noise" in e:
            x = x + e[f"{channel}_noise"]["density"] * np.sqrt(rate) * rng.normal(size=x.shape)
    if f"{channel}_saturation" in e:
        limit = e[f"{channel}_saturation"]["limit"]
        x = np.clip(x, -limit, limit)
    if f"{channel}_quantization" in e:
        lsb = e[f"{channel}_quantization"]["lsb"]
        x = np.round(x / lsb) * lsb
    return x * e.get(f"{channel}_units", {}).get("factor", 1.0)


def clock(e):
    return 1 + e.get("clock_drift", {}).get("ppm", 0.0) * 1e-6, e.get("time_offset", {}).get("seconds", 0.0)


def lose(rng, n, fraction, burst):
    """Two states: losses begin by chance and last a geometric number of samples."""
    begin, end = fraction / (burst * (1 - fraction)), 1 / burst
    keep, lost, draws = np.ones(n, bool), False, rng.random(n)
    for k in range(n):
        lost = draws[k] >= end if lost else draws[k] < begin
        keep[k] = not lost
    return keep


def reference(motion, begin, end, e, case, rng):
    """Reported frames (t, position, rotation). rng None: without noise."""
    rate, extra = case["ref_rate"], 2.0
    t = begin + np.arange(-int(extra * rate), int((end - begin + extra) * rate) + 1) / rate
    noise_p, noise_r = case["ref_noise"]
    if "reference_noise" in e:
        noise_p, noise_r = e["reference_noise"]["position"], e["reference_noise"]["rotation"]

    def shaken(p, R):
        if rng is None:
            return p, R
        return p + noise_p * rng.normal(size=p.shape), R * Rotation.from_rotvec(noise_r * rng.normal(size=p.shape))
    changed = "reference_smoothing" in e or "reference_interpolation" in e
    before = changed and case["noise_within"]
    if "reference_interpolation" in e:
        own = e["reference_interpolation"]["rate_hz"]
        frames = np.arange(t[0] - case["frame_phase"] / own, t[-1] + 2 / own, 1 / own)
        p, R = motion.pose(frames)
        if before:
            p, R = shaken(p, R)
        p, R = np.stack([np.interp(t, frames, p[:, k]) for k in range(3)], 1), Slerp(frames, R)(t)
    else:
        p, R = motion.pose(t)
        if before:
            p, R = shaken(p, R)
    if "reference_smoothing" in e:
        p, R = smoothed(p, R, e["reference_smoothing"]["cutoff_hz"], rate, case["kernel"])
    if "reference_scale" in e:
        p = p * e["reference_scale"]["factor"]
    if "reference_tilt" in e:
        T = Rotation.from_rotvec(e["reference_tilt"]["rotvec"])
        p, R = T.apply(p), T * R
    if not before:
        p, R = shaken(p, R)
    p = p * e.get("reference_units", {}).get("factor", 1.0)
    inside = (t >= begin - 1e-9) & (t <= end + 1e-9)
    return t[inside], p[inside], R[np.flatnonzero(inside)]


def smoothed(p, R, cutoff, rate, kernel):
    q = R.as_quat()
    q = q * np.concatenate([[1.0], np.cumprod(np.where(np.sum(q[1:] * q[:-1], axis=1) < 0, -1.0, 1.0))])[:, None]
    if kernel == "butter2":  # filtfilt as it comes: -6 dB at the cutoff
        sos = signal.butter(2, cutoff, fs=rate, output="sos")
    elif kernel == "winter":  # the biomechanist's: both passes together -3 dB at the cutoff
        sos = signal.butter(2, min(cutoff / (2 ** 0.5 - 1) ** 0.25, 0.45 * rate), fs=rate, output="sos")
    else:
        sos = signal.butter(4, cutoff, fs=rate, output="sos")
    return signal.sosfiltfilt(sos, p, axis=0), Rotation.from_quat(signal.sosfiltfilt(sos, q, axis=0))


# ---------------------------------------------------------------- what may hide
EFFECTS = ["reference_noise", "reference_smoothing", "reference_interpolation", "reference_tilt", "reference_scale", "reference_units", "mount_rotation", "lever_arm", "mount_slip",
           "soft_tissue", "time_offset", "clock_drift", "channel_delay", "dropped_samples", "accel_bias", "gyro_bias", "accel_scale", "gyro_scale", "accel_misalignment",
           "gyro_misalignment", "accel_noise", "gyro_noise", "accel_bias_drift", "gyro_bias_drift", "accel_saturation", "gyro_saturation", "accel_quantization", "gyro_quantization",
           "low_pass", "gyro_g_sensitivity", "vibration", "axis_convention", "accel_units", "gyro_units", "gravity_convention"]
REFERENCE = ("reference_smoothing", "reference_interpolation", "reference_tilt", "reference_scale", "reference_units")
SEEN = ("dropped_samples", "accel_noise", "gyro_noise", "accel_quantization", "gyro_quantization", "reference_noise", "reference_units", "accel_units", "gyro_units",
        "axis_convention", "gravity_convention")  # judged by their own figures, or not to be overlooked
APART = [("axis_convention", "mount_rotation"), ("accel_units", "accel_scale"), ("gyro_units", "gyro_scale"), ("reference_units", "reference_scale"), ("reference_units", "reference_noise"),
         ("accel_units", "gravity_convention"), ("gravity_convention", "reference_tilt"), ("gravity_convention", "soft_tissue"), ("gravity_convention", "accel_saturation"),
         ("reference_smoothing", "reference_interpolation"), ("reference_smoothing", "reference_noise"), ("reference_interpolation", "reference_noise"),
         ("accel_noise", "accel_quantization"), ("gyro_noise", "gyro_quantization"), ("soft_tissue", "low_pass"), ("reference_units", "accel_units"), ("reference_units", "gravity_convention"),
         ("axis_convention", "accel_misalignment"), ("axis_convention", "gyro_misalignment"), ("accel_units", "reference_scale"), ("reference_scale", "accel_scale")]


def lu(rng, low, high):
    return float(np.exp(rng.uniform(np.log(low), np.log(high))))


def pm(rng, low, high):
    return lu(rng, low, high) * rng.choice([-1.0, 1.0])


def way(rng):
    v = rng.normal(size=3)
    return v / np.linalg.norm(v)


def draw(name, rng, case):
    rate, (sa, sg) = case["imu_rate"], case["sigmas"]
    if name == "reference_noise":
        kind = rng.integers(3)
        p, r = case["ref_noise"]
        return {"position": lu(rng, 1.3e-3, 5e-3) if kind != 1 else p, "rotation": lu(rng, 0.35, 1.5) * RAD if kind != 2 else r}
    if name == "reference_smoothing":
        return {"cutoff_hz": lu(rng, 2.5, 9)}
    if name == "reference_interpolation":
        return {"rate_hz": rng.choice([15, 20, 24, 25, 29.97, 30, 50]) if rng.random() < 0.5 else lu(rng, 14, 50)}
    if name == "reference_tilt":
        angle = rng.uniform(0, 2 * np.pi)
        return {"rotvec": (lu(rng, 0.8, 5) * RAD * np.array([np.cos(angle), np.sin(angle), 0])).tolist()}
    if name == "reference_scale":
        return {"factor": 1 + pm(rng, 0.02, 0.12)}
    if name == "reference_units":
        return {"factor": float(rng.choice([1000.0, 100.0, 1 / 0.0254], p=[0.6, 0.28, 0.12]))}
    if name == "mount_rotation":
        return {"rotvec": (lu(rng, 3, 45) * RAD * way(rng)).tolist()}
    if name == "lever_arm":
        return {"offset": (lu(rng, 0.02, 0.18) * way(rng)).tolist()}
    if name == "mount_slip":
        return {"at": float(rng.uniform(0.33, 0.67) * case["seconds"]), "rotvec": (lu(rng, 3, 20) * RAD * way(rng)).tolist()}
    if name == "soft_tissue":
        return {"natural_hz": lu(rng, 4, 15), "damping_ratio": rng.uniform(0.1, 0.5)}
    if name == "time_offset":
        return {"seconds": pm(rng, 0.005, 0.09)}
    if name == "clock_drift":
        return {"ppm": pm(rng, 50, 500)}
    if name == "channel_delay":
        return {"seconds": pm(rng, 0.003, 0.02) if rng.random() < 0.4 else lu(rng, 0.003, 0.02)}
    if name == "dropped_samples":
        return {"fraction": lu(rng, 0.01, 0.12), "mean_burst": float(rng.choice([1, 1, 2, 3, 5, 10]))}
    if name.endswith("_bias"):
        return {"bias": (lu(rng, *((0.08, 0.8) if name[0] == "a" else (0.006, 0.1))) * way(rng)).tolist()}
    if name.endswith("_scale"):
        if rng.random() < 0.3:  # all axes alike, as from a wrong reference voltage
            return {"scale": [1 + pm(rng, 0.015, 0.08)] * 3}
        return {"scale": (1 + rng.normal(0, lu(rng, 0.01, 0.05), 3)).tolist()}
    if name.endswith("_misalignment"):
        return {"upper": rng.normal(0, lu(rng, 0.01, 0.05), 3).tolist()}
    if name.endswith("_noise"):
        return {"density": (sa if name[0] == "a" else sg) / np.sqrt(rate) * lu(rng, 1.7, 10)}
    if name.endswith("_bias_drift"):
        return {"rate": (lu(rng, *((0.1, 1.0) if name[0] == "a" else (0.01, 0.12))) / case["seconds"] * way(rng)).tolist()}
    if name.endswith("_saturation"):
        return {"limit": None, "share": lu(rng, 0.004, 0.06)}
    if name == "accel_quantization":
        return {"lsb": 2 * rng.choice([2, 4, 8, 16]) * 9.80665 / 2 ** rng.choice([8, 9, 10, 12])}
    if name == "gyro_quantization":
        return {"lsb": 2 * rng.choice([250, 500, 1000, 2000]) * RAD / 2 ** rng.choice([8, 9, 10, 12])}
    if name == "low_pass":
        return {"cutoff_hz": lu(rng, 4, min(40, 0.35 * rate))}
    if name == "gyro_g_sensitivity":
        return {"matrix": rng.normal(0, lu(rng, 4e-4, 4e-3), (3, 3)).tolist()}
    if name == "vibration":
        hz = lu(rng, 8, min(60, 0.42 * rate))
        kind = rng.integers(3)  # accelerometer, both, gyroscope
        size, gyro = lu(rng, 0.3, 3) * np.abs(way(rng)), lu(rng, 0.02, 0.3) * np.abs(way(rng))
        return {"hz": hz, "amplitude": (size * (kind != 2 or rng.random() < 0.5)).tolist(), "phase": rng.uniform(0, 2 * np.pi, 3).tolist(),
                "gyro_amplitude": (gyro * (kind != 0)).tolist(), "gyro_phase": rng.uniform(0, 2 * np.pi, 3).tolist()}
    if name == "axis_convention":
        while True:
            M = np.eye(3)[rng.permutation(3)] * rng.choice([-1.0, 1.0], 3)[:, None]
            if not np.array_equal(M, np.eye(3)) and (np.linalg.det(M) > 0 or rng.random() < 0.3):
                return {"matrix": M.tolist()}
    if name == "accel_units":
        return {"factor": float(rng.choice([1 / 9.80665, 1000 / 9.80665, 1000.0, 100.0], p=[0.6, 0.2, 0.1, 0.1]))}
    if name == "gyro_units":
        return {"factor": float(rng.choice([180 / np.pi, 180e3 / np.pi, 1000.0], p=[0.8, 0.1, 0.1]))}
    if name == "gravity_convention":
        return {"mode": str(rng.choice(["removed", "negated"]))}
    raise KeyError(name)


# ---------------------------------------------------------------- is it visible?
def from_reference(t, p, R, at):
    """Nominal readings from poses without noise, up to some 12 Hz."""
    sigma = max(1.0, 0.013 * (1 / np.median(np.diff(t))))
    a = gaussian_filter1d(CubicSpline(t, p).derivative(2)(t), sigma, axis=0)
    q = R.as_quat()
    q = q * np.concatenate([[1.0], np.cumprod(np.where(np.sum(q[1:] * q[:-1], axis=1) < 0, -1.0, 1.0))])[:, None]
    w = gaussian_filter1d(2 * third_motions._conj_vec(q, CubicSpline(t, q).derivative(1)(t)), sigma, axis=0)
    f = R.inv().apply(a - G)
    return CubicSpline(t, w)(at), CubicSpline(t, f)(at)


def visible(motion, e, case):
    """Leaves each effect out: whitened power of what it changes (greatest over axes), all of it and what plain calibration does not take up."""
    L, step = case["seconds"], 0.02
    s = np.arange(0.7, L - 0.7, step)
    fs = 500.0
    sa, sg = case["sigmas"]
    rate_ref, rate = case["ref_rate"], case["imu_rate"]
    np_, nr = (e["reference_noise"]["position"], e["reference_noise"]["rotation"]) if "reference_noise" in e else case["ref_noise"]
    fc = 6.0
    share = np.sqrt(2 * fc / rate_ref)
    ref_a = np.hypot(np_ * (2 * np.pi * fc) ** 2 / np.sqrt(5), 9.8 * nr) * share
    ref_g = nr * 2 * np.pi * fc / np.sqrt(3) * share
    tot_a = np.sqrt(ref_a ** 2 + sa ** 2 + (e.get("accel_noise", {}).get("density", 0) ** 2 * rate) + e.get("accel_quantization", {}).get("lsb", 0) ** 2 / 12)
    tot_g = np.sqrt(ref_g ** 2 + sg ** 2 + (e.get("gyro_noise", {}).get("density", 0) ** 2 * rate) + e.get("gyro_quantization", {}).get("lsb", 0) ** 2 / 12)

    def readings(effects):
        factor, seconds = clock(effects)
        w, f = device(motion, (s - seconds) / factor, effects, fs, case.get("slip_at"))
        own = {k: v for k, v in effects.items() if not k.endswith(("_units", "_quantization"))}
        return np.concatenate([finish(f, "accel", own, 0, rate, None) / tot_a, finish(w, "gyro", own, 0, rate, None) / tot_g], axis=1)
    full, figures = readings(e), {}
    shift = lambda x: np.gradient(x, step, axis=0)
    for name in e:
        if name in SEEN:
            lsb = e[name].get("lsb")
            if lsb is not None:
                noise = np.hypot(sa if name[0] == "a" else sg, e.get(name[:5].rstrip("_") + "_noise", {}).get("density", 0) * np.sqrt(rate))
                if lsb < 2.5 * noise:
                    return None, f"{name} {lsb / noise:.2f} sigma"
                figures[name] = float(lsb / noise)
            continue
        if name in REFERENCE:
            quiet = dict(case, noise_within=False)
            mine = reference(motion, 0, L, {k: v for k, v in e.items() if k in REFERENCE and k != "reference_units"}, quiet, None)
            other = reference(motion, 0, L, {k: v for k, v in e.items() if k in REFERENCE and k not in ("reference_units", name)}, quiet, None)
            (w1, f1), (w0, f0) = from_reference(*mine, s), from_reference(*other, s)
            diff = np.concatenate([(f1 - f0) / tot_a, (w1 - w0) / tot_g], axis=1)
            if name == "reference_interpolation":  # or seen in the poses themselves
                # noise that is interpolated too leaves straight pieces, to be seen however small; else the chords stand against the noise
                chord = np.sqrt(np.mean((mine[1] - other[1]) ** 2, axis=0)).max() / max(np_, 2e-5), np.sqrt(np.mean((mine[2].inv() * other[2]).as_rotvec() ** 2, axis=0)).max() / max(nr, 2e-4)
                figures["chord_over_noise"] = float(max(chord))
                if max(chord) < 1 and not (case["noise_within"] and max(chord) > 0.3):
                    return None, f"{name} chord {max(chord):.2f}"
                continue
        else:
            diff = full - readings({k: v for k, v in e.items() if k != name})
        raw = float(np.mean(diff ** 2, axis=0).max())
        # what is left beside biases, a turn, a shift in time and a lever arm
        _, _, w, alpha = motion.full(s)
        f, w_, n = full[:, :3], full[:, 3:], len(s)
        columns = []
        for k in range(6):
            column = np.zeros((n, 6)); column[:, k] = 1
            columns.append(("accel_bias" if k < 3 else "gyro_bias", column))
        for k in range(3):
            columns.append(("mount_rotation", np.concatenate([np.cross(f, np.eye(3)[k]), np.cross(w_, np.eye(3)[k])], axis=1)))
            arm = np.broadcast_to(np.eye(3)[k], (n, 3))
            columns.append(("lever_arm", np.concatenate([np.cross(alpha, arm) + np.cross(w, np.cross(w, arm)), np.zeros((n, 3))], axis=1)))
        columns.append(("time_offset", shift(full)))
        basis = np.stack([column.ravel() for own, column in columns if own != name], axis=1)
        basis = basis / np.maximum(np.linalg.norm(basis, axis=0), 1e-12)
        left = diff.ravel() - basis @ np.linalg.lstsq(basis, diff.ravel(), rcond=1e-8)[0]
        own = float(np.mean(left.reshape(n, 6) ** 2, axis=0).max())
        figures[name] = [round(raw, 3), round(own, 3)]
        if raw < case["threshold"] or own < 0.3:
            return None, f"{name} {raw:.2f} {own:.2f}"
    return figures, None


# ---------------------------------------------------------------- cases
def nuisances(rng, names):
    imu = float(rng.choice([50, 64, 100, 100, 104, 119, 128, 200, 200, 208, 250, 256, 400, 416, 500])) * (1 + rng.uniform(-3e-3, 3e-3))
    ref = float(rng.choice([60, 90, 100, 100, 120, 120, 128, 148.15, 150, 180, 200, 240, 250, 300])) * (1 + rng.uniform(-2e-4, 2e-4) * rng.integers(2))
    if {"vibration", "soft_tissue"} & set(names) and imu < 90:
        imu *= 2
    if "reference_interpolation" in names and ref < 99:
        ref *= 2
    seconds = lu(rng, 30, 120)
    if max(imu, ref) > 290:
        seconds = min(seconds, 60)
    accel, gyro = lu(rng, 60e-6, 400e-6) * 9.80665, lu(rng, 0.003, 0.03) * RAD
    quality = rng.choice(["clean", "small", "ordinary", "ordinary"])
    noise = {"clean": (0.0, 0.0), "small": (lu(rng, 2e-5, 1e-4), lu(rng, 0.005, 0.04) * RAD), "ordinary": (lu(rng, 1e-4, 3e-4), lu(rng, 0.04, 0.1) * RAD)}[quality]
    declared = not (rng.random() < 0.08 and not {"accel_noise", "gyro_noise", "accel_quantization", "gyro_quantization"} & set(names))
    return {"imu_rate": imu, "ref_rate": ref, "seconds": seconds, "check_seconds": rng.uniform(25, 50), "pause": lu(rng, 2, 60), "sigmas": [accel * np.sqrt(imu), gyro * np.sqrt(imu)],
            "ref_noise": noise, "declared": declared, "gaps": int(rng.integers(1, 4)) if rng.random() < 0.25 else 0, "noise_within": bool(rng.random() < 0.5),
            "kernel": str(rng.choice(["butter2", "butter2", "winter", "butter4"])), "frame_phase": float(rng.random()) if rng.random() < 0.6 else 0.0,
            "stamp_ns": int(rng.choice([1, 1, 1, 1000])), "ref_lead": float(rng.uniform(-0.4, 0.4))}


def whole(value):
    return float(value) if isinstance(value, np.floating) else value


def devise(rng, names, family, place, common):
    """A device with the effects, and its two motions, so that each effect can be seen."""
    said = []
    for attempt in range(60):
        case = dict(nuisances(rng, names), threshold=2.0 if len(names) < 2 else 1.5)
        if common:
            case.update({key: common[key] for key in ("seconds", "check_seconds", "pause", "ref_rate", "stamp_ns", "ref_lead")})
        chosen = family or str(rng.choice(list(third_motions.WEIGHTS), p=np.array(list(third_motions.WEIGHTS.values())) / sum(third_motions.WEIGHTS.values())))
        spot = place or str(rng.choice(third_motions.FAMILIES[chosen][1]))
        begin = case["seconds"] + case["pause"]
        motion = third_motions.make(rng, chosen, spot, 0, case["seconds"])
        case.update(family=chosen, place=spot)
        failure = None
        for strength in range(3):
            e = {name: {key: whole(value) for key, value in draw(name, rng, case).items()} for name in EFFECTS if name in names}
            case["slip_at"] = e["mount_slip"]["at"] if "mount_slip" in e else None
            if "reference_interpolation" in e and e["reference_interpolation"]["rate_hz"] > 0.5 * case["ref_rate"]:
                e["reference_interpolation"]["rate_hz"] *= 0.5
            for channel, least, index in (("accel", 11.0, 1), ("gyro", 0.4, 0)):
                own = e.get(f"{channel}_saturation")
                if own:
                    x = device(motion, np.arange(0.5, case["seconds"] - 0.5, 0.02), {k: v for k, v in e.items()}, 500.0, case["slip_at"])[index]
                    own["limit"] = float(np.quantile(np.abs(x).max(axis=1), 1 - own.pop("share")))
                    if own["limit"] < least:
                        failure = f"{channel} limit {own['limit']:.2f}"
                        break
                    failure = None
            if failure:
                said.append(failure)
                continue
            figures, failure = visible(motion, e, case)
            if figures is not None:
                case["figures"], case["tries"] = figures, len(said)
                check = third_motions.make(rng, chosen, spot, begin, begin + case["check_seconds"])
                return case, e, motion, check
            said.append(failure)
    return None


def record(motion, begin, end, case, e, rng, epoch_ns, first):
    """One placement of one recording. first: the fit recording, whose first message is t0."""
    factor, seconds = clock(e)
    rate = case["imu_rate"]
    start = 0.0 if first else begin + rng.uniform(0, 1 / rate)
    true = (start - seconds) / factor + np.arange(int((end - begin) * rate)) / rate
    stamps = true * factor + seconds
    w, f = device(motion, true, e, slip_at=case["slip_at"])
    sa, sg = case["sigmas"]
    w, f = finish(w, "gyro", e, sg, rate, rng), finish(f, "accel", e, sa, rate, rng)
    keep = np.ones(len(true), bool)
    if "dropped_samples" in e:
        keep = lose(rng, len(true), **{"fraction": e["dropped_samples"]["fraction"], "burst": e["dropped_samples"]["mean_burst"]})
        keep[0] |= first
    ns = np.round(stamps * 1e9 / case["stamp_ns"]).astype(np.int64) * case["stamp_ns"] + epoch_ns
    t, p, R = reference(motion, begin + case["ref_lead"], end + case["ref_lead"] * 0.5, e, case, rng)
    there = np.ones(len(t), bool)
    for _ in range(case["gaps"]):
        at, last = rng.uniform(begin + 4, end - 4), lu(rng, 0.1, 1.5)
        there &= (t < at) | (t > at + last)
    variances = [np.full(3, x ** 2 if case["declared"] else 0.0) for x in (sg, sa)]
    return {"reference": (np.round(t[there] * 1e9).astype(np.int64) + epoch_ns, p[there], R.as_quat()[there]), "imu": (ns[keep], w[keep], f[keep]), "variances": variances}


def names_of(suite, index, rng):
    if suite in ("third-single", "third-placement"):
        order = EFFECTS if suite == "third-single" else list(np.random.default_rng(5).permutation(EFFECTS))
        return [str(order[index % len(order)])]
    if suite == "third-none":
        return []
    while True:
        names = [str(name) for name in rng.choice(EFFECTS, 2 if suite == "third-pair" else 3, replace=False)]
        if suite == "third-smoothing":  # beside one other, or two
            names = ["reference_smoothing", *(name for name in names if name != "reference_smoothing")][:2 + index % 2]
        if not any(a in names and b in names for a, b in APART):
            return names


def build(job):
    """Writes one case; its label, or none where nothing of what was drawn could be seen."""
    out, suite, seed, index = job
    rng = np.random.default_rng([303, seed, index, sum(map(ord, suite))])
    names = names_of(suite, index, rng)
    case_id = f"{np.random.default_rng([7, seed, index, sum(map(ord, suite))]).integers(16 ** 10):010x}"
    epoch = int(rng.integers(1_600_000_000, 1_790_000_000)) * 1_000_000_000 + int(rng.integers(1_000_000_000)) // 1000 * 1000
    if suite == "third-placement":
        family = str(rng.choice(["walk", "run", "lift", "row", "dance", "pedal", "gesture"]))
        common, spots = nuisances(rng, names), [str(x) for x in rng.permutation(third_motions.FAMILIES[family][1])[:3]]
        if "reference_interpolation" in names and common["ref_rate"] < 99:
            common["ref_rate"] *= 2
        places = {}
        for k, spot in enumerate(spots):
            places[spot] = spot
        for k in range(3 - len(spots)):
            places[f"{spots[0]}_{k + 2}"] = spots[0]
        affected = str(rng.choice(sorted(places)))
    else:
        family, common, places, affected = None, None, {"only": None}, "only" if names else None
    items, label_places, nuisance = {"fit": {}, "check": {}}, {}, {}
    for name, spot in places.items():
        devised = devise(rng, names if affected == name else [], family, spot, common)
        if devised is None:
            return None
        case, e, fit, check = devised
        topic = case["place"] if name == "only" else name
        if name == "only" and affected:
            affected = topic
        begin = case["seconds"] + case["pause"]
        own = epoch + (int(rng.integers(0, 9_000_000)) if suite == "third-placement" else 0)
        items["fit"][topic] = record(fit, 0.0, case["seconds"], case, e, rng, own, True)
        items["check"][topic] = record(check, begin, begin + case["check_seconds"], case, e, rng, own, False)
        own = int(items["fit"][topic]["imu"][0][0])
        shown = {key: dict(value) for key, value in e.items()}
        if "mount_slip" in shown:
            shown["mount_slip"]["at"] += own * 1e-9
        label_places[topic] = {"epoch_ns": own, "imu_rate": case["imu_rate"], "sigmas": list(map(float, case["sigmas"])), "effects": shown}
        nuisance[topic] = {key: case[key] for key in ("family", "place", "ref_rate", "ref_noise", "declared", "gaps", "noise_within", "kernel", "frame_phase", "pause", "figures", "tries")}
    os.makedirs(os.path.join(out, case_id))
    for kind, placements in items.items():
        recording.write(os.path.join(out, case_id, f"{kind}.mcap"), placements)
    return {"case": case_id, "suite": suite, "seed": seed, "index": index, "affected": affected, "strength": {name: "medium" for name in names}, "seconds": case["seconds"],
            "check_seconds": case["check_seconds"], "placements": label_places, "sessions": [label_places], "nuisances": nuisance}


def generate(out, suite, seed, count, jobs=1):
    return first_hand.write_all(out, build, [(out, suite, seed, index) for index in range(count or 20)], jobs)


if __name__ == "__main__":
    first_hand.command_line(__doc__, SUITES, generate)
