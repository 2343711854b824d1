"""What the package simulates is what the command line simulates, bit for bit."""

import json
import multiprocessing
import pickle
import subprocess
import sys
import threading
import time

import numpy as np
import pytest

import cromosim
from cromosim import Placement

from conftest import ROOT

PLACEMENTS = {
    "left_wrist": Placement(site="left_watch"),
    "pocket": Placement(
        point=[0.17, -0.42, 0.07],
        skin_distance=0.01,
        mount={"rotvec": [0, 0, 1.5708]},
        follow="segment",
    ),
    "shin": Placement(
        triangle=1958, barycentrics=[0.7, 0.2, 0.1], rate_hz=200, scheme="richardson", device="ideal"
    ),
}
YAML = """
schema: cromosim/placements/1
defaults: {rate_hz: 100, device: consumer_mems}
placements:
  left_wrist: {site: left_watch}
  pocket: {point: [0.17, -0.42, 0.07], skin_distance: 0.01, mount: {rotvec: [0, 0, 1.5708]}, follow: segment}
  shin: {triangle: 1958, barycentrics: [0.7, 0.2, 0.1], rate_hz: 200, scheme: richardson, device: ideal}
"""




def assert_same_bytes(readings, path):
    """Stamps and values are those of the file to the last bit: Rust prints what reads back as itself."""
    rows = np.loadtxt(path, delimiter=",", skiprows=1, dtype=str)
    assert (rows[:, 0].astype(np.int64) == readings.stamps_ns).all()
    values = rows[:, 1:].astype(np.float64)
    assert values[:, :4].tobytes() == np.ascontiguousarray(readings.orientation).tobytes()
    assert values[:, 4:7].tobytes() == np.ascontiguousarray(readings.angular_velocity).tobytes()
    assert values[:, 7:].tobytes() == np.ascontiguousarray(readings.specific_force).tobytes()


@pytest.mark.parametrize(
    ("options", "given"),
    [
        ([], {}),
        (["--seed", "7"], {"seed": 7}),
        (["--scheme", "spline", "--no-noise"], {"scheme": "spline", "noise": False}),
        (["--bandwidth", "8", "--trim", "0.5"], {"bandwidth_hz": 8, "trim_s": 0.5}),
        (["--start", "2", "--duration", "3"], {}),
        (["--learned", "motion_capture"], {"learned": "motion_capture"}),
    ],
)
def test_values_are_the_command_lines(tmp_path, command_line, options, given):
    walk = tmp_path / "walk.bvh"
    command_line("convert", ROOT / "bags/walk", walk)
    (tmp_path / "sensors.yaml").write_text(YAML, encoding="utf-8")
    command_line(
        "simulate", walk, "--placements", tmp_path / "sensors.yaml",
        "--out", tmp_path / "walk.mcap", "--csv", tmp_path, *options,
    )  # fmt: skip
    part = {"start_s": 2, "duration_s": 3} if "--start" in options else {}
    motion = cromosim.read_motion(walk, **part)
    imus = cromosim.simulate(motion, PLACEMENTS, rate_hz=100, device="consumer_mems", **given)
    assert list(imus) == list(PLACEMENTS)
    for name, readings in imus.items():
        assert len(readings) > 100
        assert_same_bytes(readings, tmp_path / f"walk_{name}.csv")


def test_seeds_differ_and_repeat():
    motion = cromosim.walk()
    one = cromosim.simulate(motion, PLACEMENTS, device="consumer_mems", seed=1)
    again = cromosim.simulate(motion, PLACEMENTS, device="consumer_mems", seed=1)
    other = cromosim.simulate(motion, PLACEMENTS, device="consumer_mems", seed=2)
    for name in PLACEMENTS:
        first = one[name].specific_force
        assert first.tobytes() == again[name].specific_force.tobytes()
        assert (first != other[name].specific_force).any() == (name != "shin")


