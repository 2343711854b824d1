"""Checks of the fourth origin's own model, by other means than its code: differences, known solutions, known gains."""
import hashlib
import json

import numpy as np
import pytest
from scipy.integrate import solve_ivp
from scipy.signal import lfilter, cont2discrete
from scipy.spatial.transform import Rotation

import fourth_motions as motions
import fourth_origin as origin
import recording

G = 9.80665


def made(p_of_t, q_of_t, seconds=8.0):
    t = -2 + np.arange(int((seconds + 4) * motions.GRID)) / motions.GRID
    return motions.Path(t[0], p_of_t(t), q_of_t(t))


def resting(q=(0, 0, 0, 1.0)):
    return made(lambda t: np.zeros((len(t), 3)) + [1.0, 2.0, 0.5], lambda t: np.tile(q, (len(t), 1)).astype(float))


def lively(seed=3, seconds=12.0):
    name = "wrist"
    return motions.body("punches", np.random.default_rng(seed), 0.0, seconds, 0.012, {}, [name])[name]


def shaking(hz, size=0.01):
    return made(lambda t: np.stack([size * np.sin(2 * np.pi * hz * t), 0 * t, 0 * t], 1), lambda t: np.tile([0, 0, 0, 1.0], (len(t), 1)))


T = np.arange(0.5, 7.5, 0.01)


def test_rest_is_up_and_conventions():
    tilted = Rotation.from_rotvec([0.3, -0.2, 0.9])
    f, w = origin.analog(resting(tilted.as_quat()), T, {}, 0.0)
    assert np.allclose(tilted.apply(f), [0, 0, G], atol=1e-8) and np.allclose(w, 0, atol=1e-12)
    assert np.allclose(origin.analog(resting(), T, {"gravity_convention": {"mode": "removed"}}, 0.0)[0], 0, atol=1e-8)
    assert np.allclose(origin.analog(resting(), T, {"gravity_convention": {"mode": "negated"}}, 0.0)[0], [0, 0, -G], atol=1e-8)


@pytest.mark.parametrize("family", motions.FAMILIES)
def test_differences_of_the_pose_give_the_readings(family):
    name = motions.SEGMENTS[family][-1]
    path, h = motions.body(family, np.random.default_rng(8), 0.0, 6.0, 0.014, {}, [name])[name], 2e-4
    t = np.linspace(0.2, 5.8, 200)
    (p0, _, q0, *_), (p1, _, q1, *_), (p2, _, q2, *_) = (path.at(t + s) for s in (-h, 0, h))
    a = (p0 - 2 * p1 + p2) / h ** 2
    w = (Rotation.from_quat(q0).inv() * Rotation.from_quat(q2)).as_rotvec() / (2 * h)
    f, gyro = origin.analog(path, t, {}, 0.0)
    expected = Rotation.from_quat(q1).inv().apply(a + [0, 0, G])
    assert np.abs(f - expected).max() < 1e-3 * (1 + np.abs(expected).max()) and np.abs(gyro - w).max() < 1e-3 * (1 + np.abs(w).max())
    before, after = path.at(t - h)[3], path.at(t + h)[3]
    assert np.abs(path.at(t)[4] - (after - before) / (2 * h)).max() < 2e-3 * (1 + np.abs(path.at(t)[4]).max())


def test_lever_arm_is_another_point_of_the_body():
    path, offset, h = lively(), np.array([0.05, -0.03, 0.08]), 2e-4
    point = lambda t: path.at(t)[0] + Rotation.from_quat(path.at(t)[2]).apply(offset)
    a = (point(T - h) - 2 * point(T) + point(T + h)) / h ** 2
    f, _ = origin.analog(path, T, {"lever_arm": {"offset": offset}}, 0.0)
    assert np.abs(f - Rotation.from_quat(path.at(T)[2]).inv().apply(a + [0, 0, G])).max() < 2e-2


