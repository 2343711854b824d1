"""IMUSim itself on bags/truth, beside `cromosim simulate --rigid` and the exact readings.

    git clone https://github.com/hyeokhyen/imusim_py3 imusim && pip install numpy scipy "cython<3.1" setuptools
    python imusim_peer.py imusim CROMOSIM

The fork (GPL, Python 3) runs as a peer; nothing of it is copied or needed. Its Cython modules for splines and
quaternions are built in its own folder the first time. Both programs see the same poses: every fourth or second of the
240 Hz, with white errors of 0.65 mm and 0.2 degrees about each axis.
"""

import subprocess
import sys
import tempfile
from pathlib import Path

import numpy as np
from scipy.spatial.transform import Rotation

TRUTH = Path(__file__).parent / "../../bags/truth"
MOTIONS = ("walk", "run", "jump", "reach", "fall", "burst")
SITES = ("wrist", "upper_arm", "pelvis", "thigh", "foot", "head")
POSITION_STD, TURN_STD = 0.65e-3, np.radians(0.2)
LEFT_OUT_S = 0.25  # at either end: IMUSim's rotations do not reach the ends
SEED = 11
METHODS = ("IMUSim, its defaults", "IMUSim, told the errors", "adaptive_spline")
GRAVITY = np.array([0.0, 0.0, -9.80665])
BUILD = """
import numpy
from Cython.Build import cythonize
from setuptools import Extension, setup
names = ("quaternions", "quat_splines", "vectors")
modules = [Extension(f"imusim.maths.{name}", [f"imusim/maths/{name}.pyx"]) for name in names]
setup(name="peer", packages=[], include_dirs=[numpy.get_include()],
      ext_modules=cythonize(modules, compiler_directives={"language_level": 2}))
"""


def built(folder):
    """Makes the fork's modules importable."""
    if not list(Path(folder).glob("imusim/maths/quat_splines*.so")):
        command = [sys.executable, "-c", BUILD, "build_ext", "--inplace"]
        subprocess.run(command, cwd=folder, check=True, capture_output=True)
    sys.path.insert(0, str(folder))


def by_imusim(seconds, positions, rotations, at, **stds):
    """Specific force and angular velocity in sensor axes."""
    from imusim.maths.quaternions import QuaternionArray
    from imusim.trajectories.sampled import SampledTrajectory
    from imusim.trajectories.splined import SplinedTrajectory

    wxyz = rotations.as_quat()[:, [3, 0, 1, 2]]
    sampled = SampledTrajectory.fromArrays(seconds, positions.T, QuaternionArray(wxyz))
    splined = SplinedTrajectory(sampled, **stds)
    own = Rotation.from_quat(np.asarray(splined.rotation(at).array)[:, [1, 2, 3, 0]])
    acceleration = np.asarray(splined.acceleration(at)).T
    rate = np.asarray(splined.rotationalVelocity(at)).T
    return own.inv().apply(acceleration - GRAVITY), own.inv().apply(rate)


def by_cromosim(program, seconds, positions, rotations, at):
    with tempfile.TemporaryDirectory() as folder:
        np.savetxt(f"{folder}/poses.tum", np.c_[seconds, positions, rotations.as_quat()], fmt="%.9f")
        command = [program, "simulate", "--rigid", "poses.tum", "--rate", "240", "--trim", "0", "--out", "out.mcap"]
        subprocess.run(command, cwd=folder, check=True, capture_output=True)
        command = [program, "bag", "csv", "out.mcap", "/imu/body/data_raw", "--out", "imu.csv"]
        subprocess.run(command, cwd=folder, check=True, capture_output=True)
        table = np.genfromtxt(f"{folder}/imu.csv", delimiter=",", skip_header=1)
    stamps = np.arange(len(table)) / 240.0
    column = lambda first: np.stack([np.interp(at, stamps, table[:, first + axis]) for axis in range(3)], axis=1)
    return column(table.shape[1] - 3), column(table.shape[1] - 6)


def poses_of(stored, site, step, generator):
    """Poses with errors: times, positions, rotations, and the stamps of the readings."""
    positions = stored[f"{site}_position"].astype(float)[::step]
    wxyz = stored[f"{site}_quat_wxyz"].astype(float)[::step]
    positions = positions + generator.normal(0.0, POSITION_STD, positions.shape)
    turn = Rotation.from_rotvec(generator.normal(0.0, TURN_STD, positions.shape))
    seconds = np.arange(len(positions)) * step / 240.0
    stamps = np.arange(len(stored[f"{site}_position"])) / 240.0
    inside = (stamps >= LEFT_OUT_S) & (stamps <= seconds[-1] - LEFT_OUT_S)
    return (seconds, positions, Rotation.from_quat(wxyz[:, [1, 2, 3, 0]]) * turn, stamps[inside]), inside


