"""The measurement model of the contract, stage by stage, for one placement. `effects`: name -> parameters, as in effects.yaml."""
import numpy as np
from scipy.interpolate import CubicSpline
from scipy.linalg import expm
from scipy.signal import butter, lfilter, sosfiltfilt
from scipy.ndimage import gaussian_filter1d
from scipy.spatial.transform import Rotation, Slerp

GRAVITY = np.array([0.0, 0.0, -9.80665])
DENSE_RATE = 2000.0  # Hz at least, for the continuous stages
WARM_UP = 3.0  # s


def _second_order(values, step, natural, damping, lead):
    """(lead s + natural^2) / (s^2 + damping s + natural^2), exact for input that is straight between samples."""
    # state z, z' with z'' = -natural^2 z - damping z' + u and output natural^2 z + lead z'; u and its change ride along
    block = np.zeros((4, 4))
    block[0, 1], block[1, :3], block[2, 3] = step, [-natural**2 * step, -damping * step, step], 1.0
    power = expm(block)
    transition, now, later = power[:2, :2], power[:2, 2] - power[:2, 3], power[:2, 3]
    # the recursion z[k+1] = transition z[k] + now u[k] + later u[k+1] as a transfer function, so that lfilter runs it
    output = np.array([natural**2, lead])
    adjugate = np.array([[transition[1, 1], -transition[0, 1]], [-transition[1, 0], transition[0, 0]]])
    numerator = [output @ later, output @ now - output @ adjugate @ later, -output @ adjugate @ now]
    denominator = [1.0, -np.trace(transition), np.linalg.det(transition)]
    return values[0] + lfilter(numerator, denominator, values - values[0], axis=0)


def _cross(a, b):
    return (a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0])


def soft_tissue(force, rate, change, step, natural_hz, damping_ratio):
    """A mass on spring and damper in the turning segment frame, by Runge and Kutta's method over two steps; all in segment axes."""
    square, damper = (2 * np.pi * natural_hz) ** 2, 4 * np.pi * natural_hz * damping_ratio

    def slope(d, speed, f, w, alpha):
        coriolis, euler, centrifugal = _cross(w, speed), _cross(alpha, d), _cross(w, _cross(w, d))
        return [-square * d[i] - damper * speed[i] - f[i] - 2 * coriolis[i] - euler[i] - centrifugal[i] for i in range(3)]

    def moved(value, by, factor):
        return [a + factor * b for a, b in zip(value, by)]

    f, w, alpha = force.tolist(), rate.tolist(), change.tolist()
    d, speed, h = [-x / square for x in f[0]], [0.0] * 3, 2 * step
    out = [d + speed]
    for k in range(0, len(f) - 2, 2):
        a = speed, slope(d, speed, f[k], w[k], alpha[k])
        b = moved(speed, a[1], h / 2), slope(moved(d, a[0], h / 2), moved(speed, a[1], h / 2), f[k + 1], w[k + 1], alpha[k + 1])
        c = moved(speed, b[1], h / 2), slope(moved(d, b[0], h / 2), moved(speed, b[1], h / 2), f[k + 1], w[k + 1], alpha[k + 1])
        e = moved(speed, c[1], h), slope(moved(d, c[0], h), moved(speed, c[1], h), f[k + 2], w[k + 2], alpha[k + 2])
        d, speed = ([x + h / 6 * (p + 2 * q + 2 * r + s) for x, p, q, r, s in zip(own, a[i], b[i], c[i], e[i])] for i, own in enumerate((d, speed)))
        out.append(d + speed)
    read = -np.array(out) @ np.vstack([square * np.eye(3), damper * np.eye(3)])
    at = np.arange(len(f))
    return np.column_stack([np.interp(at, at[:2 * len(read):2][:len(read)], column) for column in read.T])


def low_pass(values, step, cutoff_hz):
    natural = 2 * np.pi * cutoff_hz
    return _second_order(values, step, natural, np.sqrt(2) * natural, 0.0)


def segment_values(motion, times, effects):
    """Stage 1: specific force, angular velocity and its derivative in segment axes."""
    rotation, acceleration, rate, change = motion.kinematics(times)
    mode = effects.get("gravity_convention", {}).get("mode")
    gravity = {None: GRAVITY, "removed": 0 * GRAVITY, "negated": -GRAVITY}[mode]
    if "lever_arm" in effects:
        lever = rotation.apply(effects["lever_arm"]["offset"])
        acceleration = acceleration + np.cross(change, lever) + np.cross(rate, np.cross(rate, lever))
    return [rotation.apply(x, inverse=True) for x in (acceleration - gravity, rate, change)]


