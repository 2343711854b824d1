"""A fifth, independent origin of recordings with hidden effects: own motions, own devices, own arithmetic, from diagnosis.md alone."""
import hashlib
import os

import numpy as np

import fifth_motions as motions
import generate as first_hand
import recording
from fifth_physics import G, Lens, Stage, analog, back, digital, log_uniform, readings

SUITES = ("fifth-single", "fifth-pair", "fifth-triple", "fifth-none", "fifth-placement")
EFFECTS = ("reference_noise", "reference_smoothing", "reference_interpolation", "reference_tilt", "reference_scale", "reference_units", "mount_rotation", "lever_arm",
           "mount_slip", "soft_tissue", "time_offset", "clock_drift", "channel_delay", "dropped_samples", "accel_bias", "gyro_bias", "accel_scale", "gyro_scale",
           "accel_misalignment", "gyro_misalignment", "accel_noise", "gyro_noise", "accel_bias_drift", "gyro_bias_drift", "accel_saturation", "gyro_saturation",
           "accel_quantization", "gyro_quantization", "low_pass", "gyro_g_sensitivity", "vibration", "axis_convention", "accel_units", "gyro_units", "gravity_convention")
CALIBRATION = {"time_offset": {"seconds": 0.0}, "mount_rotation": {"rotvec": [0.0] * 3}, "lever_arm": {"offset": [0.0] * 3}, "accel_bias": {"bias": [0.0] * 3},
            "gyro_bias": {"bias": [0.0] * 3}}
CHANGED = ("reference_smoothing", "reference_interpolation")  # these change the simulated motion's shape
# Sets that no sensible person would call two causes: each row may hold one of its members.
CLASHES = [("low_pass", "reference_smoothing", "reference_interpolation", "reference_noise"), ("time_offset", "channel_delay"), ("mount_rotation", "axis_convention"),
           ("reference_noise", "accel_noise", "gyro_noise"), ("reference_scale", "reference_units"), ("reference_noise", "reference_units"),
           ("gravity_convention", "soft_tissue", "reference_tilt", "accel_units", "accel_bias", "accel_saturation"), ("accel_units", "reference_scale", "reference_units"),
           ("accel_scale", "reference_scale"), ("reference_smoothing", "soft_tissue"),
           ("reference_interpolation", "soft_tissue"), ("gyro_g_sensitivity", "accel_units"), ("reference_noise", "vibration")]
CLASHES += [tuple(f"{channel}_{kind}" for kind in kinds) for channel in ("accel", "gyro") for kinds in (
    ("bias", "bias_drift"), ("units", "scale", "saturation", "quantization", "noise"), ("noise", "quantization", "saturation"), ("scale", "saturation"))]
# Densities per sqrt(Hz): accelerometer m/s2, gyroscope rad/s (lower and upper of the grade), and the rates that such devices have.
GRADES = {"toy": ((4e-3, 9e-3), (4e-4, 9e-4), (25, 50, 52, 100)), "consumer": ((1.5e-3, 4e-3), (1e-4, 3.5e-4), (50, 60, 100, 104, 119, 200, 208)),
          "mems": ((6e-4, 1.3e-3), (5e-5, 1.1e-4), (100, 128, 148.148, 200, 225, 256, 400, 500)), "industrial": ((2e-4, 5e-4), (1.2e-5, 5e-5), (100, 125, 200, 250, 500))}
NAMES = ("wrist", "trunk", "tool", "ankle", "head", "pelvis", "lid", "handle", "left_shank", "base", "upper_arm", "frame", "device")
SLOW = ("knee", "sailing", "sitter", "sit_to_stand", "squats", "gimbal", "rate_table", "curls", "head", "figure_eight")


def _direction(rng):
    v = rng.normal(0, 1, 3)
    return v / np.linalg.norm(v)


# --- drawing -----------------------------------------------------------------------------------------------------------------------

def _signs(rng, low, high, n=3):
    return (rng.uniform(low, high, n) * rng.choice([-1, 1], n)).tolist()


