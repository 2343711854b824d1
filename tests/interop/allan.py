"""Overlapping Allan deviations of the x axes of an EuRoC IMU table, by allantools."""
import sys

import allantools
import numpy as np

RATE_HZ = 50.0
rows = np.loadtxt(sys.argv[1], delimiter=",", skiprows=1)
factors = sorted({round(2 ** (k / 2)) for k in range(40)})
factors = [m for m in factors if m <= len(rows) // 5]
blocks = []
for column in (1, 4):
    values = rows[:, column] - rows[:, column].mean()
    taus, deviations, _, _ = allantools.oadev(values, rate=RATE_HZ, data_type="freq", taus=np.array(factors) / RATE_HZ)
    assert len(taus) == len(factors)
    variances = np.array(deviations) ** 2
    lines = []
    for k, (tau, deviation) in enumerate(zip(taus, deviations)):
        low, high = max(k - 2, 0), min(k + 2, len(taus) - 1)
        slope = np.log(variances[high] / variances[low]) / np.log(factors[high] / factors[low])
        alpha = 0 if slope < -0.5 else -1 if slope < 0.5 else -2
        degrees = allantools.edf_simple(len(rows) + 1, factors[k], alpha)
        # At slopes beside a limit rounding may decide.
        near = min(abs(slope + 0.5), abs(slope - 0.5)) < 1e-6
        lines.append(f"{tau:.17g} {deviation:.17g} {degrees:.17g}" + ("" if near else " same"))
    blocks.append("\n".join(lines))
print("\n\n".join(blocks))
