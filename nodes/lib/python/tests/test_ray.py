"""examples/ray_simulate.py on a Ray cluster of two nodes, one of which is killed in the middle.

Ray is not among the requirements (617 MB): `pip install 'ray[data]'`. The cluster runs in a network
namespace of its own, so that no packet leaves the machine.
"""

import importlib.util
import os
import shutil
import subprocess
import sys
import threading
import time
from pathlib import Path

import numpy as np
import pytest

import cromosim

from conftest import ROOT

MOTIONS = 12


def motions(folder: Path) -> list[str]:
    """Parts of the walk, each a little later than the one before."""
    walk, paths = cromosim.walk(), []
    for number in range(MOTIONS):
        part = slice(20 * number, 20 * number + 400)
        path = folder / f"m{number:02}.npz"
        np.savez(
            path,
            poses=walk.rotations[part].reshape(-1, 72),
            trans=walk.root_positions[part],
            betas=walk.betas,
            mocap_framerate=walk.rate_hz,
            gender="neutral",
        )
        paths.append(str(path))
    return paths


def within(folder: Path) -> None:
    """In the namespace: simulates with one of two nodes killed, and compares."""
    import pyarrow.parquet
    import ray
    from ray.cluster_utils import Cluster

    spec = importlib.util.spec_from_file_location(
        "ray_simulate", ROOT / "nodes/lib/python/examples/ray_simulate.py"
    )
    example = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(example)
    paths = motions(folder)
    cluster = Cluster(initialize_head=True, head_node_args={"num_cpus": 1, "include_dashboard": False})
    victim = cluster.add_node(num_cpus=1)
    ray.init(address=cluster.address, logging_level="ERROR")
    cluster.wait_for_nodes()
    nodes = {}
    original = example.simulate

    def slow(batch):
        """As the example's, with a note of where and when, and a second to be killed in."""
        (path,) = batch["path"]
        node = ray.get_runtime_context().get_node_id()
        with open(folder / "begun.txt", "a", encoding="utf-8") as file:
            file.write(f"{node} {path}\n")
        time.sleep(1)
        return original(batch)

    example.simulate = slow

    def kill():
        def begun():
            text = (folder / "begun.txt").read_text() if (folder / "begun.txt").exists() else ""
            return [line for line in text.splitlines() if line.startswith(victim.node_id)]

        end = time.monotonic() + 120
        while len(begun()) < 2 and time.monotonic() < end:
            time.sleep(0.05)
        nodes["begun_on_victim"] = len(begun())
        cluster.remove_node(victim, allow_graceful=False)

    killer = threading.Thread(target=kill)
    killer.start()
    rows = example.main(str(folder / "out"), paths)
    killer.join()
    assert nodes["begun_on_victim"] >= 2, "the second node had work when it was killed"
    begun = (folder / "begun.txt").read_text().splitlines()
    table = pyarrow.parquet.read_table(folder / "out").to_pandas()
    assert len(table) == rows
    assert table["recording"].nunique() == MOTIONS
    for path in paths:
        motion = cromosim.read_motion(path)
        alone = cromosim.simulate(
            motion, example.PLACEMENTS, rate_hz=60, device="consumer_mems", seed=example.SEED
        )
        for name, readings in alone.items():
            own = table[(table["recording"] == Path(path).stem) & (table["placement"] == name)]
            own = own.sort_values("stamp_ns")
            assert (own["stamp_ns"].to_numpy() == readings.stamps_ns).all()
            for quantity in ("specific_force", "angular_velocity"):
                values = own[[f"{quantity}_{axis}" for axis in "xyz"]].to_numpy()
                assert (values == getattr(readings, quantity).astype(np.float32)).all()
    print(f"complete: {rows} rows of {MOTIONS} motions, begun {len(begun)} times")
    ray.shutdown()
    cluster.shutdown()


def test_a_killed_node_costs_no_row(tmp_path):
    pytest.importorskip("ray")
    if shutil.which("unshare") is None or os.geteuid() != 0:
        pytest.skip("needs unshare, as root")
    command = f"ip link set lo up && exec {sys.executable} {__file__} {tmp_path}"
    done = subprocess.run(
        ["unshare", "-n", "sh", "-c", command],
        capture_output=True,
        text=True,
        timeout=600,
        env=os.environ | {"RAY_USAGE_STATS_ENABLED": "0", "RAY_DATA_DISABLE_PROGRESS_BARS": "1"},
    )
    assert done.returncode == 0, done.stderr[-4000:]
    assert f"of {MOTIONS} motions" in done.stdout


if __name__ == "__main__":
    within(Path(sys.argv[1]))