def _signed_permutation(rng):
    while True:
        M = np.eye(3)[rng.permutation(3)] * rng.choice([-1, 1], 3)[:, None]
        if not np.array_equal(M, np.eye(3)) and (np.linalg.det(M) > 0 or rng.random() < 0.25):
            return {"matrix": M.tolist()}


def _sensor(e):
    """What the real device feels: the reference's errors are not among it."""
    return {k: v for k, v in e.items() if not k.startswith("reference_")}


def _limit(rng, x, channel):
    """A real range that clips some samples, else one of the own."""
    peaks, floor = np.abs(x).max(1), 10.8 if channel == "accel" else 0.2
    real = G * np.array([2, 3, 4, 8, 16]) if channel == "accel" else np.radians([125, 250, 300, 500, 1000, 2000])
    fit = [v for v in real if 0.004 < (peaks > v).mean() < 0.08]
    limit = float(rng.choice(fit)) if fit else float(np.quantile(peaks, 1 - rng.uniform(0.006, 0.05)))
    return {"limit": limit} if limit > floor else None


def _lsb(rng, x, channel, sigma):
    steps = np.array([4e-3, 8e-3, 0.0157, 0.0383, 0.0766, 0.153, 0.307]) * G / 9.81 if channel == "accel" else np.radians([0.0625, 0.125, 0.25, 0.5, 1.0, 2.0])
    fit = [v for v in steps if v >= 4 * sigma and v <= np.median(x.std(0)) / 2]
    return {"lsb": float(rng.choice(fit[:3]))} if fit else None


def _tilted(rng, low, high):
    angle, size = rng.uniform(0, 2 * np.pi), np.radians(rng.uniform(low, high))
    return {"rotvec": [float(size * np.cos(angle)), float(size * np.sin(angle)), 0.0]}


def _vibration(rng, rate):
    phase = [rng.uniform(0, 2 * np.pi, 3).tolist() for _ in range(2)]
    return {"hz": float(rng.uniform(0.12, 0.42) * min(rate, 250)), "amplitude": _signs(rng, 0.2, 1.5), "phase": phase[0], "gyro_amplitude": _signs(rng, 0.01, 0.08),
            "gyro_phase": phase[1]}


