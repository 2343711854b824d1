#!/usr/bin/env python3
"""How much of the readings' motion the reference holds, by frequency: a second opinion on reference_smoothing, without undoing anything.

    python tests/withheld/attenuation.py RECORDING.mcap...
    python tests/withheld/attenuation.py --cases OUT/SUITE...       # of run.py: opens labels, says what would be found

A gyroscope's noise is small beside motion where a reference's, differentiated, is not. So the reference's angular velocity X (differences of
its poses, no filter) is regressed on the readings' Y rather than the other way round: g(f) = Re sum(X Y*) / sum |Y|^2, over windows and axes, is what
the reference keeps of the motion, whatever its own noise is. The best kernel is the one, with a cutoff and a factor on all frequencies
(units, scales), that g(f) is nearest to in units of its error by leaving out one window in turn. Limits: rotations alone; a bias, a delay, a
vibration and chords between slow frames are in g(f) as well; bands where the readings hardly stand above their quietest are left out."""
import argparse
import os

import numpy as np
from scipy.interpolate import CubicSpline
from scipy.spatial.transform import Rotation

import generate
import recording

EDGES = (0.25, 0.75, 1.25, 1.75, 2.25, 2.75, 3.25, 3.75, 4.5, 5.5, 6.5, 7.5, 8.5, 9.5, 11, 13, 15, 18, 22, 28)  # Hz
WINDOW = 4.0  # s
CUTOFFS = np.geomspace(0.8, 20, 120)  # Hz
LEAST_ERROR = 0.01  # part of the largest g, what windows of a few seconds leak
STANDS_OUT = 3.0  # times the amplitude of the quietest bands
LEAST_GAIN = 20.0  # squared errors by which a kernel is nearer than none
FASTEST = 13.0  # Hz
KERNELS = {"none": lambda f, c: np.ones_like(f), "gaussian": lambda f, c: 2 ** (-0.5 * (f / c) ** 2)}
KERNELS.update({f"butterworth {order}": lambda f, c, order=order: 1 / (1 + (f / c) ** (2 * order)) for order in (1, 2, 3, 4)})


def rates(item):
    """Angular velocity of the reference and of the readings on one grid, in the sensor's axes: spacing, X, Y."""
    stamps, _, quaternions = item["reference"]
    imu_stamps, gyro, _ = item["imu"]
    start = min(stamps[0], imu_stamps[0])
    times, imu_times = (stamps - start) * 1e-9, (imu_stamps - start) * 1e-9
    turns = Rotation.from_quat(quaternions)
    rate = (turns[:-1].inv() * turns[1:]).as_rotvec() / np.diff(times)[:, None]
    middles = 0.5 * (times[:-1] + times[1:])
    spacing = max(np.median(np.diff(times)), np.median(np.diff(imu_times)))
    grid = np.arange(max(middles[0], imu_times[0]) + 1, min(middles[-1], imu_times[-1]) - 1, spacing)

    def mean_around(at, values):
        """Means over the grid's spacing of what is denser, a spline through what is not."""
        if np.median(np.diff(at)) > 0.99 * spacing:
            return CubicSpline(at, values)(grid)
        steps = 0.5 * (values[1:] + values[:-1]) * np.diff(at)[:, None]
        integral = np.vstack([np.zeros(3), np.cumsum(steps, axis=0)])
        at_edges = [np.stack([np.interp(grid + side * spacing / 2, at, column) for column in integral.T], 1) for side in (-1, 1)]
        return (at_edges[1] - at_edges[0]) / spacing

    reference, readings = mean_around(middles, rate), mean_around(imu_times, gyro)
    left, _, right = np.linalg.svd(readings.T @ reference)
    turn = left @ np.diag([1, 1, np.linalg.det(left @ right)]) @ right
    return spacing, reference @ turn.T, readings


