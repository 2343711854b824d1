"""Diagnoses are the command line's; `python -m cromosim` is the command line."""

import os
import subprocess
import sys

import pytest

import cromosim

from conftest import ROOT

SESSION = ROOT / "bags/gap/session"


def test_a_recording_is_diagnosed_as_on_the_command_line(tmp_path, command_line):
    command_line("diagnose", SESSION, "--out", tmp_path / "expected")
    recordings = cromosim.read_recording(SESSION)
    found = cromosim.diagnose(recordings, title="Gap diagnosis of session")
    found.write(tmp_path / "ours")
    for name in ("diagnosis.json", "effects.yaml", "report.html"):
        ours, expected = (tmp_path / side / name for side in ("ours", "expected"))
        assert ours.read_bytes() == expected.read_bytes(), name
    wrist = found.placements["right_wrist"]
    assert {cause.effect for cause in wrist.causes} == {"time_offset", "lever_arm"}
    assert wrist.rmse_after[0] < 0.2 * wrist.rmse_before[0]
    assert len(found.rows()) == sum(len(one.causes) for one in found.placements.values())
    with pytest.raises(FileExistsError):
        found.write(tmp_path / "ours")


def test_arrays_are_diagnosed():
    walk, sites = cromosim.walk(), {"wrist": cromosim.Placement(site="left_watch")}
    bias = [0.3, -0.2, 0.25]
    device = cromosim.Device(
        {"accel_bias": {"bias": bias}}, accel_density=0.002, gyro_density=0.0002
    )
    real = cromosim.simulate(walk, sites, device=device, seed=1)["wrist"]
    recording = cromosim.Recording(real.reference, real)
    found = cromosim.diagnose(recording, seed=1).placements["wrist"]
    cause = next(cause for cause in found.causes if cause.effect == "accel_bias")
    assert cause.parameters["bias"] == pytest.approx(bias, abs=0.05)


def test_errors_are_one_line():
    with pytest.raises(cromosim.CromosimError, match="none.mcap"):
        cromosim.read_recording("none.mcap")
    with pytest.raises(cromosim.CromosimError, match="lever_leg"):
        cromosim.diagnose(cromosim.read_recording(SESSION), without=["lever_leg"])
    with pytest.raises(cromosim.CromosimError, match="different names"):
        cromosim.diagnose([])


def test_python_m_is_the_command_line(command_line):
    program = [sys.executable, "-m", "cromosim"]
    done = subprocess.run([*program, "--help"], capture_output=True, text=True, check=True)
    assert done.stdout == command_line("--help")
    alone = {**os.environ, "PATH": "", "CROMOSIM_BINARY": ""}
    done = subprocess.run([*program, "demo"], capture_output=True, text=True, env=alone)
    assert done.returncode == 2 and done.stderr.count("\n") == 1
    assert "cargo install" in done.stderr
    assert done.stdout == ""
