"""The measurement model of the contract, stage by stage, for one placement. `effects`: name -> parameters, as in effects.yaml."""
import numpy as np
from scipy.interpolate import CubicSpline
from scipy.linalg import expm
from scipy.signal import butter, lfilter, sosfiltfilt
from scipy.ndimage import gaussian_filter1d
from scipy.spatial.transform import Rotation, Slerp

from motions import continuous

GRAVITY = np.array([0.0, 0.0, -9.80665])
DENSE_RATE = 2000.0  # Hz at least, for the continuous stages
WARM_UP = 3.0  # s
COOL_DOWN = 0.25  # s beyond the end: a gyroscope that is early looks ahead
PIECE = 120.0  # s computed at once: what is dense would else fill the memory on long recordings


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


def soft_tissue(force, rate, rotation, step, natural_hz, damping_ratio):
    """The reading of a mass on spring and damper in the turning segment frame; all in segment axes, rotation: world_from_segment.

    With D = R d the four terms of the turning frame fold into R'' and what is left is D'' = -wn^2 D - c (D' - W x D) - F, c = 2 z wn:
    a filter with constant coefficients but for c W x D. That term is fed back until it stands still; each round gains a factor of
    |W| / wn at least, and the start is the sag at rest."""
    natural = 2 * np.pi * natural_hz
    damping = 2 * damping_ratio * natural
    force, rate = rotation.apply(force), rotation.apply(rate)
    sag = np.zeros_like(force)  # -D
    for _ in range(60):
        before, drive = sag, force + damping * np.cross(rate, sag)
        sag = _second_order(drive, step, natural, damping, 0.0) / natural**2
        if np.abs(sag - before).max() * natural**2 < 1e-9:
            break
    reading = _second_order(drive, step, natural, damping, damping) - damping * np.cross(rate, sag)
    return rotation.apply(reading, inverse=True)


def low_pass(values, step, cutoff_hz):
    natural = 2 * np.pi * cutoff_hz
    return _second_order(values, step, natural, np.sqrt(2) * natural, 0.0)


def segment_values(motion, times, effects, step):
    """Stages 1 and 2: specific force and angular velocity in segment axes."""
    rotation, acceleration, rate, change = motion.kinematics(times)
    mode = effects.get("gravity_convention", {}).get("mode")
    gravity = {None: GRAVITY, "removed": 0 * GRAVITY, "negated": -GRAVITY}[mode]
    if "lever_arm" in effects:
        lever = rotation.apply(effects["lever_arm"]["offset"])
        acceleration = acceleration + np.cross(change, lever) + np.cross(rate, np.cross(rate, lever))
    force, rate = rotation.apply(acceleration - gravity, inverse=True), rotation.apply(rate, inverse=True)
    if "soft_tissue" in effects:
        force = soft_tissue(force, rate, rotation, step, **effects["soft_tissue"])
    return force, rate


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


def vibration(times, wave, force, rate):
    """Stage 4: a sine per axis, each with its own amplitude and phase; without gyro_amplitude the accelerometer alone."""
    angle = 2 * np.pi * wave["hz"] * times[:, None]
    force = force + np.array(wave["amplitude"]) * np.sin(angle + np.array(wave["phase"]))
    return force, rate + np.array(wave.get("gyro_amplitude", np.zeros(3))) * np.sin(angle + np.array(wave.get("gyro_phase", np.zeros(3))))


def delayed(values, start, step, times):
    """Cubic between dense values; only those near the wanted times are drawn in."""
    first = max(0, int((times[0] - start) / step) - 8)
    last = int((times[-1] - start) / step) + 9
    inner = values[first:last]
    return CubicSpline(start + step * (first + np.arange(len(inner))), inner)(times)


