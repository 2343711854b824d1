#!/usr/bin/env python3
"""Grades diagnoses against the encrypted labels: re-simulates each check recording and prints Markdown tables."""
import argparse
import json
import os
import re
import subprocess
import sys
import tempfile
from concurrent.futures import ThreadPoolExecutor

import numpy as np
from scipy.spatial.transform import Rotation

import generate
import model
import recording
import tables

Z90 = 1.645
UNSCALED = ("reference_units", "axis_convention", "accel_units", "gyro_units", "gravity_convention", "unknown")  # no coverage of a choice


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
    """Per placement: rmse of accel and gyro, squared difference over stated variance, and how many messages had no counterpart."""
    out = {}
    absent = {"imu": (np.zeros(0, np.int64), np.zeros((0, 3)), np.zeros((0, 3))), "covariances": (np.zeros((0, 3)), np.zeros((0, 3)))}
    for name, item in label["placements"].items():
        stamps, other = check[name]["imu"][0], simulated.get(name, absent)
        _, own, far = np.intersect1d(stamps, other["imu"][0], return_indices=True)
        usable = _usable(stamps, check[name]["reference"][0], item)
        chosen = usable[own]
        own, far = own[chosen], far[chosen]
        out[name] = {"accel": None, "gyro": None, "accel_over_stated": None, "gyro_over_stated": None, "missing": int(usable.sum() - len(own))}
        for channel, index in (("gyro", 0), ("accel", 1)) if len(own) else ():
            squared = (check[name]["imu"][index + 1][own] - other["imu"][index + 1][far]) ** 2
            stated = other["covariances"][index][far]
            out[name][channel] = float(np.sqrt(np.mean(np.sum(squared, axis=1))))
            if np.all(stated > 0):
                out[name][f"{channel}_over_stated"] = float(np.mean(squared / stated))
    return out


def run(command):
    """Exit status, what was printed, and the processor seconds of the child alone."""
    with tempfile.TemporaryFile() as text:
        child = subprocess.Popen(command, stdout=text, stderr=subprocess.STDOUT)
        _, status, usage = os.wait4(child.pid, 0)
        child.returncode = os.waitstatus_to_exitcode(status)
        text.seek(0)
        return child.returncode, text.read().decode(errors="replace").strip(), usage.ru_utime + usage.ru_stime


def simulate(cromosim, check, effects, out):
    command = [cromosim, "simulate", "--reference", check, "--no-noise", "--out", out]
    code, text, _ = run(command + (["--effects", effects] if effects else []))
    if code:
        return None, text[-300:]
    try:
        return recording.read(out), None
    finally:
        os.remove(out)


def simulation_seconds(cromosim, recordings, folder):
    """Processor seconds of a plain re-simulation of all of them: what a diagnosis's time is measured by."""
    total, out = 0.0, os.path.join(folder, "plain.mcap")
    for path in recordings:
        code, _, seconds = run([cromosim, "simulate", "--reference", path, "--out", out])
        if code:
            return None
        os.remove(out)
        total += seconds
    return total


def session_of(label, effects_path):
    """The session that the answer is about: that of its epoch, else the last. A diagnosis of several recordings writes one file of effects,
    and the contract does not say for which of them. Epochs of list items are those of `other_sessions`."""
    try:
        with open(effects_path) as stream:
            epochs = [int(whole) for whole in re.findall(r"^\s*epoch:\s*['\"]?(\d+)\.?\d*", stream.read(), re.MULTILINE)]
    except OSError:
        epochs = []
    for index, placements in enumerate(label["sessions"]):
        if any(abs(epoch - item["epoch_ns"] * 1e-9) < 5 for epoch in epochs for item in placements.values()):
            return index
    return len(label["sessions"]) - 1


def _flat(value):
    return np.ravel(np.array(value, float))


def one_wave(wave):
    """The same wave with amplitudes that are not negative: a sign is half a turn of the phase."""
    wave = dict(wave)
    for amplitude, phase in (("amplitude", "phase"), ("gyro_amplitude", "gyro_phase")):
        if {amplitude, phase} <= set(wave):
            size = _flat(wave[amplitude])
            wave[amplitude], wave[phase] = np.abs(size).tolist(), (_flat(wave[phase]) + np.pi * (size < 0)).tolist()
    return wave