def test_mount_rotation_is_segment_from_sensor():
    mount = Rotation.from_rotvec([0, 0, np.pi / 2])  # sensor x lies along segment y
    tilted = Rotation.from_euler("x", 90, degrees=True)  # segment y points up
    f, _ = origin.analog(resting(tilted.as_quat()), T, {"mount_rotation": {"rotvec": mount.as_rotvec()}}, 0.0)
    assert np.allclose(f, [G, 0, 0], atol=1e-8)
    slip = {"mount_slip": {"at": 4.0, "rotvec": [0, 0, np.pi / 2]}}
    f, _ = origin.analog(resting(tilted.as_quat()), T, slip, 0.0)
    assert np.allclose(f[T < 3.99], [0, G, 0], atol=1e-8) and np.allclose(f[T > 4.01], [G, 0, 0], atol=1e-8)


def test_soft_tissue_without_rotation_is_the_linear_filter():
    path, wn, z = shaking(3.0), 2 * np.pi * 6.0, 0.2
    f, _ = origin.analog(path, T, {"soft_tissue": {"natural_hz": 6.0, "damping_ratio": z}}, 0.0)
    fine = np.arange(-0.5, 7.6, 1e-4)
    b, a, _ = cont2discrete(([2 * z * wn, wn ** 2], [1, 2 * z * wn, wn ** 2]), 1e-4, "bilinear")
    x = origin.analog(path, fine, {}, 0.0)[0][:, 0]
    late = T > 4
    assert np.abs(np.interp(T, fine, lfilter(np.ravel(b), a, x)) - f[:, 0])[late].max() < 5e-3 * np.abs(f[:, 0]).max()
    assert np.allclose(f[:, 2], G, atol=1e-6)


def test_soft_tissue_with_rotation_is_newton_in_the_world():
    """The mass written in world coordinates: m x'' = spring + damper forces + weight; no fictitious forces are needed."""
    path, wn, z = lively(5), 2 * np.pi * 7.0, 0.25
    start = 0.0

    def world(t, state):
        p, _, q, w, _ = (v[0] for v in path.at(np.array([t])))
        turn, h = Rotation.from_quat(q), 1e-4
        speed = (path.at(np.array([t + h]))[0][0] - path.at(np.array([t - h]))[0][0]) / (2 * h)
        d = turn.inv().apply(state[:3] - p)
        rate = turn.inv().apply(state[3:] - speed) - np.cross(w, d)
        return np.r_[state[3:], turn.apply(-wn ** 2 * d - 2 * z * wn * rate) + [0, 0, -G]]
    p, _, q, *_ = (v[0] for v in path.at(np.array([start])))
    solved = solve_ivp(world, (start, 3.0), np.r_[p, 0, 0, 0], max_step=2e-3, rtol=1e-6, atol=1e-9, dense_output=True)
    t = np.arange(2.0, 2.9, 0.02)
    force = np.array([world(s, solved.sol(s))[3:] for s in t]) + [0, 0, G]
    expected = Rotation.from_quat(path.at(t)[2]).inv().apply(force)
    f, _ = origin.analog(path, np.r_[0.9, t], {"soft_tissue": {"natural_hz": 7.0, "damping_ratio": z}}, 0.0)
    assert np.abs(f[1:] - expected).max() < 0.02 * np.abs(expected).max()


def test_low_pass_gain_and_lag_at_its_cutoff():
    hz = 5.0
    f, _ = origin.analog(shaking(hz), T, {"low_pass": {"cutoff_hz": hz}}, 0.0)
    late = T > 3
    basis = np.stack([np.sin(2 * np.pi * hz * T), np.cos(2 * np.pi * hz * T)], 1)[late]
    s, c = np.linalg.lstsq(basis, f[late, 0], rcond=None)[0]
    clean = -0.01 * (2 * np.pi * hz) ** 2
    assert abs(np.hypot(s, c) / abs(clean) - np.sqrt(0.5)) < 2e-3 and abs(c / -clean - np.sqrt(0.5)) < 5e-3  # 90 degrees late


