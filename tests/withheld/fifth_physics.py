"""Measurement model and reference of the fifth origin, in the order of diagnosis.md."""
import numpy as np
from scipy import signal as filters
from scipy.interpolate import make_interp_spline
from scipy.spatial.transform import Rotation, Slerp

import fifth_motions as motions

G = 9.80665


def rotation(rotvec):
    return Rotation.from_rotvec(rotvec).as_matrix()


def log_uniform(rng, low, high):
    return float(np.exp(rng.uniform(np.log(low), np.log(high))))


# --- physics -----------------------------------------------------------------------------------------------------------------------

class Stage:
    """True motion on a fine grid of true time since t0; start is where the recording begins there."""

    def __init__(self, joints, start, seconds, rate, epoch):
        self.rate = rate * int(np.ceil(1000 / rate))
        self.start, self.seconds, self.epoch = start, seconds, epoch
        self.local = np.arange(int((seconds + 4) * self.rate) + 1) / self.rate - 2.0
        self.time = self.local + start
        self.p, self.R, self.a, self.w, self.alpha = motions.state(joints, self.local)

    def altered(self, R, a, w, alpha):
        other = object.__new__(Stage)
        other.__dict__.update(self.__dict__, R=R, a=a, w=w, alpha=alpha)
        return other


def _second_order(wn, z, rate, numerators, x):
    """Responses of s^2 + 2 z wn s + wn^2 to x (exact where x is straight between samples), started at rest."""
    out = []
    for numerator in numerators:
        b, a, _ = filters.cont2discrete((numerator, [1, 2 * z * wn, wn * wn]), 1 / rate, "foh")
        b = np.squeeze(b)
        zi = filters.lfilter_zi(b, a)
        out.append(filters.lfilter(b, a, x, axis=0, zi=zi[:, None] * x[:1])[0])
    return out


def _tissue(stage, f, natural_hz, damping_ratio):
    """The mass on its spring: the turning frame's terms are put on the right side and iterated until they settle."""
    wn, z, w, alpha = 2 * np.pi * natural_hz, damping_ratio, stage.w, stage.alpha
    d, push = None, -f
    for _ in range(60):
        before = d
        d, v = _second_order(wn, z, stage.rate, ([1.0], [1.0, 0.0]), push)
        push = -f - 2 * motions.cross(w, v) - motions.cross(alpha, d) - motions.cross(w, motions.cross(w, d))
        if not np.isfinite(d).all() or np.abs(d).max() > 0.2:
            return None
        if before is not None and np.abs(d - before).max() < 1e-8:
            return -(wn * wn * d + 2 * z * wn * v)
    return None


def back(R, v):
    return (v[:, None, :] @ R)[:, 0]


def analog(stage, e):
    """Stages 1 to 6 on the fine grid: f, w; None where the tissue does not settle."""
    mode = e.get("gravity_convention", {}).get("mode")
    gravity = np.array([0, 0, -G])
    if "reference_tilt" in e:  # seen from the reported world
        gravity = rotation(e["reference_tilt"]["rotvec"]).T @ gravity
    a = stage.a * e.get("reference_scale", {}).get("factor", 1.0) * e.get("reference_units", {}).get("factor", 1.0)
    f = back(stage.R, a + {None: -gravity, "removed": 0 * gravity, "negated": gravity}[mode])
    w = stage.w
    if "lever_arm" in e:
        arm = np.array(e["lever_arm"]["offset"])
        f = f + motions.cross(stage.alpha, arm) + motions.cross(w, motions.cross(w, arm))
    if "soft_tissue" in e:
        f = _tissue(stage, f, **e["soft_tissue"])
        if f is None:
            return None
    t = stage.time[:, None]
    mount = rotation(e["mount_rotation"]["rotvec"]) if "mount_rotation" in e else np.eye(3)
    f, w = f @ mount, w @ mount
    if "mount_slip" in e:
        slip, after = rotation(e["mount_slip"]["rotvec"]), t >= e["mount_slip"]["at"] - stage.epoch
        f, w = np.where(after, f @ slip, f), np.where(after, w @ slip, w)
    if "axis_convention" in e:
        M = np.array(e["axis_convention"]["matrix"])
        f, w = f @ M.T, w @ M.T
    if "vibration" in e:
        v = e["vibration"]
        f = f + np.array(v["amplitude"]) * np.sin(2 * np.pi * v["hz"] * t + np.array(v["phase"]))
        w = w + np.array(v["gyro_amplitude"]) * np.sin(2 * np.pi * v["hz"] * t + np.array(v["gyro_phase"]))
    if "gyro_g_sensitivity" in e:
        w = w + f @ np.array(e["gyro_g_sensitivity"]["matrix"]).T
    if "low_pass" in e:
        wn = 2 * np.pi * e["low_pass"]["cutoff_hz"]
        f, w = (_second_order(wn, np.sqrt(0.5), stage.rate, ([wn * wn],), x)[0] for x in (f, w))
    return f, w