def compare(effect, true, said, errors):
    """Scalars inside their 90 % interval and in all, and the named error of the effect where it has one."""
    inside = total = 0
    said = dict(said)
    if effect == "vibration":
        true, said = one_wave(true), one_wave(said)
        for key in {"phase", "gyro_phase"} & set(true) & set(said):
            size = _flat(true[key.replace("phase", "amplitude")])
            if not size.any():  # a wave that is not there has no phase
                del said[key]
                continue
            said[key] = (_flat(true[key]) + ((_flat(said[key]) - _flat(true[key]) + np.pi) % (2 * np.pi) - np.pi) * (size > 0)).tolist()
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


def read_diagnosis(folder, record):
    try:
        with open(os.path.join(folder, "diagnosis.json")) as stream:
            return json.load(stream)["placements"]
    except (OSError, ValueError, KeyError) as error:
        record["failed"] = repr(error)
        return {}


def read_seconds(folder):
    """(wall, processor) of the diagnosis."""
    try:
        with open(os.path.join(folder, "time.txt")) as stream:
            return [float(word) for word in stream.read().split()]
    except OSError:
        return None


def check_gaps(record, label, case_folder, folder, cromosim):
    """The gap on the check recording with the effects that were said, with the true ones, and with none."""
    check_path = generate.recordings(case_folder, "check")[record["session"]]
    check, gaps, said = recording.read(check_path), {}, os.path.join(folder, "effects.yaml")
    chosen = {"said": said if os.path.exists(said) else False, "nominal": None}
    if label.get("formula", True):  # mechanics has no file of true effects
        chosen["true"] = os.path.join(folder, "true_effects.yaml")
        write_effects(chosen["true"], label)
    for key, effects in chosen.items():
        if effects is False:
            continue
        simulated, error = simulate(cromosim, check_path, effects, os.path.join(folder, f"{key}.mcap"))
        if error:
            record.setdefault("errors", {})[key] = error
        elif simulated is not None:
            gaps[key] = measured_gap(check, simulated, label)
    return gaps


def grade_placement(label, name, diagnosis, gaps):
    said, item = diagnosis.get(name, {}), label["placements"][name]
    causes = said.get("causes", [])
    hidden, named = hidden_of(label, name), {cause["effect"] for cause in causes}
    shares = sum(cause.get("gap_share", 0.0) for cause in causes) + said.get("unexplained", {}).get("share", 0.0)
    return {
        "hidden": sorted(hidden), "named": sorted(named), "present": name in diagnosis,
        "causes": [{"effect": cause["effect"], "probability": cause.get("probability"), "gap_share": cause.get("gap_share"), "right": cause["effect"] in hidden} for cause in causes],
        "parameters": [compare(cause["effect"], item["effects"][cause["effect"]], cause.get("parameters", {}), cause.get("standard_errors"))
                       for cause in causes if item["effects"].get(cause["effect"])],
        "share_sum": shares if causes else None, "gap": said.get("gap"), "unidentifiable": [entry.get("effect") for entry in said.get("unidentifiable", [])],
        "measured": {key: value[name] for key, value in gaps.items()}}


def grade_case(case, out, labels, results, cromosim):
    label, folder, case_folder = generate.read_label(labels, case), os.path.join(results, case), os.path.join(out, case)
    os.makedirs(folder, exist_ok=True)
    record = {"case": case, "suite": title(label), "affected": label["affected"], "strength": label["strength"], "label": label}
    record["session"] = session_of(label, os.path.join(folder, "effects.yaml"))
    label["placements"] = label["sessions"][record["session"]]
    diagnosis, seconds = read_diagnosis(folder, record), read_seconds(folder)
    record["seconds"] = seconds and [value / len(label["placements"]) for value in seconds]
    plain = simulation_seconds(cromosim, generate.recordings(case_folder, "fit"), folder)
    record["cost"] = seconds[1] / plain if seconds and plain and diagnosis else None
    gaps = check_gaps(record, label, case_folder, folder, cromosim)
    record["placements"] = {name: grade_placement(label, name, diagnosis, gaps) for name in label["placements"]}
    tables.judge(record)
    return record


def title(label):
    """The suite, with the length where it is another than the suite's own."""
    usual = label["suite"].startswith(("mechanics", "other-", "third-", "fourth-", "fifth-")) or label["seconds"] == generate.usual_seconds(label["suite"])
    return label["suite"] if usual else f"{label['suite']} {label['seconds']:.0f} s"


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