def mount(force, rate, times, effects):
    """Stage 3."""
    turn = Rotation.from_rotvec(effects.get("mount_rotation", {}).get("rotvec", [0.0, 0.0, 0.0]))
    slip = effects.get("mount_slip")
    late = times >= (slip["at"] if slip else np.inf)
    turned = turn * Rotation.from_rotvec(slip["rotvec"]) if slip else turn
    out = [np.where(late[:, None], turned.apply(x, inverse=True), turn.apply(x, inverse=True)) for x in (force, rate)]
    if "axis_convention" in effects:
        out = [x @ np.array(effects["axis_convention"]["matrix"]).T for x in out]
    return out


def channel_matrix(effects, channel):
    scale = effects.get(f"{channel}_scale", {}).get("scale", [1.0, 1.0, 1.0])
    xy, xz, yz = effects.get(f"{channel}_misalignment", {}).get("upper", [0.0, 0.0, 0.0])
    return np.diag(scale) @ np.array([[1, xy, xz], [0, 1, yz], [0, 0, 1.0]])


def inner_stages(motion, times, t0, effects, extra=None):
    """Stages 1 to 7 without noise at true times that are evenly spaced (times, t0, slip: session seconds).
    `extra`: functions of the outside suite, by the stage they act at."""
    extra = extra or {}
    interval = times[1] - times[0]
    fine = max(1, int(np.ceil(DENSE_RATE * interval)))
    step = interval / fine
    warm = int(WARM_UP / interval) * fine
    dense = times[0] + step * (np.arange((len(times) - 1) * fine + 1 + warm) - warm)
    force, rate, change = segment_values(motion, dense, effects)
    if "soft_tissue" in effects:
        force = soft_tissue(force, rate, change, step, **effects["soft_tissue"])
    force, rate = mount(force, rate, dense, effects)
    if "mount" in extra:
        force, rate = extra["mount"](dense - t0, force, rate)
    if "vibration" in effects:
        wave = effects["vibration"]
        turns = 2 * np.pi * wave["hz"] * (dense - t0)[:, None]
        force = force + np.array(wave["amplitude"]) * np.sin(turns + np.array(wave["phase"]))
        rate = rate + np.array(wave["gyro_amplitude"]) * np.sin(turns + np.array(wave["gyro_phase"]))
    if "gyro_g_sensitivity" in effects:
        rate = rate + force @ np.array(effects["gyro_g_sensitivity"]["matrix"]).T
    if "low_pass" in effects:
        force, rate = (low_pass(x, step, **effects["low_pass"]) for x in (force, rate))
    if "channel_delay" in effects:
        late = dense - effects["channel_delay"]["seconds"]
        rate = CubicSpline(dense, rate)(np.clip(late, dense[0], dense[-1]))
    force, rate = force[warm::fine], rate[warm::fine]
    if "channel" in extra:
        force, rate = extra["channel"](times - t0, force, rate)
    out = []
    for channel, value in (("accel", force), ("gyro", rate)):
        bias = np.array(effects.get(f"{channel}_bias", {}).get("bias", [0.0, 0.0, 0.0]))
        drift = np.array(effects.get(f"{channel}_bias_drift", {}).get("rate", [0.0, 0.0, 0.0]))
        out.append(value @ channel_matrix(effects, channel).T + bias + (times - t0)[:, None] * drift)
    return out


def outer_stages(rng, force, rate, interval, sigmas, effects, extra=None, times=None):
    """Stage 8: white noise, saturation, quantisation, units. sigmas: declared noise per sample (accel, gyro)."""
    out = []
    for channel, value, sigma in (("accel", force, sigmas[0]), ("gyro", rate, sigmas[1])):
        density = effects.get(f"{channel}_noise", {}).get("density", 0.0)
        sigma = np.hypot(sigma, density / np.sqrt(interval))
        out.append(value + sigma * rng.standard_normal(value.shape))
    if extra and "noise" in extra:
        out = list(extra["noise"](times, *out))
    for index, channel in enumerate(("accel", "gyro")):
        if f"{channel}_saturation" in effects:
            limit = effects[f"{channel}_saturation"]["limit"]
            out[index] = np.clip(out[index], -limit, limit)
        if f"{channel}_quantization" in effects:
            lsb = effects[f"{channel}_quantization"]["lsb"]
            out[index] = np.round(out[index] / lsb) * lsb
        out[index] = out[index] * effects.get(f"{channel}_units", {}).get("factor", 1.0)
    return out