def test_arrays_have_shapes_units_and_stamps():
    imus = cromosim.simulate(cromosim.walk(), {"wrist": {"site": "left_watch"}}, rate_hz=50)
    wrist = imus["wrist"]
    count = len(wrist)
    assert wrist.specific_force.shape == wrist.angular_velocity.shape == (count, 3)
    assert wrist.orientation.shape == (count, 4)
    assert np.allclose(np.linalg.norm(wrist.orientation, axis=1), 1)
    assert np.allclose(np.diff(wrist.stamps_s), 0.02)
    assert abs(np.linalg.norm(wrist.specific_force, axis=1).mean() - 9.8) < 1.5
    assert wrist.reference.positions.shape == (len(wrist.reference), 3)


def test_a_motion_of_arrays_is_the_motion():
    motion = cromosim.walk()
    again = cromosim.Motion(
        motion.rotations, motion.root_positions, motion.rate_hz, betas=motion.betas
    )
    placements = {"wrist": Placement(site="left_watch")}
    first, second = (cromosim.simulate(it, placements)["wrist"] for it in (motion, again))
    # Rotation vectors and back cost the last bits; the search for the smoothing enlarges them.
    assert np.abs(first.specific_force - second.specific_force).max() < 1e-5


def test_a_body_at_rest_reads_gravity():
    still = cromosim.Motion(np.zeros((120, 24, 3)), np.tile([0, 0, 1.0], (120, 1)), 60)
    chest = cromosim.simulate(still, {"chest": {"site": "sternum"}})["chest"]
    assert np.allclose(np.linalg.norm(chest.specific_force, axis=1), 9.80665, atol=1e-6)
    assert np.abs(chest.angular_velocity).max() < 1e-6


def test_the_lock_is_released():
    """Another thread counts while the simulation runs."""
    motion = cromosim.walk()
    long = cromosim.Motion(
        np.concatenate([motion.rotations] * 12), np.concatenate([motion.root_positions] * 12), 120
    )
    counted, done = [0], threading.Event()

    def count():
        while not done.is_set():
            counted[0] += 1
            time.sleep(0.0005)

    thread = threading.Thread(target=count)
    thread.start()
    while counted[0] == 0:
        time.sleep(0.001)
    before = counted[0]
    cromosim.simulate(long, {f"s{k}": Placement(site="left_watch") for k in range(8)})
    during = counted[0] - before
    done.set()
    thread.join()
    assert during > 3


@pytest.mark.parametrize(
    ("call", "words"),
    [
        (lambda: cromosim.read_motion("none.bvh"), ["none.bvh", "cannot read"]),
        (lambda: cromosim.read_motion("none.bvh", speed=2), ["speed"]),
        (lambda: simulate({"w": Placement(site="elbow_of_a_horse")}), ["w", "elbow_of_a_horse"]),
        (lambda: simulate({"w": Placement()}), ["placement", "w", "site"]),
        (lambda: simulate({"w": Placement(site="left_watch", rate_hz=-1)}), ["w", "rate_hz"]),
        (lambda: simulate({"w": {"sight": "left_watch"}}), ["w", "sight"]),
        (lambda: simulate({"w": Placement(site="left_watch")}, device="gold"), ["gold"]),
        (lambda: simulate({"w": Placement(site="left_watch")}, scheme="magic"), ["magic"]),
        (lambda: cromosim.Motion(np.zeros((3, 23, 3)), np.zeros((3, 3)), 60), ["rotations", "24"]),
        (lambda: cromosim.Motion(np.zeros((3, 24, 3)), np.full((3, 3), np.nan), 60), ["finite"]),
        (lambda: cromosim.Motion(np.zeros((3, 24, 3)), np.zeros((3, 3)), 0), ["rate_hz"]),
    ],
)
def test_errors_are_one_line(call, words):
    with pytest.raises(cromosim.CromosimError) as caught:
        call()
    text = str(caught.value)
    assert "\n" not in text
    assert all(word in text for word in words), text
    assert isinstance(caught.value, ValueError)


def simulate(placements, **options):
    return cromosim.simulate(cromosim.walk(), placements, **options)


def test_columns_become_frames_and_tables():
    wrist = simulate({"w": Placement(site="left_watch")})["w"]
    columns = wrist.columns()
    assert list(columns)[:2] == ["stamp_ns", "specific_force_x"]
    assert np.shares_memory(columns["angular_velocity_z"], wrist.angular_velocity)
    pandas = pytest.importorskip("pandas")
    frame = wrist.to_pandas()
    assert isinstance(frame, pandas.DataFrame) and len(frame) == len(wrist)
    assert (frame["specific_force_y"].to_numpy() == wrist.specific_force[:, 1]).all()


