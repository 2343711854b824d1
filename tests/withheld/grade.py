#!/usr/bin/env python3
"""Grades diagnoses against the encrypted labels: re-simulates each check recording and prints Markdown tables."""
import argparse
import json
import os
import subprocess
import sys
from concurrent.futures import ThreadPoolExecutor

import numpy as np
from scipy.spatial.transform import Rotation

import generate
import model
import recording
import tables

Z90 = 1.645
UNSCALED = ("axis_convention", "accel_units", "gyro_units", "gravity_convention", "unknown")  # no coverage of a choice


def _yaml(value):
    if isinstance(value, (list, tuple)):
        return "[" + ", ".join(_yaml(item) for item in value) + "]"
    return value if isinstance(value, str) else repr(float(value))


def write_effects(path, label):
    """The true effects.yaml of a case."""
    lines = ["schema: cromosim/effects/1", "placements:"]
    for name, item in label["placements"].items():
        seconds, nanoseconds = divmod(item["epoch_ns"], 1_000_000_000)
        accel, gyro = (sigma / np.sqrt(item["imu_rate"]) for sigma in item["sigmas"])
        lines += [f"  {name}:", f"    epoch: {seconds}.{nanoseconds:09d}",
                  f"    declared_noise: {{accel_density: {_yaml(accel)}, gyro_density: {_yaml(gyro)}}}"]
        lines.append("    effects:" if item["effects"] else "    effects: []")
        for effect, parameters in item["effects"].items():
            inner = "".join(f", {key}: {_yaml(value)}" for key, value in parameters.items())
            lines.append(f"      - {{effect: {effect}{inner}}}")
    with open(path, "w") as stream:
        stream.write("\n".join(lines) + "\n")


def _usable(stamps, reference, item):
    """Off the ends of the reference by 1 s and off its gaps by 0.2 s, by the message's stamp and by its true time."""
    edges = reference.astype(float)
    base = float(item["epoch_ns"])
    relative = (stamps - item["epoch_ns"]) * 1e-9
    grid = (edges - base) * 1e-9
    interval = np.median(np.diff(grid))
    gaps = [(grid[k], grid[k + 1]) for k in np.flatnonzero(np.diff(grid) > 1.6 * interval)]
    keep = np.ones(len(stamps), bool)
    for times in (relative, model.true_times(relative, 0.0, item["effects"])):
        keep &= (times > grid[0] + 1) & (times < grid[-1] - 1)
        for begin, end in gaps:
            keep &= (times < begin - 0.2) | (times > end + 0.2)
    return keep


def measured_gap(check, simulated, label):
    """Per placement: rmse of accel and gyro, and how many messages had no counterpart."""
    out = {}
    for name, item in label["placements"].items():
        stamps, gyro, accel = check[name]["imu"]
        other_stamps, other_gyro, other_accel = simulated.get(name, {}).get("imu", (np.zeros(0, np.int64), np.zeros((0, 3)), np.zeros((0, 3))))
        _, own, other = np.intersect1d(stamps, other_stamps, return_indices=True)
        usable = _usable(stamps, check[name]["reference"][0], item)
        chosen = usable[own]
        own, other = own[chosen], other[chosen]
        if not len(own):
            out[name] = {"accel": None, "gyro": None, "missing": int(usable.sum())}
            continue
        rms = lambda a, b: float(np.sqrt(np.mean(np.sum((a - b) ** 2, axis=1))))
        out[name] = {"accel": rms(accel[own], other_accel[other]), "gyro": rms(gyro[own], other_gyro[other]), "missing": int(usable.sum() - len(own))}
    return out


def simulate(cromosim, check, effects, out):
    command = [cromosim, "simulate", "--reference", check, "--no-noise", "--out", out]
    done = subprocess.run(command + (["--effects", effects] if effects else []), capture_output=True, text=True)
    if done.returncode:
        return None, (done.stderr or done.stdout).strip()[-300:]
    try:
        return recording.read(out), None
    finally:
        os.remove(out)


def _flat(value):
    return np.ravel(np.array(value, float))