def stamps_of(times, t0, effects):
    """Stage 9: the stamps of true times, both in session seconds."""
    ppm = effects.get("clock_drift", {}).get("ppm", 0.0)
    return t0 + (times - t0) * (1 + ppm * 1e-6) + effects.get("time_offset", {}).get("seconds", 0.0)


def true_times(stamps, t0, effects):
    ppm = effects.get("clock_drift", {}).get("ppm", 0.0)
    return t0 + (stamps - t0 - effects.get("time_offset", {}).get("seconds", 0.0)) / (1 + ppm * 1e-6)


def kept_samples(rng, count, effects):
    """Bursts of losses by a two-state chain; the first sample stays, for it carries t0."""
    keep = np.ones(count, bool)
    if "dropped_samples" in effects:
        fraction, burst = effects["dropped_samples"]["fraction"], effects["dropped_samples"]["mean_burst"]
        leave, enter = 1 / burst, fraction / (1 - fraction) / burst
        draw, lost = rng.random(count), False
        for index in range(1, count):
            lost = draw[index] >= leave if lost else draw[index] < enter
            keep[index] = not lost
    return keep


def reference(rng, motion, times, effects, ordinary, smoothing):
    """The reported pose. ordinary: the noise of usual motion capture (m, rad per axis).
    smoothing: how and in which order a smoothing reference treats its noise; the contract leaves both open."""
    noise = effects.get("reference_noise", {})
    sigma_position = np.hypot(ordinary[0], noise.get("position", 0.0))
    sigma_rotation = np.hypot(ordinary[1], noise.get("rotation", 0.0))
    position_noise = sigma_position * rng.standard_normal((len(times), 3))
    rotation_noise = sigma_rotation * rng.standard_normal((len(times), 3))
    position, rotation = motion.pose(times)
    before = smoothing["noise_first"]
    if "reference_smoothing" in effects and before:
        position, rotation = position + position_noise, rotation * Rotation.from_rotvec(rotation_noise)
    if "reference_smoothing" in effects:
        position, rotation = smooth(position, rotation, 1 / (times[1] - times[0]), effects["reference_smoothing"]["cutoff_hz"], smoothing)
    if "reference_interpolation" in effects:
        frames = np.arange(times[0], times[-1] + 2 / effects["reference_interpolation"]["rate_hz"], 1 / effects["reference_interpolation"]["rate_hz"])
        at_frames, turned = motion.pose(frames)
        position = np.column_stack([np.interp(times, frames, column) for column in at_frames.T])
        rotation = Slerp(frames, turned)(times)
    position = position * effects.get("reference_scale", {}).get("factor", 1.0)
    tilt = Rotation.from_rotvec(effects.get("reference_tilt", {}).get("rotvec", [0.0, 0.0, 0.0]))
    position, rotation = tilt.apply(position), tilt * rotation
    if "reference_smoothing" not in effects or not before:
        position, rotation = position + position_noise, rotation * Rotation.from_rotvec(rotation_noise)
    return position * effects.get("reference_units", {}).get("factor", 1.0), rotation


def smooth(position, rotation, rate, cutoff, smoothing):
    quaternion = rotation.as_quat()
    flips = np.cumprod(np.where(np.sum(quaternion[1:] * quaternion[:-1], axis=1) < 0, -1.0, 1.0))
    both = np.hstack([position, quaternion * np.concatenate([[1.0], flips])[:, None]])
    if smoothing["kernel"] == "butterworth":
        both = sosfiltfilt(butter(2, cutoff / (rate / 2), output="sos"), both, axis=0)
    else:  # Gaussian with half power at the cutoff
        both = gaussian_filter1d(both, np.sqrt(np.log(2)) / (2 * np.pi * cutoff) * rate, axis=0, mode="nearest")
    return both[:, :3], Rotation.from_quat(both[:, 3:])
