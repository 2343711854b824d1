"""How the throughput of examples/ray_simulate.py grows from one worker to two: `python measure_ray.py FOLDER [--motions 64] [--minutes 1] [--turns 3]`

Clusters of one and of two nodes of one processor each, in a network namespace of their own (as root), take turns at so many motions of so many
minutes of the walk each; prints each turn's time, minutes of motion a second and the quotient of the medians. A first turn of each, which starts workers, is left out.
"""

import argparse
import importlib.util
import os
import statistics
import subprocess
import sys
import time
from pathlib import Path

import numpy as np

import cromosim

EXAMPLE = Path(__file__).resolve().parents[1] / "examples/ray_simulate.py"


def motions(folder: Path, count: int, minutes: int) -> list[str]:
    """Minutes of walking to and fro."""
    walk = cromosim.walk()
    repeats = -(-60 * minutes * int(walk.rate_hz) // (2 * len(walk))) + 1
    rotations = np.concatenate([walk.rotations, walk.rotations[::-1]] * repeats)
    positions = np.concatenate([walk.root_positions, walk.root_positions[::-1]] * repeats)
    paths = []
    for number in range(count):
        part = slice(number, number + round(60 * minutes * walk.rate_hz) + 1)
        path = folder / f"m{number:03}.npz"
        np.savez(
            path,
            poses=rotations[part].reshape(-1, 72),
            trans=positions[part],
            betas=walk.betas,
            mocap_framerate=walk.rate_hz,
            gender="neutral",
        )
        paths.append(str(path))
    return paths


def turn(workers: int, folder: Path, paths: list[str], minutes: int) -> float:
    """Seconds for all motions on a cluster of so many nodes that is up and has workers."""
    import ray
    from ray.cluster_utils import Cluster

    spec = importlib.util.spec_from_file_location("ray_simulate", EXAMPLE)
    example = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(example)
    cluster = Cluster(initialize_head=True, head_node_args={"num_cpus": 1, "include_dashboard": False})
    for _ in range(workers - 1):
        cluster.add_node(num_cpus=1)
    ray.init(address=cluster.address, logging_level="ERROR")
    cluster.wait_for_nodes()
    example.main(str(folder / "first"), paths[: 2 * workers])
    begun = time.monotonic()
    rows = example.main(str(folder / f"of{workers}"), paths)
    gone = time.monotonic() - begun
    ray.shutdown()
    cluster.shutdown()
    # Two placements at 60 Hz, less what is uncertain at the ends.
    assert rows > 0.99 * len(paths) * minutes * 2 * 3600, rows
    return gone


def main() -> None:
    parser = argparse.ArgumentParser()
    parser.add_argument("folder", type=Path)
    parser.add_argument("--motions", type=int, default=64)
    parser.add_argument("--minutes", type=int, default=1)
    parser.add_argument("--turns", type=int, default=3)
    options = parser.parse_args()
    folder, count, minutes = options.folder.resolve(), options.motions, options.minutes
    if os.environ.get("CROMOSIM_RAY_INSIDE") is None:
        command = 'ip link set lo up && exec "$@"'
        environment = os.environ | {
            "CROMOSIM_RAY_INSIDE": "1",
            "RAY_USAGE_STATS_ENABLED": "0",
            "RAY_DATA_DISABLE_PROGRESS_BARS": "1",
            "RAYON_NUM_THREADS": "1",
        }
        again = ["unshare", "-n", "sh", "-c", command, "sh", sys.executable, *sys.argv]
        sys.exit(subprocess.run(again, env=environment).returncode)
    folder.mkdir(parents=True, exist_ok=True)
    paths = motions(folder, count, minutes)
    seconds: dict[int, list[float]] = {1: [], 2: []}
    for _ in range(options.turns):
        for workers, times in seconds.items():
            times.append(turn(workers, folder, paths, minutes))
            done = f"{count} x {minutes} minutes in {times[-1]:.2f} s, {count * minutes / times[-1]:.1f} a second"
            print(f"{workers} worker(s): {done}", flush=True)
    one, two = (statistics.median(times) for times in seconds.values())
    print(f"two workers: {one / two:.2f} times the throughput of one")


if __name__ == "__main__":
    main()
