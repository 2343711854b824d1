#!/usr/bin/env python3
"""Probabilities from margins: fits the log-odds of `calibrate` in nodes/lib/gap/src/probability.rs to graded answers of some origins, and tests
what the answers of others say.

    python tests/withheld/calibrate.py --fit /tmp/building /tmp/injected --test /tmp/scoring /tmp/mechanics

Each folder is one that run.py or inject.py has filled; of several to test there is a table of all, too."""
import argparse
import json
import os

import numpy as np
from scipy.optimize import minimize

POOR_REFERENCES = {"reference_noise", "reference_smoothing", "reference_interpolation"}
CALIBRATIONS = {"time_offset", "mount_rotation", "lever_arm", "accel_bias", "gyro_bias"}
NAMES = ("base", "share", "others", "poor_reference", "takes_up_unknown", "margin")
BINS = (0.0, 0.5, 0.7, 0.8, 0.9, 0.95, 0.98, 0.99, 1.0001)
SURE_ODDS = np.log(0.95 / 0.05)


def causes(folder):
    """(effect, right, said, by margin, share, beside) of every cause in a folder that can be judged."""
    return of_real(folder) if os.path.exists(os.path.join(folder, "injected.json")) else of_generated(folder)


def judged(said, right):
    named = {cause["effect"] for cause in said}
    for cause in said:
        yield (cause["effect"], right(cause["effect"]), cause["probability"], cause.get("probability_by_margin", cause["probability"]), cause["gap_share"], named - {cause["effect"]})


def of_real(folder):
    """In a folder of inject.py: the causes that the window did not have before; right is what was put in."""
    with open(os.path.join(folder, "injected.json")) as stream:
        records = json.load(stream)
    for record in records:
        if "named" not in record:
            continue
        with open(os.path.join(folder, f"{record['index']:03d}", "hidden", "diagnosis.json")) as stream:
            placements = json.load(stream)["placements"]
        for placement in placements.values():
            for cause in judged(placement["causes"], lambda effect: effect == record["effect"]):
                if cause[0] not in record["base"]:
                    yield cause


def of_generated(folder):
    """In a folder of run.py."""
    with open(os.path.join(folder, "grades.json")) as stream:
        records = json.load(stream)
    for record in records:
        path = os.path.join(folder, f"{record['suite']}-results", record["case"], "diagnosis.json")
        if not os.path.exists(path):
            continue
        with open(path) as stream:
            placements = json.load(stream)["placements"]
        for name, graded in record["placements"].items():
            said = placements.get(name, {"causes": []})["causes"]
            yield from judged(said, lambda effect: effect in graded["hidden"])


def regressors(cause):
    effect, _, _, by_margin, share, beside = cause
    most = 0.95 if effect != "unknown" else 0.9999
    by_margin = min(max(by_margin, 1e-4), most)
    # Where the library knows all that was done, a fourth cause is often wrong, and so is a small `unknown` beside others; on real recordings
    # hardly ever. What only the generator makes so does not count.
    others, poor = (min(len(beside), 2), bool(beside & POOR_REFERENCES)) if effect != "unknown" else (0, False)
    # What nobody knows is taken up by calibrations.
    takes_up = effect in CALIBRATIONS and "unknown" in beside
    return [1.0, np.log10(max(share, 1e-5 if effect != "unknown" else 1e-2)), others, float(poor), float(takes_up), np.log(by_margin / (1 - by_margin)) - SURE_ODDS]


def fitted(chosen):
    """Logistic regression with a weak prior on all but the base."""
    x, y = np.array([regressors(cause) for cause in chosen]), np.array([cause[1] for cause in chosen], float)

    def cost(weights):
        odds = x @ weights
        return np.sum(np.logaddexp(0, -odds) * y + np.logaddexp(0, odds) * (1 - y)) + 0.5 * np.sum(weights[1:] ** 2)
    return minimize(cost, np.zeros(x.shape[1])).x


def log_odds(cause):
    said = min(max(cause[2], 1e-6), 1 - 1e-9)
    return np.log(said / (1 - said))


def rescaled(chosen):
    """(a, b) of the log-odds `a said + b`, with a weak prior on a of 1: two numbers where few answers are wrong. What is said stays in its order,
    so what is named can stay as it is."""
    x, y = np.array([log_odds(cause) for cause in chosen]), np.array([cause[1] for cause in chosen], float)

    def cost(line):
        odds = line[0] * x + line[1]
        return np.sum(np.logaddexp(0, -odds) * y + np.logaddexp(0, odds) * (1 - y)) + 2 * (line[0] - 1) ** 2
    return minimize(cost, np.array([1.0, 0.0])).x


def table(title, said, right):
    print(f"\n{title}\n\n| said probability | mean said | right | n |\n|---|---|---|---|")
    error = 0.0
    for low, high in zip(BINS, BINS[1:]):
        inside = (said >= low) & (said < high)
        if inside.any():
            error += inside.mean() * abs(said[inside].mean() - right[inside].mean())
            print(f"| {low:.2f}–{min(high, 1.0):.2f} | {said[inside].mean():.3f} | {right[inside].mean():.3f} | {inside.sum()} |")
        else:
            print(f"| {low:.2f}–{min(high, 1.0):.2f} | – | – | 0 |")
    brier = np.mean((said - right) ** 2)
    print(f"\nBrier score {brier:.4f} ({right.mean() * (1 - right.mean()):.4f} for always saying {right.mean():.3f}); expected calibration error {error:.4f}; {len(right)} causes.")


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--fit", nargs="*", default=[], metavar="FOLDER")
    parser.add_argument("--test", nargs="*", default=[], metavar="FOLDER")
    options = parser.parse_args()
    building = [cause for folder in options.fit for cause in causes(folder)]
    weights, lines = {}, {}
    for kind, is_unknown in (("NAMED", False), ("OF_UNKNOWN", True)):
        chosen = [cause for cause in building if (cause[0] == "unknown") == is_unknown]
        if chosen:
            weights[is_unknown] = fitted(chosen)
            lines[is_unknown] = rescaled(chosen)
            print(kind, "rescaled: {:.3f} times the log-odds as said, plus {:.3f}".format(*lines[is_unknown]))
            print(kind, {name: round(float(weight), 2) for name, weight in zip(NAMES, weights[is_unknown])}, f"{len(chosen)} causes, {sum(not cause[1] for cause in chosen)} wrong")
    tests = {folder: list(causes(folder)) for folder in options.test}
    if len(tests) > 1:
        tests["all of these"] = [cause for tested in tests.values() for cause in tested]
    for name, tested in tests.items():
        if not tested:
            print(f"\n{name}: no causes")
            continue
        right = np.array([cause[1] for cause in tested], float)
        table(f"{name}: as said", np.array([cause[2] for cause in tested]), right)
        table(f"{name}: by the margin alone", np.array([cause[3] for cause in tested]), right)
        if len(weights) == 2:
            odds = np.array([lines[cause[0] == "unknown"] @ [log_odds(cause), 1.0] for cause in tested])
            table(f"{name}: rescaled", 1 / (1 + np.exp(-odds)), right)
            odds = np.array([regressors(cause) @ weights[cause[0] == "unknown"] for cause in tested])
            table(f"{name}: by this fit", 1 / (1 + np.exp(-odds)), right)


if __name__ == "__main__":
    main()
