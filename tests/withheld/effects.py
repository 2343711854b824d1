"""The effects of the contract's table: parameters drawn at a strength, in a random direction, and which go together."""
import itertools

import numpy as np

USUAL_SECONDS = 60.0  # what the rates of bias drifts are meant for
STRENGTHS = ("weak", "medium", "strong")
ALL = (
    "reference_noise reference_smoothing reference_interpolation reference_tilt reference_scale reference_units mount_rotation lever_arm mount_slip soft_tissue "
    "time_offset clock_drift channel_delay dropped_samples accel_bias gyro_bias accel_scale gyro_scale accel_misalignment gyro_misalignment "
    "accel_noise gyro_noise accel_bias_drift gyro_bias_drift accel_saturation gyro_saturation accel_quantization gyro_quantization "
    "low_pass gyro_g_sensitivity vibration axis_convention accel_units gyro_units gravity_convention").split()
# no strength: these are plain to see, or not there at all
CONVENTIONS = ("reference_units", "axis_convention", "accel_units", "gyro_units", "gravity_convention")
STANDARD_GRAVITY = 9.80665

# pairs whose product is one effect, or of which one hides the other by its nature
INCOMPATIBLE = [{"axis_convention", "mount_rotation"}, {"accel_units", "accel_scale"}, {"gyro_units", "gyro_scale"},
                {"gravity_convention", "reference_tilt"}, {"gravity_convention", "accel_saturation"},
                {"gravity_convention", "axis_convention"}, {"reference_noise", "reference_smoothing"},
                {"accel_noise", "accel_quantization"}, {"gyro_noise", "gyro_quantization"},
                {"gravity_convention", "accel_units"}, {"reference_units", "reference_scale"},
                {"reference_interpolation", "reference_smoothing"}, {"reference_interpolation", "reference_noise"}]
# what a session has for itself; the rest belongs to the device and its mount
SESSION = ("reference_noise reference_smoothing reference_interpolation reference_tilt reference_scale reference_units mount_slip "
           "time_offset clock_drift dropped_samples accel_bias gyro_bias accel_bias_drift gyro_bias_drift vibration").split()


def compatible(names):
    return not any(pair <= set(names) for pair in INCOMPATIBLE)


def signed_permutations():
    """The 47 that are not the identity."""
    out = []
    for order in itertools.permutations(range(3)):
        for signs in itertools.product((1, -1), repeat=3):
            matrix = np.zeros((3, 3))
            matrix[range(3), order] = signs
            if not np.array_equal(matrix, np.eye(3)):
                out.append(matrix)
    return out


def _direction(rng, size):
    value = rng.standard_normal(3)
    return (size * value / np.linalg.norm(value)).tolist()


def _signed(rng, size, count=3):
    """Random signs, magnitudes within 0.4 to 1 of size, the largest equal to it."""
    value = rng.uniform(0.4, 1.0, count)
    return size * value / value.max() * rng.choice([-1.0, 1.0], count)


def _wave(rng, context, accel, gyro):
    """One frequency, seen by the accelerometer alone, by both channels, or from a force that turns in a plane."""
    hz = rng.uniform(8, min(45, 0.45 * context["rate"]))
    kind = str(rng.choice(["accel", "both", "turning"], p=[0.3, 0.4, 0.3]))
    if kind == "turning":  # u cos + v sin along two directions at right angles
        u, v = np.linalg.qr(rng.standard_normal((3, 2)))[0].T * accel / np.sqrt(2)
        amplitude, phase = np.hypot(u, v), np.arctan2(u, v) + rng.uniform(0, 2 * np.pi)
    else:  # a phase for each axis, as in a body that gives way
        amplitude, phase = np.abs(_direction(rng, accel)), rng.uniform(0, 2 * np.pi, 3)
    wave = {"hz": hz, "amplitude": np.array(amplitude).tolist(), "phase": (phase % (2 * np.pi)).tolist()}
    silent = kind == "accel"
    wave["gyro_amplitude"] = [0.0] * 3 if silent else np.abs(_direction(rng, gyro)).tolist()
    wave["gyro_phase"] = [0.0] * 3 if silent else rng.uniform(0, 2 * np.pi, 3).tolist()
    return wave


