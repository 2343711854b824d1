"""Windows of a wrist's accelerometer and gyroscope, for a classifier to train on.

    python wrist_for_training.py walk.bvh windows.npz

Each draw wears the watch a little differently and draws its device's noise anew.
"""

import sys

import numpy as np

import cromosim

WINDOW, HOP, DRAWS = 200, 100, 4


def windows(readings: cromosim.Readings) -> np.ndarray:
    """(W, 200, 6): specific force in m/s2 and angular velocity in rad/s."""
    both = np.concatenate([readings.specific_force, readings.angular_velocity], axis=1)
    starts = range(0, len(both) - WINDOW + 1, HOP)
    return np.stack([both[start : start + WINDOW] for start in starts])


def main(motion_file: str, out: str) -> None:
    motion = cromosim.read_motion(motion_file)
    draws = np.random.default_rng(0)
    drawn = []
    for seed in range(DRAWS):
        turned = [0, 0, draws.normal(scale=np.radians(10))]
        watch = cromosim.Placement(site="left_watch", mount={"rotvec": turned})
        imus = cromosim.simulate(
            motion, {"left_wrist": watch}, rate_hz=100, device="consumer_mems", seed=seed
        )
        drawn.append(windows(imus["left_wrist"]))
    np.savez(out, windows=np.concatenate(drawn))
    print(f"{out}: {sum(map(len, drawn))} windows of {WINDOW} samples from {motion.name}")


if __name__ == "__main__":
    main(*sys.argv[1:])
