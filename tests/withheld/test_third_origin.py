"""The third generator's measurement model against what is known by hand, and against integration by other means."""
import numpy as np
import pytest
from scipy import signal
from scipy.integrate import solve_ivp
from scipy.interpolate import CubicSpline
from scipy.spatial.transform import Rotation

import third_motions
from third_origin import G, device

T = np.arange(0, 3, 0.01)
KNOTS = np.arange(-1500, 2501) / 250.0
WN, Z = 2 * np.pi * 7, 0.2
TISSUE = {"soft_tissue": {"natural_hz": 7, "damping_ratio": Z}}


def test_rest():
    still = third_motions.Motion(KNOTS, np.zeros((len(KNOTS), 3)), Rotation.from_rotvec(np.tile([0.3, 0, 0], (len(KNOTS), 1))))
    w, f = device(still, T, {})
    assert f[100] == pytest.approx([0, 9.80665 * np.sin(0.3), 9.80665 * np.cos(0.3)], abs=1e-6)
    assert w[100] == pytest.approx([0, 0, 0], abs=1e-9)


@pytest.mark.parametrize("effects, expected", [
    ({}, [-16, 0, 9.80665]),
    ({"lever_arm": {"offset": [0.5, 0, 0]}}, [-24, 0, 9.80665]),
    ({"mount_rotation": {"rotvec": [0, 0, np.pi / 2]}}, [0, 16, 9.80665]),
])
def test_on_a_circle(effects, expected):
    spin = third_motions.Motion(KNOTS, np.stack([np.cos(4 * KNOTS), np.sin(4 * KNOTS), 0 * KNOTS], 1), Rotation.from_rotvec(4 * KNOTS[:, None] * np.array([0, 0, 1.0])))
    w, f = device(spin, T, effects)
    assert f[100] == pytest.approx(expected, abs=1e-3)
    assert w[100] == pytest.approx([0, 0, 4], abs=1e-5)


def test_tissue_without_rotation_is_the_filter():
    rng = np.random.default_rng(1)
    shake = third_motions.Motion(KNOTS, np.stack([third_motions.wander(rng, KNOTS, 0.5, 4, 0.02) for _ in range(3)], 1), Rotation.identity(len(KNOTS)))
    f = device(shake, T + 2, TISSUE)[1]
    grid = np.arange(-4000, 12000) / 2000
    x = device(shake, grid, {})[1]
    numerator, denominator, _ = signal.cont2discrete(([2 * Z * WN, WN ** 2], [1, 2 * Z * WN, WN ** 2]), 1 / 2000, method="foh")
    y = CubicSpline(grid, signal.lfilter(numerator.ravel(), denominator, x - x[0], axis=0) + x[0])(T + 2)
    assert np.abs(f - y).max() < 1e-3


def test_tissue_that_turns_is_integrated():
    motion = third_motions.make(np.random.default_rng(3), "dance", "wrist", 0, 8)
    times = np.arange(3, 6, 0.01)
    found = device(motion, times, TISSUE)[1]

    def slope(s, y):
        a, rotation, w, alpha = motion.full(np.array([s]))
        d, v = y[:3], y[3:]
        force = rotation.inv().apply(a - G)[0]
        return np.concatenate([v, -WN ** 2 * d - 2 * Z * WN * v - force - 2 * np.cross(w[0], v) - np.cross(alpha[0], d) - np.cross(w[0], np.cross(w[0], d))])
    a, rotation, _, _ = motion.full(np.array([2.0]))
    start = np.concatenate([-rotation.inv().apply(a - G)[0] / WN ** 2, np.zeros(3)])
    other = solve_ivp(slope, (2.0, 6), start, t_eval=times, rtol=1e-8, atol=1e-10).y.T
    assert np.abs(found + WN ** 2 * other[:, :3] + 2 * Z * WN * other[:, 3:]).max() < 1e-5


def test_turns_are_derivatives():
    motion, h = third_motions.make(np.random.default_rng(3), "dance", "wrist", 0, 8), 1e-4
    times = np.arange(3, 6, 0.01)
    before, after = motion.pose(times - h)[1], motion.pose(times + h)[1]
    _, _, w, alpha = motion.full(times)
    assert np.abs((before.inv() * after).as_rotvec() / 2 / h - w).max() < 1e-5
    assert np.abs((motion.full(times + h)[2] - motion.full(times - h)[2]) / 2 / h - alpha).max() < 1e-3