def draw(rng, effect, level, context):
    """Parameters at level 0, 1, 2. context: sigmas (accel, gyro) per sample, rate, reference_rate, start and seconds of the fit.
    A saturation returns `clipped`, the share of samples to be clipped; the generator turns it into a limit."""
    size = lambda *sizes: float(sizes[level] * rng.uniform(0.85, 1.2))
    sign = rng.choice([-1.0, 1.0])
    sigma = context["sigmas"][0 if effect.startswith("accel") else 1]
    degrees = np.pi / 180
    if effect == "reference_noise":
        position, rotation = size(1.2e-3, 3e-3, 8e-3), size(0.3, 0.6, 1.5) * degrees
        which = rng.choice(["both", "position", "rotation"], p=[0.5, 0.25, 0.25])
        return {"position": 0.0 if which == "rotation" else max(position, 1.05e-3), "rotation": 0.0 if which == "position" else max(rotation, 0.27 * degrees)}
    if effect == "reference_smoothing":
        return {"cutoff_hz": size(6.0, 4.0, 2.5)}
    if effect == "reference_interpolation":  # below the reported rate, or there would be no chords
        return {"rate_hz": min(size(60, 40, 20), context["reference_rate"] / 1.6)}
    if effect == "reference_units":  # millimetres, centimetres, inches
        return {"factor": float(rng.choice([1000.0, 100.0, 1 / 0.0254], p=[0.6, 0.3, 0.1]))}
    if effect == "reference_tilt":
        angle, azimuth = size(1, 3, 8) * degrees, rng.uniform(0, 2 * np.pi)
        return {"rotvec": [angle * np.cos(azimuth), angle * np.sin(azimuth), 0.0]}
    if effect == "reference_scale":
        return {"factor": 1 + sign * size(0.03, 0.08, 0.2)}
    if effect == "mount_rotation":
        return {"rotvec": _direction(rng, size(1.5, 8, 40) * degrees)}
    if effect == "lever_arm":
        return {"offset": _direction(rng, size(0.01, 0.04, 0.12))}
    if effect == "mount_slip":
        return {"at": context["start"] + rng.uniform(0.3, 0.7) * context["seconds"], "rotvec": _direction(rng, size(3, 8, 25) * degrees)}
    if effect == "soft_tissue":
        return {"natural_hz": size(15, 9, 5), "damping_ratio": rng.uniform(0.2, 0.4)}
    if effect == "time_offset":
        far = level == 2 and rng.random() < 0.3
        return {"seconds": sign * (rng.uniform(0.3, 2.0) if far else size(0.004, 0.020, 0.080))}
    if effect == "clock_drift":
        return {"ppm": sign * size(60, 300, 1500)}
    if effect == "channel_delay":  # as often the accelerometer's own filter is the slower one
        return {"seconds": rng.choice([1.0, -1.0], p=[0.7, 0.3]) * size(0.002, 0.007, 0.020)}
    if effect == "dropped_samples":
        return {"fraction": size(0.01, 0.05, 0.15), "mean_burst": rng.uniform(1.0, 5.0)}
    if effect.endswith("_bias"):
        return {"bias": _direction(rng, size(0.05, 0.2, 0.8) if effect == "accel_bias" else size(0.003, 0.02, 0.1))}
    if effect.endswith("_scale"):
        return {"scale": (1 + _signed(rng, size(0.01, 0.04, 0.15))).tolist()}
    if effect.endswith("_misalignment"):
        return {"upper": _signed(rng, size(0.006, 0.03, 0.1)).tolist()}
    if effect.endswith("_noise"):
        return {"density": size(3, 10, 40) * sigma / np.sqrt(context["rate"])}
    if effect.endswith("_bias_drift"):
        rate = size(0.001, 0.005, 0.02) if effect == "accel_bias_drift" else size(1e-4, 5e-4, 2e-3)
        return {"rate": _direction(rng, rate * USUAL_SECONDS / context["seconds"])}
    if effect.endswith("_saturation"):
        return {"clipped": size(0.003, 0.02, 0.08)}
    if effect.endswith("_quantization"):
        return {"lsb": size(4, 15, 60) * sigma}
    if effect == "low_pass":
        return {"cutoff_hz": size(25, 10, 4)}
    if effect == "gyro_g_sensitivity":
        return {"matrix": _signed(rng, size(2e-4, 1e-3, 5e-3), 9).reshape(3, 3).tolist()}
    if effect == "vibration":
        return _wave(rng, context, size(0.1, 0.5, 3.0), size(0.02, 0.08, 0.3))
    if effect == "axis_convention":
        choices = signed_permutations()
        return {"matrix": choices[rng.integers(len(choices))].tolist()}
    if effect == "accel_units":
        return {"factor": float(rng.choice([1 / STANDARD_GRAVITY, 1000 / STANDARD_GRAVITY, 100.0]))}
    if effect == "gyro_units":
        return {"factor": float(rng.choice([180 / np.pi, 180000 / np.pi]))}
    if effect == "gravity_convention":
        return {"mode": str(rng.choice(["removed", "negated"]))}
    raise KeyError(effect)