def parameters(effect, rng, c, e):
    """Typical sizes; c is the case's placement, e what is already there. None where the motion does not allow it."""
    channel, _, kind = effect.partition("_")
    k = 0 if channel == "accel" else 1
    sigma = c["sigmas"][k]
    sign = float(rng.choice([-1, 1]))
    if kind in ("saturation", "quantization"):
        x = readings(c["stage"], _sensor(e), c["stamps"])
        if x is None:
            return None
        return _limit(rng, x[k], channel) if kind == "saturation" else _lsb(rng, x[k], channel, sigma)
    table = {
        "reference_noise": lambda: {"position": max(log_uniform(rng, 1.3e-3, 6e-3), 3.2 * c["lens"].position), "rotation": max(np.radians(log_uniform(rng, 0.35, 1.5)),
            3.2 * c["lens"].rotation)},
        "reference_smoothing": lambda: {"cutoff_hz": log_uniform(rng, 1.5, 6.0)},
        "reference_interpolation": lambda: {"rate_hz": float(rng.choice([10, 12.5, 15, 20, 25, 30]))},
        "reference_tilt": lambda: _tilted(rng, 1.2, 6.0), "reference_scale": lambda: {"factor": 1 + sign * float(rng.uniform(0.04, 0.15))},
        "reference_units": lambda: {"factor": float(rng.choice([1000.0, 1000.0, 100.0, 1 / 0.0254, 1 / 0.3048]))},
        "mount_rotation": lambda: {"rotvec": (_direction(rng) * np.radians(log_uniform(rng, 4, 60))).tolist()},
            "lever_arm": lambda: {"offset": (_direction(rng) * log_uniform(rng, 0.03, 0.2)).tolist()},
        "mount_slip": lambda: {"at": c["stage"].epoch + float(rng.uniform(0.25, 0.75)) * c["stage"].seconds, "rotvec": (_direction(rng) * np.radians(log_uniform(rng, 5,
            30))).tolist()},
        "soft_tissue": lambda: {"natural_hz": log_uniform(rng, 3.5, 14.0),
            "damping_ratio": log_uniform(rng, 0.12, 0.5)}, "time_offset": lambda: {"seconds": sign * log_uniform(rng, 0.008, 0.1)},
        "clock_drift": lambda: {"ppm": sign * log_uniform(rng, 80, 1500)}, "channel_delay": lambda: {"seconds": log_uniform(rng, 0.004, 0.03)},
        "dropped_samples": lambda: {"fraction": float(rng.uniform(0.04, 0.25)), "mean_burst": float(rng.uniform(1.2, 8.0))}, "accel_bias": lambda: {"bias": _signs(rng, 0.06, 0.5)},
        "gyro_bias": lambda: {"bias": _signs(rng, 0.005, 0.06)}, "low_pass": lambda: {"cutoff_hz": log_uniform(rng, 3.0, min(22.0, c["rate"] / 3))},
        "gyro_g_sensitivity": lambda: {"matrix": (rng.normal(0, 1, (3, 3)) * log_uniform(rng, 8e-4, 5e-3)).tolist()}, "vibration": lambda: _vibration(rng, c["rate"]),
        "axis_convention": lambda: _signed_permutation(rng), "accel_units": lambda: {"factor": float(rng.choice([1 / G, 1000 / G, 1000.0]))},
            "gyro_units": lambda: {"factor": float(rng.choice([180 / np.pi, 180 / np.pi, 1000.0]))},
        "gravity_convention": lambda: {"mode": str(rng.choice(["removed", "negated"]))}}
    own = {"scale": lambda: {"scale": (1 + np.array(_signs(rng, 0.01, 0.08))).tolist()}, "misalignment": lambda: {"upper": _signs(rng, 0.015, 0.07)},
           "noise": lambda: {"density": float(sigma / np.sqrt(c["rate"]) * log_uniform(rng, 2.0, 12.0))},
           "bias_drift": lambda: {"rate": _signs(rng, *((0.002, 0.012) if k == 0 else (2e-4, 1.5e-3)))}}
    return (table.get(effect) or own[kind])()


# --- visibility --------------------------------------------------------------------------------------------------------------------

def _bumped(e):
    """Every numeric parameter of e moved a little, one at a time."""
    for name, values in e.items():
        for key, value in values.items():
            if isinstance(value, str) or key in ("matrix", "at", "rate_hz") and name != "gyro_g_sensitivity":
                continue
            flat = np.array(value, float)
            for i in range(flat.size):
                moved = flat.copy().reshape(-1)
                floor = {"seconds": 5e-4, "phase": 1e-2, "ppm": 5.0, "hz": 5e-4, "matrix": 1e-4}.get(key, 1e-3)
                moved[i] += floor if flat.size > 1 or key in ("seconds", "ppm", "hz") else max(1e-3 * abs(moved[i]), 1e-9)
                new = moved.reshape(flat.shape) if flat.ndim else float(moved[0])
                yield {**e, name: {**values, key: new}}


def _random_visible(effect, e, c):
    channel, _, kind = effect.partition("_")
    k = 0 if channel == "accel" else 1
    left = c["lens"].leaves(e.get("reference_noise"))[k]
    if kind == "noise" and channel != "reference":
        extra = e[effect]["density"] ** 2 * c["rate"]
        return extra >= 3 * c["sigmas"][k] ** 2 and extra >= 1.5 * left ** 2
    if kind == "quantization":
        return e[effect]["lsb"] > 1.5 * left
    return True


