#!/usr/bin/env python3
"""Hides effects of the contract in real recordings, and asks whether the diagnosis finds them there.

    inject.py --cromosim PATH --out DIR [--count 70] [--seed N] [--jobs 2] [--json FILE]

Nobody knows what a real recording holds by itself. So each window of a trial of BROAD is diagnosed twice: as it is, and with one effect put into the
readings (or into the reference). The second answer should be the first one and the effect, with its value on top of what was there. The data are looked
for in $CROMOSIM_DATA, else in ../shared/data beside the repository; where there are none, it says "skipped". real_README.md says what the numbers mean.
"""
import argparse
import json
import sys
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

import real  # first: it says how many threads numpy may take
import numpy as np
import yaml
from scipy.interpolate import CubicSpline
from scipy.spatial.transform import Rotation, Slerp

import effects as library
import grade
import model
import recording
import run
import tables

FIT_SECONDS, CHECK_SECONDS = 60.0, 30.0
PLACE = "body"
EDGE = 1.0  # s off the reference's ends and gaps that are not judged
ADDED = {"lever_arm": "offset", "time_offset": "seconds", "clock_drift": "ppm", "channel_delay": "seconds", "accel_bias": "bias", "gyro_bias": "bias",
         "accel_misalignment": "upper", "gyro_misalignment": "upper", "accel_bias_drift": "rate", "gyro_bias_drift": "rate", "gyro_g_sensitivity": "matrix"}
TIMES = {"accel_scale": "scale", "gyro_scale": "scale", "reference_scale": "factor"}
TURNS = {"mount_rotation": "rotvec", "reference_tilt": "rotvec"}


def windows(rng, trial):
    """Fit and check of one window in the movement, both with a second of reference beyond the readings."""
    whole = trial.fit.imu_s[0], trial.check.imu_s[-1]
    start = rng.uniform(whole[0], whole[1] - FIT_SECONDS - CHECK_SECONDS)
    both = real.Recording(*(np.concatenate([getattr(part, name) for part in (trial.fit, trial.check)])
                            for name in ("imu_s", "specific_force", "angular_velocity", "moving", "reference_s", "position", "quaternion")))
    return both.between(start, start + FIT_SECONDS), both.between(start + FIT_SECONDS, start + FIT_SECONDS + CHECK_SECONDS)


def attitude(part, times, mount):
    """World_from_sensor at times, chords between the frames that are seen."""
    seen = ~np.isnan(part.position[:, 0])
    stamps = part.reference_s[seen]
    return Slerp(stamps, Rotation.from_quat(part.quaternion[seen]))(np.clip(times, stamps[0], stamps[-1])) * mount


def hide_in_readings(rng, part, t0, effects, rotation):
    """Stages 2 to 9 on readings as they are. rotation: world_from_sensor at the readings' times."""
    times, force, rate = part.imu_s, part.specific_force, part.angular_velocity
    step = float(np.median(np.diff(times)))
    mode = effects.get("gravity_convention", {}).get("mode")
    force = force + rotation.apply({None: 0.0, "removed": 1.0, "negated": 2.0}[mode] * model.GRAVITY, inverse=True)
    if "soft_tissue" in effects:
        force = model.soft_tissue(force, rate, rotation, step, **effects["soft_tissue"])
    force, rate = model.mount(force, rate, times, effects)
    if "vibration" in effects:
        force, rate = model.vibration(times - t0, effects["vibration"], force, rate)
    if "gyro_g_sensitivity" in effects:
        rate = rate + force @ np.array(effects["gyro_g_sensitivity"]["matrix"]).T
    if "low_pass" in effects:
        force, rate = (model.low_pass(x, step, **effects["low_pass"]) for x in (force, rate))
    if "channel_delay" in effects:
        rate = CubicSpline(times, rate)(np.clip(times - effects["channel_delay"]["seconds"], times[0], times[-1]))
    values = []
    for channel, value in (("accel", force), ("gyro", rate)):
        bias = np.array(effects.get(f"{channel}_bias", {}).get("bias", [0.0] * 3))
        drift = np.array(effects.get(f"{channel}_bias_drift", {}).get("rate", [0.0] * 3))
        values.append(value @ model.channel_matrix(effects, channel).T + bias + (times - t0)[:, None] * drift)
    force, rate = model.outer_stages(rng, *values, step, (0.0, 0.0), effects)
    keep = model.kept_samples(rng, len(times), effects)
    return model.stamps_of(times, t0, effects)[keep], force[keep], rate[keep]


