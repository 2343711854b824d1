"""Rigid bodies, streams and bodies as arrays."""

import numpy as np
import pytest

import cromosim
from cromosim import Device

from conftest import ROOT

RATE_HZ, RADIUS, SPEED = 120.0, 0.5, 2.0
STAMPS = 1 + np.arange(600) / RATE_HZ
ANGLE = SPEED * (STAMPS - 1)
# On a circle in the horizontal plane, the sensor's x axis outwards.
POSITIONS = RADIUS * np.stack([np.cos(ANGLE), np.sin(ANGLE), 0 * ANGLE], axis=1)
TURNS = np.stack([0 * ANGLE, 0 * ANGLE, np.sin(ANGLE / 2), np.cos(ANGLE / 2)], axis=1)
CENTRIPETAL = [-RADIUS * SPEED**2, 0, 9.80665]


def test_a_circle_reads_centripetal_force_and_gravity():
    read = cromosim.simulate_rigid(STAMPS, POSITIONS, TURNS, rate_hz=100)
    middle = slice(len(read) // 4, -len(read) // 4)
    assert np.abs(read.specific_force[middle] - CENTRIPETAL).max() < 1e-3
    assert np.abs(read.angular_velocity[middle] - [0, 0, SPEED]).max() < 1e-4


def test_a_trajectory_gives_the_command_lines_values(tmp_path, command_line):
    command_line("convert", ROOT / "bags/walk", tmp_path / "wrist.tum", "--site", "left_watch")
    options = ["--rate", 200, "--device", "consumer_mems", "--seed", 4, "--placement", "grip"]
    out = tmp_path / "grip.mcap"
    command_line("simulate", "--rigid", tmp_path / "wrist.tum", *options, "--out", out)
    command_line("bag", "csv", out, "/imu/grip/data_raw", "--out", tmp_path / "grip.csv")
    text = (tmp_path / "wrist.tum").read_text(encoding="utf-8")
    rows = np.array([line.split() for line in text.splitlines() if line[:1] != "#"], dtype=float)
    read = cromosim.simulate_rigid(
        rows[:, 0], rows[:, 1:4], rows[:, 4:], rate_hz=200, device="consumer_mems", seed=4, name="grip"
    )
    table = np.loadtxt(tmp_path / "grip.csv", delimiter=",", skiprows=1, dtype=str)
    assert len(table) == len(read) > 700
    assert (table[:, 0].astype(np.int64) == read.stamps_ns).all()
    both = np.concatenate([read.angular_velocity, read.specific_force], axis=1)
    assert table[:, 5:].astype(np.float64).tobytes() == both.tobytes(), "to the last bit"


def test_what_a_device_leaves_unexplained_is_in_the_covariances(tmp_path):
    def variance(unexplained):
        path = tmp_path / "device.yaml"
        path.write_text(
            "schema: cromosim/device/1\n"
            f"declared_noise: {{accel_density: 0.001, gyro_density: 0.0001}}\n{unexplained}",
            encoding="utf-8",
        )
        read = cromosim.simulate_rigid(STAMPS, POSITIONS, TURNS, rate_hz=100, device=path)
        middle = len(read) // 2
        return read.specific_force_covariance[middle, 0], read.angular_velocity_covariance[middle, 0]

    plain = variance("")
    more = variance("unexplained: {accel_variance: 0.002, gyro_variance: 1.0e-5}\n")
    assert np.subtract(more, plain) == pytest.approx([0.002, 1e-5], rel=0.01)


def test_a_stream_reads_what_the_whole_reads():
    device = Device({"gyro_bias": {"bias": [0.01, 0, 0]}})
    imu = cromosim.StreamingImu(RATE_HZ, 60, scheme="richardson", device=device)
    whole = cromosim.simulate_rigid(
        STAMPS, POSITIONS, TURNS, rate_hz=60, scheme="richardson", device=device, trim_s=0
    )
    parts = [
        imu.push(stamp, position, turn)
        for stamp, position, turn in zip(STAMPS, POSITIONS, TURNS, strict=True)
    ]
    assert 0 < imu.delay_s < 0.1
    assert all(len(part) == 0 for part in parts[:4])
    parts.append(imu.finish())
    streamed = np.concatenate([part.angular_velocity for part in parts])
    assert len(streamed) == len(whole)
    assert np.abs(streamed[10:-10] - whole.angular_velocity[10:-10]).max() < 1e-6
    assert np.abs(streamed[20:-20] - [0.01, 0, SPEED]).max() < 1e-4


@pytest.mark.parametrize(
    ("call", "words"),
    [
        (lambda: rigid(TURNS * 2), ["orientations", "row 0", "norm 2"]),
        (lambda: rigid(TURNS[:-1]), ["599"]),
        (lambda: rigid(TURNS, rate_hz=0), ["rate"]),
        (lambda: cromosim.StreamingImu(0, 100), ["rate"]),
        (lambda: cromosim.StreamingImu(60, 100).push(1, [0, 0, 0], [0, 0, 0, 2]), ["norm 2"]),
        (lambda: cromosim.Body([0.0] * 99), ["beta"]),
        (lambda: cromosim.Body().vertices(np.zeros((1, 24, 3))), ["root_positions"]),
    ],
)
def test_errors_are_one_line(call, words):
    with pytest.raises(cromosim.CromosimError) as caught:
        call()
    text = str(caught.value)
    assert "\n" not in text and all(word in text for word in words), text


def rigid(turns, rate_hz=100):
    return cromosim.simulate_rigid(STAMPS, POSITIONS, turns, rate_hz=rate_hz)


def test_a_body_is_arrays():
    body, motion = cromosim.Body(), cromosim.walk()
    vertices, joints = body.vertices(motion), body.joints(motion)
    assert vertices.shape == (len(motion), len(body.rest_vertices), 3)
    assert vertices.dtype == np.float32
    assert joints.shape == (len(motion), 24, 3)
    assert np.allclose(joints[:, 0], motion.root_positions)
    assert body.faces.max() == len(body.rest_vertices) - 1
    assert "left_watch" in body.site_names
    # The skin lies about the bones, and arrays give what the motion gives.
    assert np.abs(vertices.mean(axis=1) - joints.mean(axis=1)).max() < 0.3
    again = body.joints(motion.rotations, motion.root_positions)
    assert np.allclose(again, joints, atol=1e-9)