def visible(effect, e, c):
    """Is its trace above the noise, and is it no other's trace?"""
    if effect.endswith("_noise") or effect.endswith("quantization") or effect == "dropped_samples":
        return _random_visible(effect, e, c)
    e = {k: v for k, v in e.items() if k == effect or not (k.endswith(("_units", "quantization")) or k in ("dropped_samples", "reference_noise") or k.endswith("_noise"))}
    left = c["lens"].leaves(c["effects"].get("reference_noise"))
    sizes = [np.sqrt(s ** 2 + r ** 2 * max(1.0, c["rate"] / 20)) for s, r in zip(c["sigmas"], left)]
    shaped, shapes = any(k in e for k in CHANGED), {}

    def seen(own):
        key = str([own.get(k) for k in CHANGED])
        if key not in shapes:
            shapes[key] = c["lens"].simulated(c["stage"], c["joints"], own, 12.0) if shaped else c["stage"]
        both = readings(shapes[key], own, c["stamps"])
        return None if both is None else np.concatenate([x.ravel() / s for x, s in zip(digital(both, own, coarse=False), sizes)])
    base = {**CALIBRATION, **e}
    here, gone = seen(base), seen({k: v for k, v in base.items() if k != effect})
    if here is None or gone is None:
        return False
    trace = here - gone
    energy = trace @ trace
    if energy < 500:
        return False
    rest = {k: v for k, v in base.items() if k != effect}
    columns = []
    for moved in _bumped(rest):
        other = seen({**moved, effect: e[effect]})
        if other is not None:
            columns.append(other - here)
    A = np.array([x / np.linalg.norm(x) for x in columns if np.linalg.norm(x) > 1e-9]).T
    left_over = trace - A @ np.linalg.lstsq(A, trace, rcond=1e-9)[0]
    remains = left_over @ left_over
    c["visible"][effect] = [round(float(energy), 1), round(float(remains / energy), 3)]
    return remains >= max(150.0, (0.2 if effect.endswith("drift") else 0.25) * energy)  # a ramp without its mean keeps just a quarter


# --- cases -------------------------------------------------------------------------------------------------------------------------

def _carried(lens, stage, joints, sigmas):
    """Can this reference carry this motion at all?"""
    sim, left = lens.simulated(stage, joints, {}), lens.leaves()
    inner = slice(int(2 * stage.rate), -int(2 * stage.rate))
    f, exact = (back(s.R[inner], s.a[inner] + [0, 0, G]) for s in (sim, stage))
    for error, sigma, own in zip((f - exact, (sim.w - stage.w)[inner]), sigmas, left):
        size = np.hypot(sigma, own)
        if np.sqrt((error ** 2).mean()) > 0.4 * size or np.quantile(np.abs(error), 0.995) > 1.5 * size:  # impacts are short
            return False
    return True


def _compatible(chosen):
    return not any(len(set(chosen) & set(row)) > 1 for row in CLASHES)


def _chosen(rng, suite, index):
    count = {"fifth-none": 0, "fifth-pair": 2, "fifth-triple": 3}.get(suite, 1)
    if suite == "fifth-single":
        return [EFFECTS[index % len(EFFECTS)]]
    while True:
        chosen = rng.choice(EFFECTS, count, replace=False).tolist() if count else []
        if suite == "fifth-placement" and chosen[0].startswith("reference_"):
            continue  # one world for the three
        if _compatible(chosen):
            return sorted(chosen, key=lambda x: (x.endswith(("saturation", "quantization")), x))


def _bodies(rng, family, span, count):
    base = motions.FAMILIES[family](rng, span)
    return [base if k == 0 else motions.limb(rng, base, span) for k in range(count)]


def _placement(rng, joints, seconds, epoch, lens, family):
    grade = str(rng.choice(list(GRADES)))
    accel, gyro, rates = GRADES[grade]
    rate = float(rng.choice([r for r in rates if r >= 50 or family in SLOW]))
    sigmas = [log_uniform(rng, *accel) * np.sqrt(rate), log_uniform(rng, *gyro) * np.sqrt(rate)]
    stage = Stage(joints, 0.0, seconds, rate, epoch)
    return {"joints": joints, "grade": grade, "rate": rate, "sigmas": [float(s) for s in sigmas], "stage": stage, "lens": lens, "effects": {}, "visible": {},
            "stamps": np.round(np.arange(int(seconds * rate)) * 1e9 / rate) / 1e9}