def _at(stage, x, time):
    """Six-point Lagrange on the fine grid."""
    s = (time - stage.time[0]) * stage.rate
    i = np.clip(np.floor(s).astype(int), 2, len(x) - 4)
    u = s - i
    out = 0
    for k in range(-2, 4):
        weight = np.prod([(u - m) / (k - m) for m in range(-2, 4) if m != k], axis=0)
        out = out + weight[:, None] * x[i + k]
    return out


def _upper(e):
    xy, xz, yz = e["upper"]  # a list in this order
    return np.eye(3) + np.array([[0, xy, xz], [0, 0, yz], [0, 0, 0]])


def readings(stage, e, stamps):
    """Stages 1 to 7 at the IMU's stamps (seconds since t0): [f, w] without noise."""
    grid = analog(stage, e)
    if grid is None:
        return None
    time = (stamps - e.get("time_offset", {}).get("seconds", 0.0)) / (1 + 1e-6 * e.get("clock_drift", {}).get("ppm", 0.0))
    late = e.get("channel_delay", {}).get("seconds", 0.0)
    out = []
    for channel, x, at in (("accel", grid[0], time), ("gyro", grid[1], time - late)):
        x = _at(stage, x, at)
        if channel + "_misalignment" in e:
            x = x @ _upper(e[channel + "_misalignment"]).T
        x = x * np.array(e.get(channel + "_scale", {}).get("scale", 1.0)) + np.array(e.get(channel + "_bias", {}).get("bias", 0.0))
        out.append(x + np.array(e.get(channel + "_bias_drift", {}).get("rate", [0.0] * 3)) * time[:, None])
    return out


def digital(both, e, noise=(0.0, 0.0), rng=None, coarse=True):
    """Stage 8; noise is the standard deviation per sample."""
    out = []
    for channel, x, sigma in zip(("accel", "gyro"), both, noise):
        x = x if rng is None else x + rng.normal(0, 1, x.shape) * sigma
        limit = e.get(channel + "_saturation", {}).get("limit", np.inf)
        x = np.clip(x, -limit, limit)
        if coarse and channel + "_quantization" in e:
            lsb = e[channel + "_quantization"]["lsb"]
            x = np.round(x / lsb) * lsb
        out.append(x * e.get(channel + "_units", {}).get("factor", 1.0))
    return out


# --- reference ---------------------------------------------------------------------------------------------------------------------