def test_arrow_tables_hold_the_values():
    pytest.importorskip("pyarrow")
    wrist = simulate({"w": Placement(site="left_watch")})["w"]
    table = wrist.to_arrow()
    assert (table["specific_force_x"].to_numpy() == wrist.specific_force[:, 0]).all()


def test_numpy_alone_is_needed():
    code = "import sys, cromosim; print([m for m in ('pandas', 'pyarrow', 'torch') if m in sys.modules])"
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert json.loads(done.stdout.replace("'", '"')) == []


def test_a_magnetometer_and_a_fused_orientation():
    walk_motion = cromosim.walk()
    field = np.array([0.0, 1.9e-5, -4.5e-5])
    placements = {"wrist": cromosim.Placement(site="left_watch")}
    ideal = cromosim.simulate(walk_motion, placements, device="ideal", magnetic_field=field)["wrist"]
    x, y, z, w = ideal.orientation.T
    north = np.stack([2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x)], 1)
    up = np.stack([2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)], 1)
    np.testing.assert_allclose(ideal.magnetic_field, north * field[1] + up * field[2], atol=1e-15)
    assert "magnetic_field_z" in ideal.columns()
    fused = cromosim.simulate(
        walk_motion, placements, device="consumer_mems", magnetic_field="0,1.9e-5,-4.5e-5", orientation="vqf"
    )["wrist"]
    near = np.abs(np.sum(fused.orientation * ideal.orientation, 1))
    assert np.all(near > np.cos(0.3)) and not np.allclose(near, 1.0)
    none = cromosim.simulate(walk_motion, placements, orientation="none")["wrist"]
    assert none.orientation is None and none.magnetic_field is None
    with pytest.raises(cromosim.CromosimError, match="the nearest is madgwick"):
        cromosim.simulate(walk_motion, placements, orientation="magdwick")
    with pytest.raises(cromosim.CromosimError, match="1 uT is 1e-6 T"):
        cromosim.simulate(walk_motion, placements, magnetic_field=[20, 0, -43])


def simulated_force(seed):
    walk = cromosim.walk()
    return cromosim.simulate(walk, PLACEMENTS, device="consumer_mems", seed=seed)["pocket"].specific_force


def test_forked_processes_have_threads_of_their_own():
    """As data loaders make them, after the parent's own threads have worked."""
    expected = simulated_force(3)
    with multiprocessing.get_context("fork").Pool(2) as workers:
        found = workers.map_async(simulated_force, [3, 3, 4]).get(timeout=60)
    assert [force.tobytes() == expected.tobytes() for force in found] == [True, True, False]
    assert simulated_force(3).tobytes() == expected.tobytes()


@pytest.mark.parametrize("kind", ["bvh", "npz", "trc"])
def test_motions_go_to_other_processes(tmp_path, command_line, kind):
    """Of skeletons, SMPL parameters and markers: what it is of decides about the noise that is expected."""
    path = tmp_path / f"walk.{kind}"
    command_line("convert", ROOT / "bags/walk", path)
    motion = cromosim.read_motion(path, start_s=1, duration_s=2)
    sent = pickle.loads(pickle.dumps(motion))
    same = ("name", "rate_hz", "duration_s", "how_read", "oddities")
    assert [getattr(sent, name) for name in same] == [getattr(motion, name) for name in same]
    here, there = (cromosim.simulate(one, PLACEMENTS, seed=1) for one in (motion, sent))
    for name in PLACEMENTS:
        assert there[name].stamps_ns.tobytes() == here[name].stamps_ns.tobytes()
        assert there[name].specific_force.tobytes() == here[name].specific_force.tobytes()
        covariances = (readings[name].specific_force_covariance.tobytes() for readings in (here, there))
        assert len(set(covariances)) == 1


def test_bodies_go_to_other_processes():
    body = cromosim.Body([1.0, -0.5])
    sent = pickle.loads(pickle.dumps(body))
    assert sent.id == body.id and sent.rest_vertices.tobytes() == body.rest_vertices.tobytes()