def _hidden(rng, chosen, c):
    """Gives the placement its effects; False where one of them would not show."""
    for _ in range(3):
        e = {}
        for effect in chosen:
            e[effect] = parameters(effect, rng, c, e)
            if e[effect] is None:
                return False
        c["effects"], c["visible"] = e, {}
        if all(visible(effect, e, c) for effect in chosen):
            return True
    return False


def _imu(rng, c, stage, stamps):
    """Readings as they are recorded, with the stamps that were not dropped."""
    e = c["effects"]
    noise = [np.hypot(s, e.get(n + "_noise", {}).get("density", 0.0) * np.sqrt(c["rate"])) for s, n in zip(c["sigmas"], ("accel", "gyro"))]
    accel, gyro = digital(readings(stage, _sensor(e), stamps), e, noise, rng)
    keep = np.ones(len(stamps), bool)
    if "dropped_samples" in e:
        p, burst = e["dropped_samples"]["fraction"], e["dropped_samples"]["mean_burst"]
        at = 1
        while at < len(stamps):
            at += rng.geometric(min(1.0, p / (burst * (1 - p))))
            lost = rng.geometric(1 / burst)
            keep[at:at + lost] = False
            at += lost
    return stamps[keep], gyro[keep], accel[keep]


def _ns(epoch_ns, seconds):
    return epoch_ns + np.round(np.asarray(seconds) * 1e9).astype(np.int64)


def _sessions(rng, placements, lens, family, seconds):
    """A later recording: half of them another family's motion. None where this reference cannot carry it, nor the tissue."""
    fit_seconds = next(iter(placements.values()))["stage"].seconds
    start = fit_seconds + rng.uniform(8, 60)
    for _ in range(5):
        other = str(rng.choice(list(motions.FAMILIES))) if rng.random() < 0.5 else family
        bodies = _bodies(rng, other, seconds, len(placements))
        stages = [Stage(joints, start, seconds, c["rate"], c["stage"].epoch) for joints, c in zip(bodies, placements.values())]
        if all(_carried(lens, stage, joints, c["sigmas"]) for stage, joints, c in zip(stages, bodies, placements.values())) and all(
                analog(stage, _sensor(c["effects"])) is not None for stage, c in zip(stages, placements.values()) if "soft_tissue" in c["effects"]):
            return other, bodies, stages
    return None


def _scene(rng, suite, index):
    """One attempt at a whole case."""
    chosen, count = _chosen(rng, suite, index), 3 if suite == "fifth-placement" else 1
    family = str(rng.choice(list(motions.FAMILIES)))
    seconds = float(np.round(rng.uniform(*((40, 90), (20, 40), (90, 120))[rng.choice(3, p=[0.7, 0.15, 0.15])]), 2))
    lens = Lens(rng)
    epoch_ns = [int(rng.integers(1_600_000_000, 1_790_000_000)) * 10 ** 9 + int(rng.integers(10 ** 9))] * count
    names = rng.choice(NAMES, count, replace=False).tolist()
    placements = {}
    for k, (name, joints) in enumerate(zip(names, _bodies(rng, family, seconds, count))):
        epoch_ns[k] += int(rng.integers(10 ** 7)) * (k > 0)  # each device starts when it starts
        placements[name] = _placement(rng, joints, seconds, epoch_ns[k] * 1e-9, lens, family)
        placements[name]["epoch_ns"] = epoch_ns[k]
    while not all(_carried(lens, c["stage"], c["joints"], c["sigmas"]) for c in placements.values()):
        if lens.rate >= 240:
            return None
        lens.rate = 240.0 if lens.rate < 240 and lens.rate > 100 else 120.0 if lens.rate < 120 else 240.0
    affected = str(rng.choice(names)) if chosen else None
    if chosen and not _hidden(rng, chosen, placements[affected]):
        return None
    check = _sessions(rng, placements, lens, family, float(np.round(rng.uniform(20, 40), 2)))
    return None if check is None else (placements, affected, lens, family, check)


