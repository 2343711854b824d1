"""Quick checks of the fifth origin's physics and files."""
import json
import os

import numpy as np
import pytest
from scipy.integrate import solve_ivp
from scipy.spatial.transform import Rotation

import fifth_motions as motions
import fifth_origin as origin
import recording
from fifth_physics import G, Stage, analog, back, readings

STAMPS = np.arange(0, 4, 0.01)


def _stage(joints):
    return Stage(joints, 0.0, 4.0, 100.0, 0.0)


def test_still_and_level_reads_gravity_up():
    stage = _stage([motions.offset(1.0, 2.0, 3.0)])
    f, w = readings(stage, {}, STAMPS)
    assert np.allclose(f, [0, 0, 9.80665]) and np.allclose(w, 0)
    assert np.allclose(readings(stage, {"gravity_convention": {"mode": "removed"}}, STAMPS)[0], 0)
    assert np.allclose(readings(stage, {"gravity_convention": {"mode": "negated"}}, STAMPS)[0], [0, 0, -G])
    for effect in ({"soft_tissue": {"natural_hz": 8.0, "damping_ratio": 0.3}}, {"low_pass": {"cutoff_hz": 10.0}}):
        assert np.allclose(readings(stage, effect, STAMPS)[0], [0, 0, G], atol=1e-6)


def test_circle():
    f, w = readings(_stage([motions.turn("z", motions.line(2.0)), motions.offset(0.5, 0, 0)]), {}, STAMPS)
    assert np.allclose(f, [-0.5 * 4, 0, G]) and np.allclose(w, [0, 0, 2.0])


@pytest.mark.parametrize("family", motions.FAMILIES)
def test_states_are_derivatives(family):
    joints = motions.FAMILIES[family](np.random.default_rng(5), 4.0)
    t, h = np.arange(0, 4, 0.007), 1e-4
    (p0, R0, *_, w0, _), (p, R, a, w, alpha), (p1, R1, *_, w1, _) = (motions.state(joints, t + s) for s in (-h, 0, h))
    assert np.allclose((p0 - 2 * p + p1) / h ** 2, a, atol=0.01 + 2e-3 * np.abs(a).max())
    assert np.allclose(Rotation.from_matrix(R0.transpose(0, 2, 1) @ R1).as_rotvec() / (2 * h), w, atol=1e-3)
    assert np.allclose((w1 - w0) / (2 * h), alpha, atol=1e-2 + 1e-3 * np.abs(alpha).max())


def test_lever_arm_is_a_point_of_the_body():
    joints, arm = motions.swimming(np.random.default_rng(2), 4.0), [0.1, -0.05, 0.2]
    there = readings(_stage(joints + [motions.offset(*arm)]), {}, STAMPS)
    assert np.allclose(readings(_stage(joints), {"lever_arm": {"offset": arm}}, STAMPS)[0], there[0], atol=1e-6)


def test_mount_axes():
    joints, turned = motions.curls(np.random.default_rng(2), 4.0), [0.3, -0.2, 0.5]
    there = readings(_stage(joints + [motions.fixed(turned)]), {}, STAMPS)
    here = readings(_stage(joints), {"mount_rotation": {"rotvec": turned}}, STAMPS)
    assert np.allclose(here[0], there[0]) and np.allclose(here[1], there[1])


def test_soft_tissue_obeys_its_equation():
    stage = _stage(motions.figure_eight(np.random.default_rng(3), 4.0))
    wn, z = 2 * np.pi * 8.0, 0.3
    bare = back(stage.R, stage.a + [0, 0, G])
    soft = analog(stage, {"soft_tissue": {"natural_hz": 8.0, "damping_ratio": z}})[0]

    def slope(t, x):
        k = np.array([np.interp(t, stage.time, row) for row in np.hstack([bare, stage.w, stage.alpha]).T])
        f, w, alpha, d, v = k[:3], k[3:6], k[6:], x[:3], x[3:]
        return np.concatenate([v, -wn * wn * d - 2 * z * wn * v - f - 2 * np.cross(w, v) - np.cross(alpha, d) - np.cross(w, np.cross(w, d))])
    at = stage.time[stage.time < 0.5]
    x = solve_ivp(slope, (at[0], at[-1]), np.concatenate([-bare[0] / wn ** 2, np.zeros(3)]), t_eval=at, rtol=1e-7, atol=1e-9, max_step=0.01).y.T
    expected = -(wn * wn * x[:, :3] + 2 * z * wn * x[:, 3:])
    assert np.abs(expected - soft[:len(at)])[at > -1.0].max() < 0.02 * np.abs(bare).max()
    assert np.sqrt(((expected - soft[:len(at)])[at > -1.0] ** 2).mean()) < 2e-3 * G


def test_clock():
    stage = _stage([motions.turn("z", motions.sines([1.0], [1.0], [0.0]))])
    late = readings(stage, {"time_offset": {"seconds": 0.05}, "clock_drift": {"ppm": 1000.0}}, STAMPS)[1]
    assert np.allclose(late[:, 2], 2 * np.pi * np.cos(2 * np.pi * (STAMPS - 0.05) / 1.001), atol=1e-6)


@pytest.mark.parametrize("suite,index", [("fifth-single", 7), ("fifth-placement", 0)])
def test_files_read_back(tmp_path, suite, index):
    label = json.loads(json.dumps(origin.build((str(tmp_path), suite, 1, index))))
    fit, check = (recording.read(os.path.join(tmp_path, label["case"], name)) for name in ("fit.mcap", "check.mcap"))
    assert set(fit) == set(check) == set(label["placements"])
    for name, own in label["placements"].items():
        assert fit[name]["imu"][0][0] == own["epoch_ns"] and check[name]["imu"][0][0] > fit[name]["imu"][0][-1]
        for item in (fit[name], check[name]):
            assert item["reference"][0][0] + 1e9 <= item["imu"][0][0] and item["reference"][0][-1] - 1e9 >= item["imu"][0][-1]
            assert all(np.isfinite(x).all() for x in item["imu"] + item["reference"])
            assert np.allclose(np.linalg.norm(item["reference"][2], axis=1), 1)


@pytest.mark.parametrize("effect,values", [("reference_units", {"factor": 1000.0}), ("reference_scale", {"factor": 1.1}), ("reference_tilt", {"rotvec": [0.1, 0.0, 0.0]})])
def test_reference_effects_leave_the_device_alone(effect, values):
    stage = _stage(motions.curls(np.random.default_rng(2), 4.0))
    c = {"effects": {effect: values}, "sigmas": [0.0, 0.0], "rate": 100.0}
    _, gyro, accel = origin._imu(np.random.default_rng(1), c, stage, STAMPS)
    assert np.allclose(accel, readings(stage, {}, STAMPS)[0]) and np.allclose(gyro, readings(stage, {}, STAMPS)[1])


def test_a_later_motion_is_one_that_the_tissue_stands(tmp_path):
    """The first motion drawn for this case's second recording moves the sensor farther on its tissue than tissue goes."""
    index = origin.EFFECTS.index("soft_tissue")
    assert origin.build((str(tmp_path), "fifth-single", 1037, index)) is not None
    assert len(list(tmp_path.glob("*/check.mcap"))) == 1