def seen_by_all(program, poses):
    return (
        by_imusim(*poses),
        # A quaternion's components err by half of what the rotation vector does.
        by_imusim(*poses, positionStdDev=POSITION_STD, rotationStdDev=TURN_STD / 2.0),
        by_cromosim(program, *poses),
    )


def ratios(squares):
    """adaptive_spline's error over that of the others, with 95 % when motions are drawn anew; (motion, method, channel)."""
    ratio = lambda chosen: np.sqrt(chosen[:, 2].sum(0) / chosen[:, :2].sum(0))
    draw = np.random.default_rng(SEED)
    drawn = [ratio(squares[draw.integers(len(squares), size=len(squares))]) for _ in range(2000)]
    low, high = np.quantile(drawn, [0.025, 0.975], axis=0)
    cell = lambda *at: f"{ratio(squares)[at]:.2f} ({low[at]:.2f} to {high[at]:.2f})"
    return [f"{cell(method, 0)}, {cell(method, 1)}" for method in range(2)]


def jump(program):
    """What is left of the jump in nodes/lib/imu/jump.png at push-off and landing, and the error of its norm; means of draws."""
    stored = np.load(TRUTH / "jump.npz")
    truth = np.linalg.norm(stored["pelvis_specific_force"].astype(float), axis=1)
    found = []
    for draw in range(10):
        poses, inside = poses_of(stored, "pelvis", 4, np.random.default_rng(SEED + draw))
        part = lambda low, high: (poses[3] >= low) & (poses[3] <= high)
        known = truth[inside]
        for method, (force, _) in enumerate(seen_by_all(program, poses)):
            norm = np.linalg.norm(force, axis=1)
            error = lambda low, high: np.sqrt(((norm - known)[part(low, high)] ** 2).mean())
            peaks = [norm[part(2.1, 2.6)].max(), norm[part(2.9, 3.3)].max()]
            found.append([method, *peaks, error(2.6, 2.9), error(3.05, 3.3), error(2.1, 3.3)])
    found = np.array(found)
    window = np.arange(len(truth)) / 240.0
    peaks = [truth[(window >= low) & (window <= high)].max() for low, high in ((2.1, 2.6), (2.9, 3.3))]
    print("\n| the jump's pelvis, 60 Hz, m/s² | push-off | landing | error in flight | after landing | of the whole 1.2 s |\n|---|---:|---:|---:|---:|---:|")
    print(f"| truth | {peaks[0]:.0f} | {peaks[1]:.0f} | | | |")
    for method, name in enumerate(METHODS):
        push, land, flight, after, whole = found[found[:, 0] == method, 1:].mean(0)
        print(f"| {name} | {push:.0f} | {land:.0f} | {flight:.2f} | {after:.2f} | {whole:.1f} |")


def main(fork, program):
    built(Path(fork).resolve())
    print("| poses | " + " | ".join(METHODS) + " | adaptive_spline over IMUSim's defaults | over IMUSim, told the errors |")
    print("|---|---:|---:|---:|---:|---:|")
    for step, rate_hz in ((4, 60), (2, 120)):
        generator = np.random.default_rng(SEED)
        squares, count = np.zeros((len(MOTIONS), 3, 2)), 0
        for number, motion in enumerate(MOTIONS):
            stored = np.load(TRUTH / f"{motion}.npz")
            for site in SITES:
                poses, inside = poses_of(stored, site, step, generator)
                for method, readings in enumerate(seen_by_all(program, poses)):
                    for channel, quantity in enumerate(("specific_force", "angular_velocity")):
                        truth = stored[f"{site}_{quantity}"].astype(float)[inside]
                        squares[number, method, channel] += ((readings[channel] - truth) ** 2).sum()
                count += 3 * inside.sum()
        cells = [f"{force:.2f}, {rate:.3f}" for force, rate in np.sqrt(squares.sum(0) / count)]
        print(f"| {rate_hz} Hz | " + " | ".join(cells + ratios(squares)) + " |")
    jump(program)


if __name__ == "__main__":
    main(sys.argv[1], sys.argv[2])