def test_channel_delay_and_clock():
    path = lively()
    assert np.allclose(origin.analog(path, T, {"channel_delay": {"seconds": 0.01}}, 0.0)[1], origin.analog(path, T - 0.01, {}, 0.0)[1])
    fx, t0 = {"time_offset": {"seconds": 0.02}, "clock_drift": {"ppm": 300.0}}, 0.25
    t = origin.true_times(T, fx, t0)
    assert np.allclose(t0 + (t - t0) * (1 + 300e-6) + 0.02, T, atol=1e-12) and np.all(t < T)  # late stamps: the sample is older than it says


def test_digital_order():
    x, t = np.array([[1.0, 2.0, 3.0], [30.0, -40.0, 5.0]]), np.array([0.0, 10.0])
    fx = {"accel_scale": {"scale": [2, 1, 1]}, "accel_misalignment": {"upper": [0.1, 0.2, 0.3]}, "accel_bias": {"bias": [0.5, 0, 0]}, "accel_bias_drift": {"rate": [0, 0.01, 0]},
          "accel_saturation": {"limit": 20.0}, "accel_quantization": {"lsb": 0.25}, "accel_units": {"factor": 10.0}}
    first = [2 * (1 + 0.1 * 2 + 0.2 * 3) + 0.5, 2 + 0.3 * 3, 3.0]
    assert np.allclose(origin.digital(x, "accel", t, fx, 0.0), [[10 * round(v / 0.25) * 0.25 for v in first], [200.0, -200.0, 50.0]])
    noisy = origin.digital(np.zeros((200000, 3)), "gyro", np.zeros(200000), {"gyro_noise": {"density": 0.03}}, 0.0, 0.4, 100.0, np.random.default_rng(0))
    assert abs(noisy.std() - 0.5) < 0.005


def test_reference_smoothing_and_interpolation():
    hz, rate = 4.0, 200.0
    times = np.arange(-1.5, 9.0, 1 / rate)
    inside = (times > 1) & (times < 6)
    for cutoff, gain in ((hz, 0.5), (hz / 0.5, None), (hz * 10, 1.0)):
        p, _ = origin.report(shaking(hz), times, rate, {"reference_smoothing": {"cutoff_hz": cutoff}})
        basis = np.stack([np.sin(2 * np.pi * hz * times), np.cos(2 * np.pi * hz * times)], 1)[inside]
        s, c = np.linalg.lstsq(basis, p[inside, 0], rcond=None)[0] / 0.01
        assert abs(c) < 1e-3 and (gain is None or abs(s - gain) < 2e-3)  # zero phase; both passes: half the amplitude at the cutoff
    path = lively()
    fine = np.arange(0.0, 6.0, 1 / 240)
    p, q = origin.report(path, fine, 240.0, {"reference_interpolation": {"rate_hz": 20.0, "start": 0.0}})
    knots = slice(0, None, 12)
    assert np.allclose(p[knots], path.at(fine)[0][knots], atol=1e-9)
    bend = np.abs(p[:-2] - 2 * p[1:-1] + p[2:]).max(1)
    assert bend[np.arange(1, len(fine) - 1) % 12 != 0].max() < 1e-12 < bend.max()
    step = (Rotation.from_quat(q[:-1]).inv() * Rotation.from_quat(q[1:])).as_rotvec()[:240].reshape(20, 12, 3)
    assert np.allclose(step, step[:, :1], atol=1e-9)


def test_reference_noise_tilt_and_scale():
    path, rng = resting(Rotation.from_rotvec([0.2, 0.1, 0.7]).as_quat()), np.random.default_rng(1)
    times = np.arange(0, 9, 1e-3)
    noise = {"position": 2e-3, "rotation": 0.01, "correlation": 0.5}
    tilt = Rotation.from_rotvec([0.05, -0.02, 0])
    p, q = origin.report(path, times, 1000.0, {"reference_tilt": {"rotvec": tilt.as_rotvec()}, "reference_scale": {"factor": 1.1}}, noise, rng)
    assert np.allclose(p.mean(0), tilt.apply([1.1, 2.2, 0.55]), atol=2e-4) and np.allclose(p.std(0), 2e-3, rtol=0.1)
    off = ((tilt * Rotation.from_rotvec([0.2, 0.1, 0.7])).inv() * Rotation.from_quat(q)).as_rotvec()
    assert np.allclose(off.std(0), 0.01, rtol=0.1) and np.abs(off.mean(0)).max() < 1e-3