def continuous_stages(motion, times, t0, effects, hooks):
    """Stages 1 to 6, at times that are evenly spaced."""
    interval = times[1] - times[0]
    fine = max(1, int(np.ceil(DENSE_RATE * interval)))
    step = interval / fine
    warm, cool = int(WARM_UP / interval) * fine, int(COOL_DOWN / interval) * fine
    dense = times[0] + step * (np.arange((len(times) - 1) * fine + 1 + warm + cool) - warm)
    force, rate = segment_values(motion, dense, effects, step)
    force, rate = mount(force, rate, dense, effects)
    if "mount" in hooks:
        force, rate = hooks["mount"](dense - t0, force, rate)
    if "vibration" in effects:
        force, rate = vibration(dense - t0, effects["vibration"], force, rate)
    if "gyro_g_sensitivity" in effects:
        rate = rate + force @ np.array(effects["gyro_g_sensitivity"]["matrix"]).T
    if "low_pass" in effects:
        force, rate = (low_pass(x, step, **effects["low_pass"]) for x in (force, rate))
    kept = slice(warm, len(dense) - cool, fine)
    late = effects.get("channel_delay", {}).get("seconds", 0.0)
    return force[kept], delayed(rate, dense[0], step, times - late) if late else rate[kept]


def inner_stages(motion, times, t0, effects, extra=None):
    """Stages 1 to 7 without noise at true times that are evenly spaced (times, t0, slip: session seconds).
    `extra`: functions of the outside suite, by the stage they act at."""
    extra = extra or {}
    # a hook may remember, so its recording stays in one piece; the filters forget within the warm-up
    count = len(times) if extra else max(2, int(PIECE / (times[1] - times[0])))
    starts = [k for k in range(0, len(times), count) if len(times) - k > 1]
    ends = starts[1:] + [len(times)]
    pieces = [continuous_stages(motion, times[a:b], t0, effects, extra) for a, b in zip(starts, ends)]
    force, rate = (np.concatenate(parts) for parts in zip(*pieces))
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


def reference(rng, motion, times, effects, ordinary, filtering):
    """The reported pose. ordinary: the noise of usual motion capture (m, rad per axis).
    filtering: what the contract leaves open of a reference that is smoothed or interpolated: kernel, order of the noise, phase of the frames."""
    early = filtering["noise_first"] and bool({"reference_smoothing", "reference_interpolation"} & set(effects))
    if "reference_interpolation" in effects:
        step = 1 / effects["reference_interpolation"]["rate_hz"]
        frames = times[0] + step * (np.arange(int((times[-1] - times[0]) / step) + 3) - filtering["frame_phase"])
        position, rotation = reported(rng, *motion.pose(frames), effects, ordinary if early else None)
        position, rotation = chords(frames, position, rotation, times)
    else:
        position, rotation = reported(rng, *motion.pose(times), effects, ordinary if early else None)
    if "reference_smoothing" in effects:
        position, rotation = smooth(position, rotation, 1 / (times[1] - times[0]), effects["reference_smoothing"]["cutoff_hz"], filtering)
    position = position * effects.get("reference_scale", {}).get("factor", 1.0)
    tilt = Rotation.from_rotvec(effects.get("reference_tilt", {}).get("rotvec", [0.0, 0.0, 0.0]))
    position, rotation = tilt.apply(position), tilt * rotation
    if not early:
        position, rotation = reported(rng, position, rotation, effects, ordinary)
    return position * effects.get("reference_units", {}).get("factor", 1.0), rotation


def reported(rng, position, rotation, effects, ordinary):
    """The pose with its noise, in metres still."""
    if ordinary is None:
        return position, rotation
    noise = effects.get("reference_noise", {})
    sigmas = [np.hypot(own, noise.get(key, 0.0)) for own, key in zip(ordinary, ("position", "rotation"))]
    noise = [sigma * rng.standard_normal((len(position), 3)) for sigma in sigmas]
    return position + noise[0], rotation * Rotation.from_rotvec(noise[1])


def chords(frames, position, rotation, times):
    """Straight between frames: linear in position, slerp in rotation."""
    return np.stack([np.interp(times, frames, axis) for axis in position.T], axis=1), Slerp(frames, rotation)(times)


def smooth(position, rotation, rate, cutoff, filtering):
    both = np.hstack([position, continuous(rotation.as_quat())])
    if filtering["kernel"] == "butterworth":
        both = sosfiltfilt(butter(2, cutoff / (rate / 2), output="sos"), both, axis=0)
    else:  # Gaussian with half power at the cutoff
        both = gaussian_filter1d(both, np.sqrt(np.log(2)) / (2 * np.pi * cutoff) * rate, axis=0, mode="nearest")
    return both[:, :3], Rotation.from_quat(both[:, 3:])