def hide_in_reference(rng, part, effects, filtering):
    """The reported poses; a lever arm moves the reported point, for the sensor stays where it is."""
    seen = ~np.isnan(part.position[:, 0])
    times, position = part.reference_s, real.filled(part.reference_s, part.position)
    rotation = Rotation.from_quat(real.filled(times, real.continuous(part.quaternion)))
    if "lever_arm" in effects:
        position = position - rotation.apply(effects["lever_arm"]["offset"])
    if "reference_interpolation" in effects:
        frames = np.arange(times[0], times[-1] + 1e-9, 1 / effects["reference_interpolation"]["rate_hz"])
        seen &= times <= frames[-1]
        at_frames = np.stack([np.interp(frames, times, axis) for axis in position.T], axis=1), Slerp(times, rotation)(frames)
        position, rotation = model.chords(frames, *at_frames, np.minimum(times, frames[-1]))
    if "reference_smoothing" in effects:
        position, rotation = model.smooth(position, rotation, real.rate(times), effects["reference_smoothing"]["cutoff_hz"], filtering)
    position = position * effects.get("reference_scale", {}).get("factor", 1.0)
    tilt = Rotation.from_rotvec(effects.get("reference_tilt", {}).get("rotvec", [0.0] * 3))
    position, rotation = model.reported(rng, tilt.apply(position), tilt * rotation, effects, (0.0, 0.0))
    return times[seen], position[seen] * effects.get("reference_units", {}).get("factor", 1.0), real.continuous(rotation.as_quat())[seen]


def write(path, rng, part, t0, effects, mount, filtering, declared):
    reference = hide_in_reference(rng, part, effects, filtering)
    stamps, force, rate = hide_in_readings(rng, part, t0, effects, attitude(part, part.imu_s, mount))
    recording.write(path, {PLACE: {"reference": (real.nanoseconds(reference[0]), *reference[1:]), "imu": (real.nanoseconds(stamps), rate, force), "variances": declared}})


def answer(folder):
    """Name to cause, and the effects of effects.yaml."""
    with open(folder / "diagnosis.json") as stream:
        causes = {cause["effect"]: cause for cause in json.load(stream)["placements"][PLACE]["causes"]}
    with open(folder / "effects.yaml") as stream:
        said = yaml.safe_load(stream)
    return causes, said


def parameters_of(said):
    return {entry["effect"]: {key: value for key, value in entry.items() if key != "effect"} for entry in said["placements"][PLACE]["effects"]}


def on_top(effect, injected, there):
    """The value that the effect should have: what was injected on top of what was there."""
    both = dict(injected)
    for names, join in ((ADDED, lambda a, b: a + b), (TIMES, lambda a, b: a * b), (TURNS, lambda a, b: (Rotation.from_rotvec(b) * Rotation.from_rotvec(a)).as_rotvec())):
        if effect in names and there:
            key = names[effect]
            both[key] = np.array(join(np.array(injected[key], float), np.array(there[key], float))).tolist()
    return both


def size(effect, value):
    """What an effect's value is measured by: its main vector, less what is neutral."""
    neutral = 1.0 if effect in TIMES else 0.0
    key = {**ADDED, **TIMES, **TURNS, "mount_slip": "rotvec", "reference_smoothing": "cutoff_hz", "reference_interpolation": "rate_hz", "low_pass": "cutoff_hz",
           "soft_tissue": "natural_hz", "dropped_samples": "fraction", "vibration": "amplitude", "accel_saturation": "limit", "gyro_saturation": "limit",
           "accel_quantization": "lsb", "gyro_quantization": "lsb", "accel_noise": "density", "gyro_noise": "density", "reference_units": "factor",
           "accel_units": "factor", "gyro_units": "factor", "axis_convention": "matrix"}.get(effect)
    return np.ravel(np.array(value[key], float)) - neutral if key and key in value else None


def value_error(effect, injected, wanted, said):
    """Distance of the value from what it should be, over the injected size; None where that says nothing."""
    true, found = size(effect, wanted), size(effect, said)
    if true is None or found is None or true.shape != found.shape:
        return None
    if effect == "vibration":
        found = np.abs(found)
    return float(np.linalg.norm(found - true) / np.linalg.norm(size(effect, injected)))


def left(cromosim, folder, name, said):
    """RMSE of the readings less their simulation, by channel, off the reference's ends and gaps; None where it fails."""
    path, out = str(folder / "check.mcap"), str(folder / f"{name}.mcap")
    simulated, error = grade.simulate(cromosim, path, said, out)
    if error:
        return None
    check, again = recording.read(path)[PLACE], simulated[PLACE]
    stamps = check["imu"][0]
    reference = check["reference"][0]
    holes = np.flatnonzero(np.diff(reference) > 1.6 * np.median(np.diff(reference)))
    edge = EDGE * 1e9
    known = (stamps > reference[0] + edge) & (stamps < reference[-1] - edge)
    for hole in holes:
        known &= (stamps < reference[hole] - edge / 5) | (stamps > reference[hole + 1] + edge / 5)
    _, own, far = np.intersect1d(stamps[known], again["imu"][0], return_indices=True)
    result = {}
    for channel, index in (("gyro", 1), ("accel", 2)):
        difference = check["imu"][index][known][own] - again["imu"][index][far]
        result[channel] = float(np.sqrt(np.mean(np.sum(difference**2, axis=1))))
    return result