def test_dropping_keeps_the_first_and_the_fraction():
    keep = origin.lost_samples(np.random.default_rng(2), 20000, 0.1, 6.0)
    bursts = np.sum(np.diff(keep.astype(int)) < 0)
    assert keep[0] and abs(1 - keep.mean() - 0.1) < 0.005 and 4 < np.sum(~keep) / bursts < 8.5


def digest(folder):
    return {f.name: hashlib.sha256(f.read_bytes()).hexdigest() for f in sorted(folder.iterdir())}


def test_a_case_is_deterministic_and_a_quiet_placement_reproduces_itself(tmp_path):
    label = origin.build((tmp_path / "a", "fourth-none", 1, 0))
    again = origin.build((tmp_path / "b", "fourth-none", 1, 0))
    case = label["case"]
    assert label == again and digest(tmp_path / "a" / case) == digest(tmp_path / "b" / case) and len(case) == 10
    assert json.loads(json.dumps(label)) == label and label["affected"] is None
    (name, place), data = next(iter(label["placements"].items())), recording.read(tmp_path / "a" / case / "fit.mcap")
    stamps, gyro, accel = data[name]["imu"]
    times, p, q = data[name]["reference"]
    assert stamps[0] == place["epoch_ns"] and abs(np.median(np.diff(stamps)) * 1e-9 * place["imu_rate"] - 1) < 1e-3
    early, late = max(stamps[0], times[0]), min(stamps[-1], times[-1])
    chosen = (stamps > early + 1e8) & (stamps < late - 1e8)
    near = np.searchsorted(times, stamps[chosen])
    chosen_gyro = gyro[chosen][(times[near] - times[near - 1]) < 2.5e9 / label["nuisances"]["reference_rate"]]
    turns = Rotation.from_quat(q)
    speed = (turns[:-1].inv() * turns[1:]).as_rotvec() / np.diff(times)[:, None] * 1e9
    middle = (times[:-1] + times[1:]) / 2
    guess = np.stack([np.interp(stamps[chosen], middle, speed[:, i]) for i in range(3)], 1)
    assert chosen_gyro.shape[1] == 3 and np.median(np.abs(gyro[chosen] - guess)) < 0.05 + 4 * place["sigmas"][1] + 2 * label["nuisances"]["reference_noise"]["rotation"] * label["nuisances"]["reference_rate"]
    up = Rotation.from_quat(np.stack([np.interp(stamps[chosen], times, origin.continuous(q)[:, i]) for i in range(4)], 1)).apply(accel[chosen])
    assert np.allclose(np.median(up, axis=0), [0, 0, G], atol=0.6)
    check = recording.read(tmp_path / "a" / case / "check.mcap")[name]["imu"][0]
    whole = (check[0] - stamps[0]) * 1e-9 * place["imu_rate"]
    assert check[0] > stamps[-1] and abs(whole - round(whole)) < 1e-3  # the same clock goes on
    for kind, sigma in ((0, place["sigmas"][1]), (1, place["sigmas"][0])):
        stated = data[name]["variances"][kind]
        assert np.allclose(stated, sigma ** 2 if label["nuisances"]["declared"] else 0.0)


def test_the_names_are_the_tables():
    assert len(set(origin.EFFECTS)) == 35 and all(a in origin.EFFECTS for pair in origin.APART for a in pair)
    assert {origin.draw_hidden("fourth-single", None, i)[0] for i in range(35)} == set(origin.EFFECTS)
