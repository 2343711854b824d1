"""The parts of the model that are more than a line of arithmetic, against the contract's own equations. By hand: pytest tests/withheld."""
import numpy as np
import pytest
from scipy.integrate import solve_ivp
from scipy.spatial.transform import Rotation

import effects as library
import generate
import grade
import model
import motions


def some_motion(seconds=4.0):
    rng = np.random.default_rng(5)
    return motions.synthetic(rng, {**motions.synthetic_kind(rng), "limb": "wrist", "vigour": 1.3, "bursts": False}, 0.0, seconds)


def test_soft_tissue_is_the_equation_of_the_turning_frame():
    motion, hz, ratio, step = some_motion(), 6.0, 0.25, 1 / 2000
    times = np.arange(0.2, 3.0, step)
    force, rate = model.segment_values(motion, times, {}, step)
    said = model.segment_values(motion, times, {"soft_tissue": {"natural_hz": hz, "damping_ratio": ratio}}, step)[0]
    natural = 2 * np.pi * hz

    def slope(time, state):
        rotation, acceleration, turning, change = motion.kinematics(np.array([time]))
        f, w, a = (rotation.apply(x, inverse=True)[0] for x in (acceleration - model.GRAVITY, turning, change))
        d, v = state[:3], state[3:]
        return np.concatenate([v, -natural**2 * d - 2 * ratio * natural * v - f - 2 * np.cross(w, v) - np.cross(a, d) - np.cross(w, np.cross(w, d))])

    start = np.concatenate([-force[0] / natural**2, np.zeros(3)])
    at = times[2000::100]
    state = solve_ivp(slope, (times[0], at[-1]), start, t_eval=at, rtol=1e-9, atol=1e-11).y
    reading = -(natural**2 * state[:3] + 2 * ratio * natural * state[3:]).T
    assert np.abs(said[2000::100] - reading).max() < 5e-4  # what is left is the start, at rest in other axes
    alone = model._second_order(force, step, natural, 2 * ratio * natural, 2 * ratio * natural)
    assert np.abs(alone[2000::100] - reading).max() > 0.1  # the turning is what makes it more than a filter


def test_a_late_gyroscope_reads_what_was():
    motion, times = some_motion(8.0), np.arange(3.5, 6.0, 0.01)
    now = model.inner_stages(motion, times, 3.5, {})
    for seconds in (0.012, -0.0074):
        late = model.inner_stages(motion, times, 3.5, {"channel_delay": {"seconds": seconds}})
        assert np.array_equal(late[0], now[0])
        assert np.abs(late[1] - model.inner_stages(motion, times - seconds, 3.5, {})[1]).max() < 1e-6


def test_pieces_join():
    motion, times = some_motion(12.0), np.arange(3.5, 11.0, 0.01)
    effects = {"soft_tissue": {"natural_hz": 7.0, "damping_ratio": 0.3}, "low_pass": {"cutoff_hz": 9.0}, "channel_delay": {"seconds": 0.01}}
    whole, usual = model.inner_stages(motion, times, 3.5, effects), model.PIECE
    try:
        model.PIECE = 3.1
        pieces = model.inner_stages(motion, times, 3.5, effects)
    finally:
        model.PIECE = usual
    assert max(np.abs(a - b).max() for a, b in zip(whole, pieces)) < 1e-6


def test_interpolation_leaves_chords():
    motion, times = some_motion(), np.arange(0.5, 3.0, 0.005)
    filtering = {"noise_first": False, "kernel": "gaussian", "frame_phase": 0.25}
    position, rotation = model.reference(np.random.default_rng(0), motion, times, {"reference_interpolation": {"rate_hz": 20.0}}, (0.0, 0.0), filtering)
    bent = np.linalg.norm(np.diff(position, 2, axis=0), axis=1) > 1e-9
    assert 0.15 < bent.mean() < 0.25  # one frame in ten samples bends two of the second differences
    assert (rotation.inv() * motion.pose(times)[1]).magnitude().max() < 0.03


def test_units_come_last():
    motion, times = some_motion(), np.arange(0.5, 3.0, 0.005)
    filtering = {"noise_first": False, "kernel": "gaussian", "frame_phase": 0.0}
    metres, millimetres = (model.reference(np.random.default_rng(0), motion, times, effects, (1e-4, 1e-3), filtering)[0]
                           for effects in ({}, {"reference_units": {"factor": 1000.0}}))
    assert np.allclose(millimetres, 1000 * metres)


def test_a_sign_is_half_a_turn():
    true = {"hz": 20.0, "amplitude": [1.0, -2.0, 0.5], "phase": [0.1, 0.2, 6.2], "gyro_amplitude": [0.0] * 3, "gyro_phase": [0.0] * 3}
    said = {"hz": 20.0, "amplitude": [-1.0, 2.0, 0.5], "phase": [0.1 + np.pi, 0.2 - np.pi, -0.08], "gyro_amplitude": [0.0] * 3, "gyro_phase": [1.0] * 3}
    errors = {"hz": 0.1, "amplitude": [0.1] * 3, "phase": [0.1] * 3, "gyro_amplitude": [0.1] * 3, "gyro_phase": [9.0] * 3}
    result = grade.compare("vibration", true, said, errors)
    assert (result["inside"], result["scalars"]) == (10, 10)


def test_the_session_graded_is_that_of_the_answer_not_one_of_the_others_beside_it(tmp_path):
    label = {"sessions": [{"wrist": {"epoch_ns": epoch * 1_000_000_000}} for epoch in (1_700_000_000, 1_700_100_000, 1_700_200_000)]}
    said = tmp_path / "effects.yaml"
    said.write_text("placements:\n  wrist:\n    epoch: 1700100000.5\n    other_sessions:\n      - epoch: 1700000000.1\n")
    assert grade.session_of(label, said) == 1
    assert grade.session_of(label, tmp_path / "missing.yaml") == 2


def test_every_effect_draws_at_every_strength():
    rng = np.random.default_rng(0)
    context = {"sigmas": (0.014, 0.0012), "rate": 100.0, "reference_rate": 120.0, "start": 0.5, "seconds": 60.0}
    for effect in library.ALL:
        for level in range(3):
            assert library.draw(rng, effect, level, context)
    assert set(library.SESSION) < set(library.ALL)
    assert not set(generate.SUITES) & set(library.ALL)


def test_a_mass_on_springs_in_the_engine_is_the_formula():
    mechanics = pytest.importorskip("mechanics")
    rng = np.random.default_rng(3)
    parts, hidden = mechanics.parts_of(rng, "flesh", 2)
    (accel, size), (gyro, _) = mechanics.Device(rng, parts, hidden, mechanics.run(rng, "arm", parts)).verify()
    assert accel < 1e-4 * size and gyro < 1e-4