def compare(effect, true, said, errors):
    """Scalars inside their 90 % interval and in all, and the named error of the effect where it has one."""
    inside = total = 0
    said = dict(said)
    if effect == "vibration":
        for amplitude, phase in (("amplitude", "phase"), ("gyro_amplitude", "gyro_phase")):
            if {amplitude, phase} <= set(said):  # a negative amplitude is the same wave, half a turn on
                turned = _flat(said[phase]) + np.where(_flat(said[amplitude]) < 0, np.pi, 0.0) - _flat(true[phase])
                said[amplitude] = np.abs(_flat(said[amplitude])).tolist()
                said[phase] = (_flat(true[phase]) + (turned + np.pi) % (2 * np.pi) - np.pi).tolist()
    for key, value in true.items():
        if effect in UNSCALED or key not in said or errors is None or errors.get(key) is None:
            continue
        difference, error = np.abs(_flat(said[key]) - _flat(value)), _flat(errors[key])
        if difference.shape != error.shape:
            continue
        inside, total = inside + int(np.sum(difference <= Z90 * error)), total + len(error)
    named = None
    if effect == "time_offset":
        named = abs(said["seconds"] - true["seconds"]) * 1e3
    elif effect == "lever_arm":
        named = float(np.linalg.norm(_flat(said["offset"]) - _flat(true["offset"]))) * 1e3
    elif effect == "mount_rotation":
        turn = Rotation.from_rotvec(_flat(true["rotvec"])).inv() * Rotation.from_rotvec(_flat(said["rotvec"]))
        named = float(np.degrees(turn.magnitude()))
    return {"effect": effect, "inside": inside, "scalars": total, "error": named, "true": true, "said": said, "standard_errors": errors}


def hidden_of(label, name):
    if label["suite"] == "outside":
        return {"unknown"} if name == label["affected"] else set()
    return set(label["placements"][name]["effects"])


def grade_case(case, out, labels, results, cromosim):
    label = generate.read_label(labels, case)
    folder = os.path.join(results, case)
    record = {"case": case, "suite": label["suite"], "affected": label["affected"], "strength": label["strength"], "label": label, "placements": {}}
    diagnosis = {}
    try:
        with open(os.path.join(folder, "diagnosis.json")) as stream:
            diagnosis = json.load(stream)["placements"]
    except (OSError, ValueError, KeyError) as error:
        record["failed"] = repr(error)
    try:
        with open(os.path.join(folder, "time.txt")) as stream:
            record["seconds"] = [float(word) / len(label["placements"]) for word in stream.read().split()]
    except OSError:
        record["seconds"] = None
    check_path = os.path.join(out, case, "check.mcap")
    check, gaps = recording.read(check_path), {}
    os.makedirs(folder, exist_ok=True)
    true_path = os.path.join(folder, "true_effects.yaml")
    write_effects(true_path, label)
    for key, effects in (("said", os.path.join(folder, "effects.yaml")), ("true", true_path), ("nominal", None)):
        if effects and not os.path.exists(effects):
            continue
        simulated, error = simulate(cromosim, check_path, effects, os.path.join(folder, f"{key}.mcap"))
        if error:
            record.setdefault("errors", {})[key] = error
        elif simulated is not None:
            gaps[key] = measured_gap(check, simulated, label)
    for name, item in label["placements"].items():
        said = diagnosis.get(name, {})
        causes = said.get("causes", [])
        hidden, named = hidden_of(label, name), {cause["effect"] for cause in causes}
        shares = sum(cause.get("gap_share", 0.0) for cause in causes) + said.get("unexplained", {}).get("share", 0.0)
        record["placements"][name] = {
            "hidden": sorted(hidden), "named": sorted(named), "present": name in diagnosis,
            "causes": [{"effect": cause["effect"], "probability": cause.get("probability"), "gap_share": cause.get("gap_share"), "right": cause["effect"] in hidden} for cause in causes],
            "parameters": [compare(cause["effect"], item["effects"][cause["effect"]], cause.get("parameters", {}), cause.get("standard_errors"))
                           for cause in causes if cause["effect"] in item["effects"]],
            "share_sum": shares if causes else None, "gap": said.get("gap"), "unidentifiable": [entry.get("effect") for entry in said.get("unidentifiable", [])],
            "measured": {key: value[name] for key, value in gaps.items()}}
    tables.judge(record)
    return record


def grade(out, labels, results, cromosim, jobs=2):
    cases = sorted(name for name in os.listdir(out) if os.path.isdir(os.path.join(out, name)))
    # the labels stay shut until every case has its diagnosis, or the note that it has failed
    waiting = [case for case in cases if not os.path.exists(os.path.join(results, case, "time.txt"))]
    if waiting:
        sys.exit(f"{len(waiting)} of {len(cases)} cases have no diagnosis yet, first {waiting[0]}: the labels stay shut")
    with ThreadPoolExecutor(jobs) as pool:
        return list(pool.map(lambda case: grade_case(case, out, labels, results, cromosim), cases))


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("out")
    parser.add_argument("labels")
    parser.add_argument("results")
    parser.add_argument("--cromosim", required=True)
    parser.add_argument("--json", metavar="FILE")
    parser.add_argument("--jobs", type=int, default=2)
    options = parser.parse_args()
    graded = grade(options.out, options.labels, options.results, options.cromosim, options.jobs)
    print(tables.report(graded))
    if options.json:
        with open(options.json, "w") as stream:
            json.dump(graded, stream, indent=1)