def declared_by(said, rate_hz):
    """Variances per sample that a device with the white noise of an answer declares: gyroscope, accelerometer."""
    noise = said["placements"][PLACE]["declared_noise"]
    return tuple(noise[f"{channel}_density"] ** 2 * rate_hz for channel in ("gyro", "accel"))


def diagnosed(cromosim, folder, parts, rng_seed, t0, effects, mount, filtering, declared=(0.0, 0.0)):
    """Bags with the effects in them, and what the diagnosis says of the first."""
    folder.mkdir(parents=True, exist_ok=True)
    for index, (name, part) in enumerate(zip(("fit", "check"), parts)):
        write(folder / f"{name}.mcap", np.random.default_rng([*rng_seed, index]), part, t0, effects, mount, filtering, declared)
    kept = (folder / "time.txt").exists() and (folder / "diagnosis.json").exists()
    if not kept and run.diagnose(cromosim, [str(folder / "fit.mcap")], str(folder)):
        return None
    return answer(folder)


def drawn(rng, effect, level, parts, t0):
    """The contract's effect at a strength; a saturation clips a share of these readings."""
    part = parts[0]
    context = {"sigmas": (0.014, 0.0012), "rate": real.rate(part.imu_s), "reference_rate": real.rate(part.reference_s), "start": t0, "seconds": FIT_SECONDS}
    value = library.draw(rng, effect, level, context)
    if "clipped" in value:
        series = part.specific_force if effect.startswith("accel") else part.angular_velocity
        value = {"limit": float(np.quantile(np.abs(series).max(axis=1), 1 - value["clipped"]))}
    return value


def case(cromosim, out, seed, index, effect, level, name, how, file):
    """One effect in one window of one trial."""
    rng = np.random.default_rng([seed, index])
    parts = windows(rng, how(file))
    t0 = round(float(parts[0].imu_s[0]), 9)
    injected = drawn(rng, effect, level, parts, t0)
    filtering = {"kernel": str(rng.choice(["butterworth", "gaussian"], p=[0.7, 0.3]))}
    folder = out / f"{index:03d}"
    base = diagnosed(cromosim, folder / "base", parts, (seed, index), t0, {}, Rotation.identity(), filtering)
    record = {"index": index, "trial": name, "effect": effect, "level": library.STRENGTHS[level], "injected": json.loads(json.dumps(injected, default=float)), "kernel": filtering["kernel"]}
    if base is None:
        return record | {"failed": "base"}
    there = parameters_of(base[1])
    mount = Rotation.from_rotvec(there.get("mount_rotation", {}).get("rotvec", [0.0] * 3))
    declared = declared_by(base[1], real.rate(parts[0].imu_s))
    found = diagnosed(cromosim, folder / "hidden", parts, (seed, index), t0, {effect: injected}, mount, filtering, declared)
    if found is None:
        return record | {"failed": "hidden"}
    said = parameters_of(found[1])
    absolute = dict(injected, at=injected["at"] + real.EPOCH_NS * 1e-9) if effect == "mount_slip" else injected
    wanted = on_top(effect, absolute, there.get(effect))
    truth = dict(base[1], placements={PLACE: dict(base[1]["placements"][PLACE], effects=[
        {"effect": key, **value} for key, value in {**there, effect: wanted}.items()])})
    with open(folder / "hidden" / "true_effects.yaml", "w") as stream:
        yaml.safe_dump(json.loads(json.dumps(truth, default=float)), stream)
    plain = grade.simulation_seconds(cromosim, [str(folder / "hidden" / "fit.mcap")], str(folder / "hidden"))
    with open(folder / "hidden" / "time.txt") as stream:
        seconds = float(stream.read().split()[1])
    return record | {
        "base": sorted(base[0]), "named": sorted(found[0]), "kept": sorted(said), "probabilities": {key: cause["probability"] for key, cause in found[0].items()},
        "value_error": value_error(effect, injected, wanted, said[effect]) if effect in said else None, "wanted": json.loads(json.dumps(wanted, default=float)), "said": said.get(effect),
        "standard_errors": found[0].get(effect, {}).get("standard_errors"), "cost": seconds / plain if plain else None,
        "left": {key: left(cromosim, folder / "hidden", key, str(folder / "hidden" / file) if file else None)
                 for key, file in (("said", "effects.yaml"), ("true", "true_effects.yaml"), ("nominal", None))},
        "left_before": left(cromosim, folder / "base", "said", str(folder / "base" / "effects.yaml"))}


