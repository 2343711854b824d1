#!/usr/bin/env python3
"""Real recordings, further: more of a trial against less of it, and each trial with the device of the others.

    real_whole.py --cromosim PATH --out DIR [--trial NAME]... [--only whole|leave-one-out] [--json FILE]

The data and what else it needs are real.py's. real_README.md says what is done.
"""

import argparse
import json
import sys
from dataclasses import fields, replace
from pathlib import Path

import real
import numpy as np
from scipy.optimize import minimize_scalar
from scipy.spatial.transform import Rotation

LESS, MORE = 0.4, 0.8
"""Shares of the movement that are fitted to; what is behind the larger one is the check part of both."""
SAME_BODY_M = 0.003
"""Lever arms of one body agree to this, m."""
EDGE_S = 1.0
"""As the diagnosis leaves out at the reference's ends."""


def joined(trial):
    """The whole movement of a trial that was cut."""
    return real.Recording(*(np.concatenate([getattr(trial.fit, one.name), getattr(trial.check, one.name)]) for one in fields(real.Recording)))


def parts(trial):
    """The trial fitted to less and to more of its movement, both with the same check part."""
    whole = joined(trial)
    times = whole.imu_s[whole.moving]
    at = [times[0], *(times[int(share * len(times))] for share in (LESS, MORE)), times[-1]]
    check = whole.between(at[2], at[3])
    return {"less": replace(trial, fit=whole.between(at[0], at[1]), check=check), "more": replace(trial, fit=whole.between(at[0], at[2]), check=check)}


def more_and_less(found, given):
    """Rows of real.py for both parts of each trial."""
    rows = []
    for name, (how, file) in found.items():
        row = {"name": name}
        for part, trial in parts(how(file)).items():
            row[part] = real.evaluate(f"{name}_{part}", lambda _, trial=trial: trial, file, given.cromosim, given.out)
            print(f"{name}: {part}", file=sys.stderr, flush=True)
        rows.append(row)
    return rows


def table_of_parts(rows):
    """More data against less, on the same check part."""
    lines = ["Fitted to the first 40 and 80 % of the movement, both checked on the last 20 %; RMSE as in real.py's table.", "",
             "| trial | plain fit of 40 % | of 80 % | diagnosis of 40 % | of 80 % | 80 % over 40 % | diagnosis over plain fit, 80 % |", "|---|---|---|---|---|---|---|"]
    worse, ahead = 0, 0
    for row in rows:
        less, more = row["less"], row["more"]
        cells = [row["name"], real.pair(less, "plain"), real.pair(more, "plain"), real.pair(less, "after"), real.pair(more, "after"), "-", "-"]
        if "after" in less and "after" in more:
            gains = [more["after"][channel] / less["after"][channel] for channel in ("accel", "gyro")]
            worse += max(gains) > 1.02
            ahead += max(real.ratios(more)) < 1
            cells[5:] = ["{:.2f} / {:.2f}".format(*gains), "{:.2f} / {:.2f}".format(*real.ratios(more))]
        lines.append("| " + " | ".join(cells) + " |")
    return "\n".join([*lines, "", f"twice the data is worse by more than 2 % in a channel on {worse} of {len(rows)}; with it the diagnosis beats the plain fit in both on {ahead}"])


def residual_of(trial, answer, motion):
    """RMSE of accel and gyro as it is, and the residual, off the reference's ends and gaps."""
    left = np.hstack([trial.fit.specific_force, trial.fit.angular_velocity]) - answer.simulate(motion, trial.fit.imu_s)
    left = left[real.trusted(trial.fit, EDGE_S)]
    return [real.root_mean_square(left[:, :3]), real.root_mean_square(left[:, 3:])], left


def with_device_of(trial, smoothing, own, others):
    """The plain fit with mount and lever arm of the others' fits (means); lag and biases are the trial's own."""
    motion = real.kinematics(trial.fit, smoothing)
    device = replace(own, mount=Rotation.from_rotvec([one.mount for one in others]).mean().as_rotvec(), lever_arm=np.mean([one.lever_arm for one in others], axis=0))

    def at(lag):
        answer = replace(device, lag_s=lag, accel_bias=np.zeros(3), gyro_bias=np.zeros(3))
        left = residual_of(trial, answer, motion)[1].mean(axis=0)
        return replace(answer, accel_bias=left[:3], gyro_bias=left[3:])

    lag = minimize_scalar(lambda lag: residual_of(trial, at(lag), motion)[0][1], bounds=(own.lag_s - 0.02, own.lag_s + 0.02), method="bounded").x
    return residual_of(trial, at(lag), motion)[0]