def _declared(rng, c):
    """Variances in the messages (gyro, accel): about right, or zero for unknown."""
    spread = (0.9, 1.1) if any(k.endswith("o_noise") or k == "accel_noise" for k in c["effects"]) else (0.7, 1.5)
    factors = [log_uniform(rng, *spread) for _ in range(2)]
    if rng.random() < 1 / 6 and spread[0] < 0.9:
        factors = [0.0, 0.0]
    in_units = bool(rng.random() < 0.5)
    scales = [c["effects"].get(n + "_units", {}).get("factor", 1.0) if in_units else 1.0 for n in ("accel", "gyro")]
    c["declared"] = {"accel_factor": factors[0], "gyro_factor": factors[1], "in_reading_units": in_units}
    accel, gyro = (np.full(3, f * s ** 2 * u ** 2) for f, s, u in zip(factors, c["sigmas"], scales))
    return gyro, accel


def _recorded(rng, c, stage, joints, stamps):
    times, p, q = c["lens"].reported(stage, joints, c["effects"], rng)
    imu, gyro, accel = _imu(rng, c, stage, stamps)
    return {"reference": (_ns(c["epoch_ns"], times), p, q), "imu": (_ns(c["epoch_ns"], imu), gyro, accel), "variances": c["variances"]}


def build(job):
    out, suite, seed, index = job
    digest = hashlib.sha256(f"fifth origin/{suite}/{seed}/{index}".encode())
    case, rng = digest.hexdigest()[:10], np.random.default_rng(list(digest.digest()))
    for attempt in range(80):
        scene = _scene(rng, suite, index)
        if scene:
            break
    else:
        return None
    placements, affected, lens, family, (check_family, bodies, stages) = scene
    fit, check = {}, {}
    for (name, c), joints, stage in zip(placements.items(), bodies, stages):
        c["variances"] = _declared(rng, c)
        fit[name] = _recorded(rng, c, c["stage"], c["joints"], c["stamps"])
        n = np.arange(np.ceil(stage.start * c["rate"]), np.floor((stage.start + stage.seconds) * c["rate"]))
        check[name] = _recorded(rng, c, stage, joints, np.round(n * 1e9 / c["rate"]) / 1e9)
    os.makedirs(os.path.join(out, case), exist_ok=True)
    recording.write(os.path.join(out, case, "fit.mcap"), fit)
    recording.write(os.path.join(out, case, "check.mcap"), check)
    labels = {name: {"epoch_ns": c["epoch_ns"], "imu_rate": c["rate"], "sigmas": c["sigmas"], "effects": c["effects"]} for name, c in placements.items()}
    nuisances = {"family": family, "check_family": check_family, "attempts": attempt + 1, "check_start": stages[0].start,
                 "reference": {k: v for k, v in lens.__dict__.items()}, "reference_leaves": lens.leaves(),
                 "devices": {name: [c["grade"], c["declared"]] for name, c in placements.items()},
                 "energy_and_own_share": {name: c["visible"] for name, c in placements.items()}}
    return {"case": case, "suite": suite, "seed": seed, "index": index, "affected": affected, "strength": {k: "medium" for c in placements.values() for k in c["effects"]},
            "seconds": placements[next(iter(placements))]["stage"].seconds, "check_seconds": stages[0].seconds, "placements": labels, "sessions": [labels], "nuisances": nuisances}


def generate(out, suite, seed, count, jobs):
    count = count or (len(EFFECTS) if suite == "fifth-single" else 20)
    first_hand.write_all(out, build, [(out, suite, seed, index) for index in range(count)], jobs)


if __name__ == "__main__":
    first_hand.command_line(__doc__, SUITES, generate)