# --- The report ---


def judge(record):
    """Adds what the table counts."""
    effect = record["effect"]
    if "named" not in record:
        return record | {"found": False, "new": [], "lost": [], "valued": None, "near": None}
    named, base = set(record["named"]), set(record["base"])
    found = effect in named or (effect in record["kept"] and effect in base | {"time_offset", "mount_rotation", "lever_arm", "accel_bias", "gyro_bias"})
    error = record["value_error"]
    ratios = [record["left"]["said"][channel] / record["left"]["true"][channel] for channel in ("accel", "gyro")] if record["left"]["said"] and record["left"]["true"] else None
    return record | {"found": found, "new": sorted(named - base - {effect}), "lost": sorted(base - named - {effect}),
                     "valued": None if error is None else error <= 0.15, "ratios": ratios, "near": ratios is not None and max(ratios) <= 1.15}


def percent(values):
    values = [value for value in values if value is not None]
    return f"{100 * np.mean(values):.0f} %" if values else ""


def report(records):
    """The tables as Markdown."""
    lines = ["| effects put in | found | nothing else new | nothing lost | value within 15 % of its size | gap at most 1.15 times that with the true value | at most 20 times `simulate --reference` |", "|---|---|---|---|---|---|---|"]
    for level in (*library.STRENGTHS, None):
        rows = [record for record in records if level in (None, record["level"])]
        if rows:
            cost = [record["cost"] <= 20 for record in rows if record.get("cost")]
            cells = [f"{level or 'all'}, {len(rows)}", percent([row["found"] for row in rows]), percent([not row["new"] for row in rows]),
                     percent([not row["lost"] for row in rows]), percent([row["valued"] for row in rows]), percent([row["near"] for row in rows]), percent(cost)]
            lines.append("| " + " | ".join(cells) + " |")
    said = [(record["probabilities"][name], name == record["effect"]) for record in records if "probabilities" in record
            for name in record["named"] if name not in record["base"]]
    if said:
        lines += ["", "Probabilities of causes that the window did not have before:", ""] + tables.reliability(*zip(*said))
    lines += ["", "What is not as wanted:", "", "| case | trial | effect | found | new | lost | value's error | gap over that with the true value: accel, gyro |", "|---|---|---|---|---|---|---|---|"]
    for row in records:
        if row["found"] and not row["new"] and not row["lost"] and row["valued"] is not False and row["near"]:
            continue
        error = row.get("value_error")
        cells = [f"{row['index']}", row["trial"], f"{row['effect']} ({row['level']})", "yes" if row["found"] else "no", ", ".join(row["new"]), ", ".join(row["lost"]),
                 "" if error is None else f"{error:.2f}", "{:.2f}, {:.2f}".format(*row["ratios"]) if row.get("ratios") else row.get("failed", "")]
        lines.append("| " + " | ".join(cells) + " |")
    return "\n".join(lines)


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--cromosim", type=Path, required=True, help="the program to judge")
    parser.add_argument("--out", type=Path, required=True, help="where bags and diagnoses go; an answer that is there is not asked for again")
    parser.add_argument("--count", type=int, default=2 * len(library.ALL), help="cases: each effect at medium strength, then strong, then weak")
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--effect", action="append", help="only this one; may be given again")
    parser.add_argument("--jobs", type=int, default=2)
    parser.add_argument("--json", type=Path, help="write all numbers here")
    given = parser.parse_args()
    data = real.shared_data()
    found = sorted((name, *how) for name, how in real.trials(data).items() if how[0] is real.broad)
    if not found:
        print("skipped: no recordings; CROMOSIM_DATA names the folder that holds paired_broad")
        return
    cromosim = str(given.cromosim.resolve())
    plan = [(effect, level) for level in (1, 2, 0) for effect in library.ALL if level == 1 or effect not in library.CONVENTIONS][:given.count]
    rng = np.random.default_rng([given.seed])
    order = [found[k % len(found)] for k in rng.permutation(len(plan))]
    work = [(index, *one, trial) for index, (one, trial) in enumerate(zip(plan, order)) if not given.effect or one[0] in given.effect]
    records = []
    with ThreadPoolExecutor(given.jobs) as pool:
        waiting = [pool.submit(case, cromosim, given.out, given.seed, index, effect, level, *trial) for index, effect, level, trial in work]
        for done in waiting:
            records.append(judge(done.result()))
            print(f"{len(records)} of {len(waiting)}: {records[-1]['effect']}", file=sys.stderr, flush=True)
    print(report(records))
    for path in filter(None, (given.out / "injected.json", given.json)):
        path.write_text(json.dumps(records, indent=1))


if __name__ == "__main__":
    main()