def _zero_phase(x, rate, cutoff, kernel):
    """Overall -3 dB at the cutoff, whichever kernel."""
    if kernel == "gaussian":
        reach = np.sqrt(np.log(2)) / (2 * np.pi * cutoff) * rate
        taps = np.exp(-0.5 * (np.arange(-int(5 * reach) - 1, int(5 * reach) + 2) / reach) ** 2)
        padded = np.pad(x, ((len(taps) // 2,) * 2, (0, 0)), mode="edge")
        return filters.oaconvolve(padded, (taps / taps.sum())[:, None], mode="valid", axes=0)
    order = int(kernel[-1])
    edge = cutoff / (np.sqrt(2) - 1) ** (1 / (2 * order))
    return filters.sosfiltfilt(filters.butter(order, min(edge, 0.45 * rate), fs=rate, output="sos"), x, axis=0)


def _even(q):
    flips = np.where((q[1:] * q[:-1]).sum(1) < 0, -1.0, 1.0)
    return q * np.concatenate([[1.0], np.cumprod(flips)])[:, None]


def _smooth_pose(p, q, rate, cutoff, kernel):
    q = _zero_phase(_even(q), rate, cutoff, kernel)
    return _zero_phase(p, rate, cutoff, kernel), q / np.linalg.norm(q, axis=1)[:, None]


def _chords(time, p, q, rate, phase):
    """Frames of the rate, straight chords between them."""
    frames = np.arange(int((time[-1] - time[0]) * rate) + 3) / rate + time[0] - phase / rate
    sample = make_interp_spline(time, np.hstack([p, _even(q)]), 5)(np.clip(frames, time[0], time[-1]))
    p = np.stack([np.interp(time, frames, sample[:, k]) for k in range(3)], 1)
    return p, Slerp(frames, Rotation.from_quat(sample[:, 3:]))(np.clip(time, frames[0], frames[-1])).as_quat()


class Lens:
    """How the reference sees: rate, ordinary noise, memory, gaps."""

    def __init__(self, rng, rate=None):
        self.rate = rate or float(rng.choice([30, 50, 60, 90, 100, 120, 150, 200, 240, 300, 360]))
        self.position, self.rotation = log_uniform(rng, 0.05e-3, 0.9e-3), np.radians(log_uniform(rng, 0.02, 0.22))
        self.memory = 0.0 if rng.random() < 0.5 else float(np.exp(-1 / rng.uniform(1.0, 4.0)))
        self.losses = str(rng.choice(["none"] * 8 + ["frames", "gaps"]))
        self.kernel = str(rng.choice(["gaussian", "butterworth 2", "butterworth 4"]))
        self.phase, self.lead, self.tail = rng.uniform(0.0, 1.0), rng.uniform(1.5, 2.4), rng.uniform(1.5, 2.4)
        self.noise_first = bool(rng.random() < 0.5)  # noise before smoothing / chords or after

    def noise(self, rng, n, extra=None):
        out = rng.normal(0, 1, (n, 6))
        if self.memory:
            out = filters.lfilter([np.sqrt(1 - self.memory ** 2)], [1, -self.memory], out, axis=0)
        sizes = np.array([self.position] * 3 + [self.rotation] * 3)
        out = out * sizes
        if extra:
            out = out + rng.normal(0, 1, (n, 6)) * np.sqrt(np.maximum(0, np.array([extra["position"]] * 3 + [extra["rotation"]] * 3) ** 2 - sizes ** 2))
        return out

    def times(self, stage):
        return np.arange(-self.lead, stage.seconds + self.tail, 1 / self.rate) + (self.phase / self.rate)

    def leaves(self, extra=None, cutoff=10.0):
        """Standard deviations of what its noise leaves in a simulation (accel, gyro), below the cutoff."""
        x = self.noise(np.random.default_rng(1), 8000, extra)
        x = filters.sosfiltfilt(filters.butter(2, min(cutoff, 0.4 * self.rate), fs=self.rate, output="sos"), x, axis=0)[200:-200]
        step = 1 / self.rate
        accel = np.diff(x[:, :3], 2, axis=0).std() / step ** 2
        return float(np.hypot(accel, G * x[:, 3:].std())), float(np.diff(x[:, 3:], axis=0).std() / step)

    def reported(self, stage, joints, e, rng):
        """Stamps (seconds since t0, true time), positions and quaternions as they are reported."""
        local = self.times(stage)
        p, R, *_ = motions.state(joints, local)
        q = motions.quaternion(R)
        units = e.get("reference_units", {}).get("factor", 1.0)
        noise = self.noise(rng, len(local), e.get("reference_noise"))

        def noisy(p, q):
            return p + noise[:, :3], (Rotation.from_quat(q) * Rotation.from_rotvec(noise[:, 3:])).as_quat()
        p = p * e.get("reference_scale", {}).get("factor", 1.0)
        if self.noise_first:
            p, q = noisy(p, q)
        if "reference_smoothing" in e:
            p, q = _smooth_pose(p, q, self.rate, e["reference_smoothing"]["cutoff_hz"], self.kernel)
        if "reference_interpolation" in e:
            p, q = _chords(local, p, q, e["reference_interpolation"]["rate_hz"], self.phase)
        if not self.noise_first:
            p, q = noisy(p, q)
        if "reference_tilt" in e:
            tilt = Rotation.from_rotvec(e["reference_tilt"]["rotvec"])
            p, q = tilt.apply(p), (tilt * Rotation.from_quat(q)).as_quat()
        keep = self.kept(rng, len(local))
        return local[keep] + stage.start, p[keep] * units, _even(q)[keep]

    def kept(self, rng, n):
        keep = np.ones(n, bool)
        if self.losses == "frames":
            keep = rng.random(n) > rng.uniform(0.005, 0.03)
        if self.losses == "gaps":
            for _ in range(rng.integers(1, 5)):
                at = rng.integers(int(2.5 * self.rate), n - int(4 * self.rate))
                keep[at:at + int(rng.uniform(0.1, 1.5) * self.rate)] = False
        return keep

    def simulated(self, stage, joints, e, cutoff=None):
        """The motion that a simulation finds in noise-free reported poses, on the stage's grid."""
        local = self.times(stage)
        p, R, *_ = motions.state(joints, local)
        q = _even(motions.quaternion(R))
        if "reference_smoothing" in e:
            p, q = _smooth_pose(p, q, self.rate, e["reference_smoothing"]["cutoff_hz"], self.kernel)
        if "reference_interpolation" in e:
            p, q = _chords(local, p, q, e["reference_interpolation"]["rate_hz"], self.phase)
        if cutoff:
            p, q = _smooth_pose(p, q, self.rate, min(cutoff, 0.4 * self.rate), "butterworth 2")
        curve = make_interp_spline(local, np.hstack([p, _even(q)]), 5)
        inside = np.clip(stage.local, local[0], local[-1])
        x, d, dd = (curve(inside, k) for k in range(3))
        q = Rotation.from_quat(x[:, 3:])

        def twice_imaginary(v):  # 2 Im(q* v)
            u, s = -q.as_quat()[:, :3], q.as_quat()[:, 3:]
            return 2 * (s * v[:, :3] + v[:, 3:] * u + motions.cross(u, v[:, :3]))
        same = np.sign((q.as_quat() * x[:, 3:]).sum(1))[:, None] / np.linalg.norm(x[:, 3:], axis=1)[:, None]
        return stage.altered(q.as_matrix(), dd[:, :3], twice_imaginary(d[:, 3:] * same), twice_imaginary(dd[:, 3:] * same))
