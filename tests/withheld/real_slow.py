#!/usr/bin/env python3
"""Real recordings with slow poses: what a diagnosis leaves where only every so many-th pose is there.

    real_slow.py --cromosim PATH --out DIR [--every 10] [--trial NAME]...

The data and what else it needs are real.py's, and so are the parts that are fitted to and checked.
"""

import argparse
import json
import sys
from dataclasses import replace
from pathlib import Path

import numpy as np
import real


def thinned(recording, every):
    """The recording with every so many-th pose."""
    own = slice(None, None, every)
    return replace(recording, reference_s=recording.reference_s[own], position=recording.position[own], quaternion=recording.quaternion[own])


def evaluate(name, trial, given):
    """Rates and what is left on the check part, without effects and with the diagnosed ones."""
    folder = given.out / name
    folder.mkdir(parents=True, exist_ok=True)
    for part in ("fit", "check"):
        real.write_bag(folder / f"{part}.mcap", trial.placement, getattr(trial, part))
    log, effects = folder / "cromosim.log", folder / "diagnosis" / "effects.yaml"
    real.run([given.cromosim, "diagnose", folder / "fit.mcap", "--out", folder / "diagnosis", "--force"], log)
    base = [given.cromosim, "simulate", "--reference", folder / "check.mcap", "--no-noise", "--force"]
    series = {}
    for key, more in (("nominal", []), ("after", ["--effects", effects])):
        if not real.run([*base, *more, "--out", folder / f"{key}.mcap"], log)[0]:
            sys.exit(f"{name}: {log} says what went wrong")
        series[key] = real.simulated(folder / f"{key}.mcap", trial)
    known = np.all([~np.isnan(values).any(axis=1) for values in series.values()], axis=0)
    found = json.loads((folder / "diagnosis" / "diagnosis.json").read_text())["placements"][trial.placement]
    row = {key: real.measure(trial.check, values, trial.low_pass_hz, known) for key, values in series.items()}
    return row | {"name": name, "hz": 1 / np.median(np.diff(trial.fit.reference_s)), "causes": [cause["effect"] for cause in found["causes"]]}


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--cromosim", type=Path, required=True, help="the program to judge")
    parser.add_argument("--out", type=Path, required=True, help="where bags and diagnoses go")
    parser.add_argument("--every", type=int, default=10, help="which poses are kept")
    parser.add_argument("--trial", action="append", help="only this one (a part of its name is enough); may be given again")
    given = parser.parse_args()
    given.cromosim = given.cromosim.resolve()
    found = {name: how for name, how in real.trials(real.shared_data()).items() if not given.trial or any(part in name for part in given.trial)}
    if not found:
        print("skipped: no recordings; CROMOSIM_DATA names the folder that holds paired_broad and paired_gaitmap_foot")
        return
    print("| trial | poses a second | nominal | after | causes |\n|---|---|---|---|---|")
    for name, (how, file) in found.items():
        trial = how(file)
        trial = replace(trial, fit=thinned(trial.fit, given.every), check=thinned(trial.check, given.every))
        row = evaluate(name, trial, given)
        print(f"| {name} | {row['hz']:.1f} | {real.pair(row, 'nominal')} | {real.pair(row, 'after')} | {', '.join(row['causes'])} |", flush=True)


if __name__ == "__main__":
    main()