def groups(plain):
    """Names of the trials of each body: whose lever arms agree with those of the first."""
    left, found = list(plain), []
    while left:
        first = plain[left[0]][1].lever_arm
        found.append([name for name in left if np.linalg.norm(plain[name][1].lever_arm - first) < SAME_BODY_M])
        left = [name for name in left if name not in found[-1]]
    return [names for names in found if len(names) > 1]


def leave_one_out(found, given):
    """The fit parts of each body's trials diagnosed together: how far each gap falls, and with the device as the others show it."""
    trials = {name: how(file) for name, (how, file) in found.items() if how is real.broad}
    plain = {name: real.best_plain(trial)[1:3] for name, trial in trials.items()}
    rows = []
    for index, names in enumerate(groups(plain)):
        folder = given.out / f"body_{index}"
        folder.mkdir(parents=True, exist_ok=True)
        bags = [folder / f"{name}.mcap" for name in names]
        for bag, name in zip(bags, names):
            real.write_bag(bag, trials[name].placement, trials[name].fit)
        told, seconds = real.run([given.cromosim, "diagnose", *bags, "--out", folder / "diagnosis", "--force"], folder / "cromosim.log")
        print(f"body {index}: {len(names)} trials in {seconds:.0f} s", file=sys.stderr, flush=True)
        answers = json.loads((folder / "diagnosis" / "diagnosis.json").read_text())["placements"]["body"]["recordings"] if told else []
        for place, name in enumerate(names):
            smoothing, own = plain[name]
            others = [plain[other][1] for other in names if other != name]
            row = {"name": name, "body": index, "plain": residual_of(trials[name], own, real.kinematics(trials[name].fit, smoothing))[0],
                   "plain_left_out": with_device_of(trials[name], smoothing, own, others)}
            if told:
                said = answers[place]
                row |= {"together": [said["gap"]["after"][key] for key in ("accel_rmse", "gyro_rmse")], "left_out": [said["left_out"][key] for key in ("accel_rmse", "gyro_rmse")]}
            rows.append(row)
    return rows


def table_of_others(rows):
    """Each trial with its own device's values and with those of the others."""
    def two(values, digits=3):
        return f"{values[0]:.{digits}f} / {values[1]:.{digits + 1}f}"

    def over(row, key, base):
        return "{:.2f} / {:.2f}".format(*(a / b for a, b in zip(row[key], row[base]))) if key in row else "-"

    lines = ["The first 60 % of all trials of one body diagnosed together; RMSE as it is, not low-passed, on these parts, 1 s off ends and gaps.", "",
             "| trial | body | plain fit | with the others' mount and lever arm | diagnosis, together | device from the others | over its own: plain fit, diagnosis | diagnosis over plain fit, both with the others' |",
             "|---|---|---|---|---|---|---|---|"]
    for row in rows:
        cells = [row["name"], str(row["body"]), two(row["plain"]), two(row["plain_left_out"]), two(row["together"]) if "together" in row else "-", two(row["left_out"]) if "left_out" in row else "-",
                 f"{over(row, 'plain_left_out', 'plain')}, {over(row, 'left_out', 'together')}", over(row, "left_out", "plain_left_out")]
        lines.append("| " + " | ".join(cells) + " |")
    return "\n".join(lines)


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--cromosim", type=Path, required=True, help="the program to judge")
    parser.add_argument("--out", type=Path, required=True, help="where bags and diagnoses go")
    parser.add_argument("--trial", action="append", help="only this one (a part of its name is enough); may be given again")
    parser.add_argument("--only", choices=["whole", "leave-one-out"])
    parser.add_argument("--json", type=Path, help="write all numbers here")
    given = parser.parse_args()
    data = real.shared_data()
    found = {name: how for name, how in real.trials(data).items() if not given.trial or any(part in name for part in given.trial)}
    if not found:
        print("skipped: no recordings; CROMOSIM_DATA names the folder that holds paired_broad and paired_gaitmap_foot")
        return
    given.cromosim = given.cromosim.resolve()
    numbers = {}
    if given.only != "leave-one-out":
        numbers["whole"] = more_and_less(found, given)
        print(table_of_parts(numbers["whole"]) + "\n", flush=True)
    if given.only != "whole":
        numbers["leave_one_out"] = leave_one_out(found, given)
        print(table_of_others(numbers["leave_one_out"]))
    if given.json:
        given.json.write_text(json.dumps(numbers, indent=1))


if __name__ == "__main__":
    main()
