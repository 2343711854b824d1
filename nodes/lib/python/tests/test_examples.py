"""The examples run, and the README's Python block."""

import importlib.util
import os
import re
import subprocess
import sys

import numpy as np
import pytest

import cromosim

from conftest import ROOT

EXAMPLES = ROOT / "nodes/lib/python/examples"


def example(name):
    """An example as a module."""
    spec = importlib.util.spec_from_file_location(name, EXAMPLES / f"{name}.py")
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


@pytest.fixture
def walk_bvh(tmp_path, command_line):
    command_line("convert", ROOT / "bags/walk", tmp_path / "walk.bvh")
    return tmp_path / "walk.bvh"


def test_wrist_for_training(tmp_path, walk_bvh):
    example("wrist_for_training").main(str(walk_bvh), str(tmp_path / "windows.npz"))
    windows = np.load(tmp_path / "windows.npz")["windows"]
    assert windows.shape[1:] == (200, 6) and len(windows) >= 4
    assert not np.array_equal(windows[0], windows[len(windows) // 4])


def test_diagnose_recording(tmp_path, capsys):
    example("diagnose_recording").main(str(ROOT / "bags/gap/session"), str(tmp_path / "out"))
    assert "lever_arm" in capsys.readouterr().out
    assert (tmp_path / "out/report.html").stat().st_size > 10_000


def test_mujoco_arm():
    pytest.importorskip("mujoco")
    differences = example("mujoco_arm").main()
    assert differences["specific_force"] < 0.05
    assert differences["angular_velocity"] < 0.005
    assert differences["bias"] < 0.01


def test_torch_dataset(walk_bvh):
    torch = pytest.importorskip("torch")
    dataset = example("torch_dataset").DrawnWindows([walk_bvh])
    first = torch.stack(list(dataset))
    dataset.draw(1)
    other = torch.stack(list(dataset))
    dataset.draw(0)
    assert first.shape[1:] == (6, 100)
    assert torch.equal(first, torch.stack(list(dataset))) and not torch.equal(first, other)


@pytest.mark.parametrize("document", ["README.md", "nodes/lib/python/README.md"])
def test_python_blocks_of_the_documents_run(tmp_path, walk_bvh, document):
    text = (ROOT / document).read_text(encoding="utf-8")
    blocks = re.findall(r"^```python\n(.*?)^```", text, re.M | re.S)
    assert blocks
    (tmp_path / "bags").symlink_to(ROOT / "bags")
    script = "\n".join(blocks)
    done = subprocess.run(
        [sys.executable, "-c", script], cwd=tmp_path, capture_output=True, text=True, env=os.environ
    )
    assert done.returncode == 0, done.stderr


def test_the_version_is_the_packages():
    assert re.fullmatch(r"\d+\.\d+\.\d+", cromosim.__version__)