def windows(values, length):
    """Transforms of windows that overlap by half: window, frequency, axis."""
    shape = np.hanning(length)[:, None]
    starts = range(0, len(values) - length + 1, length // 2)
    return np.array([np.fft.rfft((values[k:k + length] - values[k:k + length].mean(0)) * shape, axis=0) for k in starts])


def attenuation(item):
    """Per band: its middle [Hz], g, the error of g, and the readings' amplitude."""
    spacing, reference, readings = rates(item)
    length = int(round(WINDOW / spacing))
    x, y = windows(reference, length), windows(readings, length)
    hz = np.fft.rfftfreq(length, spacing)
    rows = []
    for low, high in zip(EDGES[:-1], EDGES[1:]):
        band = (hz >= low) & (hz < high)
        if not band.any():
            continue
        both, own = (x[:, band] * y[:, band].conj()).real.sum((1, 2)), (abs(y[:, band]) ** 2).sum((1, 2))
        without = (both.sum() - both) / (own.sum() - own)
        error = np.sqrt((len(without) - 1) * np.var(without))
        rows.append((0.5 * (low + high), both.sum() / own.sum(), error, np.sqrt(own.sum() / len(own) / band.sum())))
    return np.array(rows)


def best_kernels(rows):
    """(misfit, kernel, cutoff, factor), the nearest first; misfits in squared errors. None where too few bands stand out."""
    hz, g, error, amplitude = rows.T
    used = (amplitude > STANDS_OUT * np.median(np.sort(amplitude)[:4])) & (hz > 0.4)
    if used.sum() < 4:
        return None
    hz, g = hz[used], g[used]
    weight = 1 / np.hypot(error[used], LEAST_ERROR * abs(g).max()) ** 2
    found = []
    for name, kernel in KERNELS.items():
        tried = []
        for cutoff in CUTOFFS:
            shape = kernel(hz, cutoff)
            factor = (weight * shape * g).sum() / (weight * shape**2).sum()
            tried.append(((weight * (g - factor * shape) ** 2).sum(), name, cutoff, factor))
        found.append(min(tried))
    return sorted(found)


def finding(kernels):
    """(kernel, cutoff) of a smoothing that is clear: much nearer than none, with a cutoff that motion reaches."""
    if kernels is None:
        return None
    misfit, name, cutoff, _ = kernels[0]
    without = next(own for own, kernel, _, _ in kernels if kernel == "none")
    return (name, cutoff) if without - misfit > LEAST_GAIN and cutoff < FASTEST else None


def of_cases(folders):
    """By what is hidden: in how many cases a smoothing is found."""
    counts = {}
    for out in folders:
        labels = generate.labels_folder(os.path.normpath(out))
        for case in sorted(os.listdir(out)):
            label = generate.read_label(labels, case)
            name = label["affected"] or next(iter(label["sessions"][0]))
            hidden = label["sessions"][0][name]["effects"] if label["affected"] else {}
            item = recording.read(generate.recordings(os.path.join(out, case), "fit")[0])[name]
            found = finding(best_kernels(attenuation(item)))
            kind = next((own for own in ("reference_smoothing", "reference_interpolation", "low_pass", "time_offset", "clock_drift", "vibration") if own in hidden), "none of these")
            count = counts.setdefault(kind, [0, 0])
            count[0] += found is not None
            count[1] += 1
            true = hidden.get("reference_smoothing", {}).get("cutoff_hz")
            if found or true:
                print(f"{case} {' '.join(hidden)}: {f'{found[0]} {found[1]:.2f} Hz' if found else 'nothing'}{f', true {true:.2f} Hz' if true else ''}")
    for kind, (found, count) in sorted(counts.items()):
        print(f"{kind}: {found} of {count}")


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("recordings", nargs="+", help="with --cases the folders of suites")
    parser.add_argument("--cases", action="store_true")
    options = parser.parse_args()
    if options.cases:
        return of_cases(options.recordings)
    for path in options.recordings:
        for name, item in recording.read(path).items():
            if not {"reference", "imu"} <= item.keys():
                continue
            rows = attenuation(item)
            print(f"{path}, {name}")
            for hz, g, error, amplitude in rows:
                print(f"  {hz:5.2f} Hz  {g:6.3f} +- {error:.3f}  {amplitude:.3g}")
            for misfit, kernel, cutoff, factor in best_kernels(rows) or ():
                print(f"  {kernel:13} {'' if kernel == 'none' else f'{cutoff:.2f} Hz':9} times {factor:.3f}: misfit {misfit:.1f}")


if __name__ == "__main__":
    main()
