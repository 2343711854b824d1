"""CPU time of 60 s x 5 placements, through Python and by the command line, in one run.

    CROMOSIM_BINARY=... python measure.py        (five turns, alternating; medians)

The command line's time holds its start, reading, and writing of a bag as well; Python's its start, the
import and reading. `alone` is `simulate` by itself in a process that is already running, fits of splines
included: its first call, which finds neither code nor memory in place, and the median of five later ones;
`ideal` the same with sensors as IMUSim's: no device, no noise. NumPy's OpenBLAS makes a thread that spins
for some time after the import and is no part of a call: calls begin when the process has come to rest.
IMUSIM_PYTHON names a Python that has IMUSim (see peer_imusim.py), WIMUSIM_PYTHON one that has WIMUSim
(see peer_wimusim.py): then these, too, of the same motion.
"""

import os
import resource
import statistics
import subprocess
import sys
import tempfile
from pathlib import Path

import numpy as np

import cromosim

TURNS = 5
NAMES = ("left_watch", "right_watch", "sternum", "left_shin", "right_shin")


def cpu(command: list[str]) -> float:
    """User and system time of a process, s."""
    before = resource.getrusage(resource.RUSAGE_CHILDREN)
    subprocess.run(command, check=True, stdout=subprocess.DEVNULL)
    after = resource.getrusage(resource.RUSAGE_CHILDREN)
    return after.ru_utime - before.ru_utime + after.ru_stime - before.ru_stime


PROGRAM = """
import resource, sys, time
import cromosim
motion = cromosim.read_motion(sys.argv[1])
placements = {f"p{k}": cromosim.Placement(site=site) for k, site in enumerate(sys.argv[4:])}
device = dict(device="ideal", noise=False) if sys.argv[2] == "ideal" else dict(device=sys.argv[2])
time.sleep(0.5)
for call in range(int(sys.argv[3])):
    before = resource.getrusage(resource.RUSAGE_SELF)
    imus = cromosim.simulate(motion, placements, rate_hz=100, **device)
    after = resource.getrusage(resource.RUSAGE_SELF)
    assert sum(map(len, imus.values())) > 29000
    print(after.ru_utime - before.ru_utime + after.ru_stime - before.ru_stime)
"""
LATER_CALLS = 5


def main() -> None:
    binary = os.environ["CROMOSIM_BINARY"]
    walk = cromosim.walk()
    repeats = -(-60 * int(walk.rate_hz) // len(walk))
    rotations = np.concatenate([walk.rotations] * repeats)
    there_and_back = [walk.root_positions, walk.root_positions[::-1]] * repeats
    positions = np.concatenate(there_and_back)[: len(rotations)]
    frames = round(60 * walk.rate_hz) + 1
    sites = [name for name in NAMES if name in cromosim.Body().site_names]
    sites += [name for name in cromosim.Body().site_names if name not in sites]
    sites = sites[:5]
    with tempfile.TemporaryDirectory() as folder:
        minute, sensors = Path(folder) / "minute.npz", Path(folder) / "sensors.yaml"
        np.savez(
            minute,
            poses=rotations[:frames].reshape(frames, 72),
            trans=positions[:frames],
            betas=walk.betas,
            mocap_framerate=walk.rate_hz,
            gender="neutral",
        )
        entries = "".join(f"  p{k}: {{site: {site}}}\n" for k, site in enumerate(sites))
        sensors.write_text(
            "schema: cromosim/placements/1\ndefaults: {rate_hz: 100, device: consumer_mems}\n"
            f"placements:\n{entries}"
        )
        line = [binary, "simulate", str(minute), "--placements", str(sensors), "--force"]
        line += ["--out", str(Path(folder) / "out.mcap")]

        def python(device: str, calls: int) -> list[str]:
            return [sys.executable, "-c", PROGRAM, str(minute), device, str(calls), *sites]

        of_line, of_python = [], []
        calls: dict[str, list[list[float]]] = {"consumer_mems": [], "ideal": []}
        for _ in range(TURNS):
            of_line.append(cpu(line))
            of_python.append(cpu(python("consumer_mems", 1)))
            for device, seconds in calls.items():
                command = python(device, 1 + LATER_CALLS)
                done = subprocess.run(command, check=True, capture_output=True, text=True)
                seconds.append([float(told) for told in done.stdout.split()])
        imusim = os.environ.get("IMUSIM_PYTHON")
        if imusim is not None:
            bvh = str(Path(folder) / "minute.bvh")
            subprocess.run([binary, "convert", str(minute), bvh], check=True, stdout=subprocess.DEVNULL)
            peer = [imusim, str(Path(__file__).parent / "peer_imusim.py"), bvh]
            peer += ["left_wrist", "right_wrist", "spine3", "left_knee", "right_knee"]
            told = subprocess.run(peer, check=True, capture_output=True, text=True).stdout
        wimusim = os.environ.get("WIMUSIM_PYTHON")
        if wimusim is not None:
            peer = [wimusim, str(Path(__file__).parent / "peer_wimusim.py"), str(minute)]
            torch_told = subprocess.run(peer, check=True, capture_output=True, text=True).stdout
    line_s, python_s = map(statistics.median, (of_line, of_python))
    alone_s, ideal_s = (statistics.median(told[0] for told in turns) for turns in calls.values())
    alone_later_s, ideal_later_s = (
        statistics.median(statistics.median(told[1:]) for told in turns) for turns in calls.values()
    )
    print(f"command line {line_s:.3f} s, Python {python_s:.3f} s: {python_s / line_s:.2f} times")
    print(f"simulate alone {alone_s:.3f} s, ideal {ideal_s:.3f} s; later calls {alone_later_s:.3f}, {ideal_later_s:.3f} s")
    if imusim is not None:
        splines_s, after_s, peer_s = map(float, told.split())
        peer_alone_s = splines_s + after_s
        print(
            f"IMUSim alone {peer_alone_s:.2f} s ({splines_s:.2f} s of it its splines), {peer_alone_s / ideal_s:.0f} times "
            f"ideal, {peer_alone_s / alone_s:.0f} times alone; {peer_alone_s / ideal_later_s:.0f} and "
            f"{peer_alone_s / alone_later_s:.0f} times later calls; in all {peer_s:.2f} s, {peer_s / python_s:.0f} times"
        )
    if wimusim is not None:
        forward_s, first_s, whole_s = map(float, torch_told.split())
        print(
            f"WIMUSim's forward pass {forward_s:.3f} s, {forward_s / alone_s:.2f} times; the first {first_s:.3f} s; "
            f"in all {whole_s:.2f} s, {whole_s / python_s:.1f} times"
        )


if __name__ == "__main__":
    main()
