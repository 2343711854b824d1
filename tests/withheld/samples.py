#!/usr/bin/env python3
"""Holds this model against recordings that others wrote: the labelled effects, applied to the recording's own reference, against its real IMU.

    python tests/withheld/samples.py CASES        # CASES/NAME/{fit,check}.mcap, CASES/labels/NAME.json

A row a recording and placement: what is left with the labelled effects, what the device's noise and the reference's own noise (carried through
the same smoothing and derivatives) leave at least, and what is left without the effects. The first two agree where both sides read the contract alike."""
import argparse
import json
import os
from math import comb

import numpy as np
from scipy.interpolate import make_interp_spline
from scipy.optimize import lsq_linear
from scipy.signal import butter, sosfiltfilt
from scipy.sparse import csr_matrix

import model
import motions
import recording

CUTOFF = 8.0  # Hz: the references' noise is gone beyond, their motions (up to some 5 Hz) are whole
OFF_ENDS = 1.5  # s: the smoothing's edges, and the rest that the motion is given before it begins
REFERENCE_RATE = 400.0  # Hz of the grid on which the reference is smoothed


def true_reference(stamps, position, quaternion, effects):
    """Undoes units and interpolation: frames that, joined by chords, come nearest to what is reported."""
    position = position / effects.get("reference_units", {}).get("factor", 1.0)
    values = np.hstack([position, motions.continuous(quaternion)])
    if "reference_interpolation" not in effects:
        return stamps, values
    place = (stamps - stamps[0]) * effects["reference_interpolation"]["rate_hz"]
    index = np.minimum(place.astype(int), int(place[-1]))
    rows, share = np.arange(len(stamps)), place - index
    hats = csr_matrix((np.hstack([1 - share, share]), (np.hstack([rows, rows]), np.hstack([index, index + 1]))))
    frames = np.stack([lsq_linear(hats, column, lsmr_tol=1e-12).x for column in values.T], axis=1)[:-1]
    return stamps[0] + np.arange(len(frames)) / effects["reference_interpolation"]["rate_hz"], frames


def smoothed(stamps, values):
    """The motion of a reference: evenly spaced, without what is beyond CUTOFF, at rest outside of what was recorded."""
    grid = np.arange(stamps[0], stamps[-1], 1 / REFERENCE_RATE)
    even = make_interp_spline(stamps, values, k=5)(grid)
    even = sosfiltfilt(butter(4, CUTOFF / (REFERENCE_RATE / 2), output="sos"), even, axis=0)
    pad = int(motions.MARGIN * REFERENCE_RATE)
    return motions.Motion(grid[0] - motions.MARGIN, *np.split(np.pad(even, ((pad, pad), (0, 0)), mode="edge")[:, [0, 1, 2, 6, 3, 4, 5]], [3], axis=1), REFERENCE_RATE)


def white(values, order=8):
    """Standard deviation of the white part, by differences of high order."""
    return np.sqrt(np.mean(np.diff(values, order, axis=0) ** 2) / sum(comb(order, k) ** 2 for k in range(order + 1)))


def floor(rng, stamps, values, true, t0, effects):
    """Root mean square of what the reference's noise does to the two channels: the same again with as much noise added."""
    # of a quaternion's four parts the noise of a rotation has but three; the fourth is lost where the length is made one again
    sigmas = np.repeat([white(values[:, :3]), white(values[:, 3:]) * np.sqrt(4 / 3)], [3, 4])
    with_noise = values + sigmas * rng.standard_normal(values.shape)
    return [a - b for a, b in zip(model.inner_stages(smoothed(stamps, with_noise), true, t0, effects), model.inner_stages(smoothed(stamps, values), true, t0, effects))]


def rms(values):
    return float(np.sqrt(np.mean(np.sum(values**2, axis=1))))


def compare(item, base, t0, effects):
    """Drift of the reference, left, at least and without: of accel, then of gyro. base: the whole second [ns] that the labels' epochs count from."""
    imu, gyro, accel = item["imu"]
    stamps = (imu - base) * 1e-9
    reference_stamps = (item["reference"][0] - base) * 1e-9
    at, values = true_reference(reference_stamps, *item["reference"][1:], effects)
    true = model.true_times(stamps, t0, effects)
    usable = (true > reference_stamps[0] + OFF_ENDS) & (true < reference_stamps[-1] - OFF_ENDS)
    naive = true_reference(reference_stamps, *item["reference"][1:], {})
    noise = floor(np.random.default_rng(0), at, values, true, t0, effects)
    out = []
    for index, own in enumerate((accel, gyro)):
        drift = clock_drift(smoothed(at, values), true, usable, t0, effects, own, index)
        straight = lambda given: at[0] + (given - at[0]) * (1 - drift)
        said = model.inner_stages(smoothed(at, values), straight(true), t0, effects)[index]
        nothing = model.inner_stages(smoothed(*naive), straight(stamps), t0, {})[index]
        least = float(np.hypot(rms(noise[index][usable]), np.sqrt(np.sum(item["variances"][1 - index]))))
        out += [f"{drift * 1e6:.1f}"] + [f"{value:.4f}" for value in (rms((own - said)[usable]), least, rms((own - nothing)[usable]))]
    return out


def clock_drift(motion, true, usable, t0, effects, own, index):
    """By how much the IMU's clock runs fast against the reference's, as one channel sees it: up to some 25 ppm, anew from each recording's start,
    is in all samples, labelled in none, and so ordinary. (The sample of channel_delay has it in the accelerometer alone.)"""
    step = 1e-3
    said, earlier = (model.inner_stages(motion, times, t0, effects)[index] for times in (true, true - step))
    by_drift = (earlier - said) / step * (true - true[0])[:, None]
    return float(np.sum((own - said)[usable] * by_drift[usable]) / np.sum(by_drift[usable] ** 2))


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("cases")
    folder = parser.parse_args().cases
    print("| recording | accel: drift [ppm] | left | at least | without | gyro: drift | left | at least | without |\n|---|---|---|---|---|---|---|---|---|")
    for name in sorted(os.listdir(os.path.join(folder, "labels"))):
        with open(os.path.join(folder, "labels", name)) as stream:
            label = json.load(stream)
        case = name.removesuffix(".json")
        files = {file: recording.read(os.path.join(folder, case, f"{file}.mcap")) for file in ("fit", "check")}
        base = min(int(item["reference"][0][0]) for item in files["fit"].values()) // 1_000_000_000 * 1_000_000_000
        for file, placements in files.items():
            for place, item in sorted(placements.items()):
                results = compare(item, base, label["epoch"], label["effects"] if place == label["affected"] else {})
                print(f"| {case} {file} {place} | {' | '.join(results)} |", flush=True)


if __name__ == "__main__":
    main()
