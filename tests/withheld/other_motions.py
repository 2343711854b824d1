"""Motions of another hand than motions.py: joint angles and paths on a dense grid.

Velocities are differences of high order on the grid, rotations' by logarithms; no splines are fitted."""
import glob
import os

import numpy as np
from scipy.interpolate import CubicSpline
from scipy.ndimage import gaussian_filter1d, uniform_filter1d
from scipy.signal import butter, sosfiltfilt
from scipy.spatial.transform import Rotation, Slerp

HERE = os.path.dirname(os.path.abspath(__file__))
STEP = 1e-3  # s, of the dense grid
SPARE = 4.0  # s of motion at both ends: clock offsets, filters' beginnings
UP = np.array([0.0, 0.0, 9.80665])
DEGREE = np.pi / 180


def wander(rng, count, low, high):
    """Noise of unit variance between two frequencies, Hz."""
    spectrum = np.fft.rfft(rng.standard_normal(count))
    hz = np.fft.rfftfreq(count, STEP)
    value = np.fft.irfft(spectrum * ((hz >= low) & (hz <= high)) * np.minimum(1.0, 0.5 * (low + high) / np.maximum(hz, 1e-3)), count)
    return value / value.std()


def spells(rng, count, on, off, ease):
    """1 in spells of `on` s, 0 in between for `off` s, eased over `ease` s."""
    value, at, state = np.zeros(count), 0, rng.random() < 0.7
    while at < count:
        length = max(1, int(rng.uniform(*(on if state else off)) / STEP))
        value[at:at + length], at, state = state, at + length, not state
    return gaussian_filter1d(value, ease / STEP)


# Each returns a base (N, 3) and joints [(offset in the link before, axis, angle (N,))] on the dense grid.


def gait(rng, time):
    """A cycle of harmonics on hip, knee and ankle, with stops and turns."""
    count = len(time)
    go = spells(rng, count, (6, 25), (1, 5), 0.3)
    phase = 2 * np.pi * np.cumsum(rng.uniform(0.75, 1.15) * go * (1 + 0.05 * wander(rng, count, 0.02, 0.3))) * STEP
    waves = lambda sizes: sum(size * DEGREE * np.sin((k + 1) * phase + rng.uniform(0, 6.3)) for k, size in enumerate(sizes)) * go
    heading = np.cumsum(go * 0.5 * wander(rng, count, 0.01, 0.15)) * STEP
    speed = rng.uniform(0.7, 1.5) * go
    base = np.cumsum(np.stack([speed * np.cos(heading), speed * np.sin(heading), 0 * speed], 1), 0) * STEP
    base += go[:, None] * np.stack([0.01 * np.sin(phase), 0.02 * np.sin(phase + 1), 0.025 * np.sin(2 * phase)], 1)
    joints = [((0, 0, 0.9), (0, 0, 1), heading + waves((6, 1))), ((0, 0.1, 0), (0, 1, 0), waves((20, 4, 1))), ((0, 0, -0.42), (0, 1, 0.05), waves((22, 9, 3, 1))),
              ((0, 0, -0.2), (1, 0, 0.1), waves((5, 2, 1))), ((0, 0, -0.2), (0, 1, 0), waves((8, 5, 2, 1)))]
    return base, joints[:int(rng.integers(2, 6))]


def robot(rng, time):
    """Joints that move from pose to pose with bounded jerk, and rest."""
    count, joints = len(time), []
    for k in range(6):
        target, at = np.zeros(count), 0
        while at < count:
            target[at:] = rng.uniform(-1.2, 1.2)
            at += int(rng.uniform(1.2, 4.5) / STEP)
        for length in (rng.uniform(0.4, 0.9), rng.uniform(0.1, 0.3), 0.06):
            target = uniform_filter1d(target, int(length / STEP), mode="nearest")
        joints.append(((0, 0, 0.35 if k in (1, 3) else 0.08), [(0, 0, 1), (0, 1, 0), (0, 1, 0), (0, 0, 1), (0, 1, 0), (0, 0, 1)][k], gaussian_filter1d(target, 12)))
    return np.zeros((count, 3)) + rng.uniform(-3, 3, 3), joints


def tool(rng, time):
    """Blows: a slow lift, a quick strike, and a short ringing in the hand."""
    count = len(time)
    work = spells(rng, count, (4, 12), (1, 4), 0.2)
    swing, at = np.zeros(count), 300
    while at < count - 3000:
        period = int(rng.uniform(0.6, 1.4) / STEP)
        lift, size = int(0.75 * period), rng.uniform(0.5, 1.1)
        swing[at:at + lift] += size * 0.5 * (1 - np.cos(np.pi * np.arange(lift) / lift))
        fall = int(0.22 / STEP)
        swing[at + lift:at + lift + fall] += size * (1 - (np.arange(fall) / fall) ** 2)
        ring = np.arange(500) * STEP
        swing[at + lift + fall:at + lift + fall + 500] += 0.03 * size * np.exp(-ring / 0.06) * np.sin(2 * np.pi * 9 * ring)
        at += period
    swing = gaussian_filter1d(swing * work, 18)
    slow = lambda size: size * wander(rng, count, 0.05, 0.8)
    base = np.stack([slow(0.05), slow(0.05), slow(0.03)], 1)
    return base, [((0, 0, 1.3), (0, 0, 1), slow(0.3)), ((0, 0, 0), (0, -1, 0), 0.6 * swing + slow(0.1)), ((0.3, 0, 0), (0, -1, 0.2), 0.9 * swing), ((0.26, 0, 0), (1, 0, 0), slow(0.4))]


def sway(rng, time):
    """Standing and lying about, with sudden bursts."""
    count = len(time)
    burst = spells(rng, count, (0.6, 2.5), (3, 11), 0.15)
    axis = lambda calm, wild: calm * wander(rng, count, 0.05, 0.6) + wild * burst * wander(rng, count, 0.4, 2.4)
    base = np.stack([axis(0.01, 0.05), axis(0.01, 0.05), axis(0.004, 0.03)], 1)
    return base, [((0, 0, 1), (0, 0, 1), axis(0.03, 0.5)), ((0.05, 0, 0.1), (0, 1, 0), axis(0.03, 0.4)), ((0.2, 0, 0), (1, 0, 0), axis(0.02, 0.5))]


def ride(rng, time):
    """A bicycle on rough ground: speed, bends with lean, shaking of the frame."""
    count = len(time)
    speed = 4.0 + 1.5 * wander(rng, count, 0.01, 0.2)
    bend = 0.08 * wander(rng, count, 0.02, 0.25)
    heading = np.cumsum(speed * bend) * STEP
    base = np.cumsum(np.stack([speed * np.cos(heading), speed * np.sin(heading), 0 * speed], 1), 0) * STEP
    base[:, 2] += 0.003 * wander(rng, count, 1.0, 7.0) + 0.3 * wander(rng, count, 0.01, 0.1)
    shake = lambda size: size * DEGREE * wander(rng, count, 0.4, 5.0)
    lean = gaussian_filter1d(np.arctan(speed**2 * bend / UP[2]), 200)
    return base, [((0, 0, 0), (0, 0, 1), heading + shake(2)), ((0, 0, 0), (1, 0, 0), -lean + shake(2.5)), ((0, 0, 0.6), (0, 1, 0), shake(1.5))]


def captured(rng, time):
    """A joint of a CMU clip, to and fro with eased ends, below 9 Hz; None without the data."""
    folder = os.environ.get("CROMOSIM_DATA") or os.path.join(HERE, "../../../shared/data")
    clips = sorted(glob.glob(os.path.join(folder, "mocap_cmu/*.npz")))
    if not clips:
        return None
    with np.load(clips[rng.integers(len(clips))]) as clip:
        joint, fps, first = int(rng.integers(1, clip["pos"].shape[1])), float(clip["fps"]), 20
        quaternion = clip["quat_wxyz"][first:-first, joint][:, [1, 2, 3, 0]].astype(float)
        both = np.hstack([clip["pos"][first:-first, joint].astype(float), quaternion])
    flip = np.cumprod(np.where((both[1:, 3:] * both[:-1, 3:]).sum(1) < 0, -1.0, 1.0))
    both[1:, 3:] *= flip[:, None]
    both = sosfiltfilt(butter(3, 9.0, fs=fps, output="sos"), both, axis=0)
    length = (len(both) - 1) / fps
    turn = 1.0  # s to turn about at an end
    saw = np.abs((time / (length - 2 * turn) + 1) % 2 - 1) * (length - 2 * turn) + turn
    saw = gaussian_filter1d(saw, 0.2 / STEP)
    value = CubicSpline(np.arange(len(both)) / fps, both)(np.clip(saw, 0, length))
    value = gaussian_filter1d(value, 8, axis=0)
    return value[:, :3], Rotation.from_quat(value[:, 3:])


MOTIONS = (gait, robot, tool, sway, ride, captured)


class Motion:
    """Poses on the dense grid, and what an IMU at the frame would feel, in segment axes."""

    def __init__(self, rng, kind, seconds):
        self.time = np.arange(-SPARE, seconds + SPARE, STEP)
        made = kind(rng, self.time) or gait(rng, self.time)
        if isinstance(made[1], Rotation):
            self.position, self.rotation = made
        else:
            self.position, self.rotation = made[0].copy(), Rotation.identity(len(self.time))
            for offset, axis, angle in made[1]:
                self.position += self.rotation.apply(offset)
                self.rotation = self.rotation * Rotation.from_rotvec(angle[:, None] * (np.array(axis) / np.linalg.norm(axis)))
        self.acceleration = derivative(derivative(self.position))
        turns = {k: (self.rotation[:-2 * k].inv() * self.rotation[2 * k:]).as_rotvec() for k in (1, 2, 3)}
        self.rate = np.zeros_like(self.position)
        inner = slice(3, -3)
        for k, weight in ((1, 1.5), (2, -0.6), (3, 0.1)):  # 6th order, from the chords over 2k steps
            cut = 3 - k
            self.rate[inner] += weight * turns[k][cut:len(turns[k]) - cut] / (2 * k * STEP)
        self.rate[:3], self.rate[-3:] = self.rate[3], self.rate[-4]
        self.change = derivative(self.rate)

    def pose(self, times):
        return CubicSpline(self.time, self.position)(times), Slerp(self.time, self.rotation)(times)


def derivative(value):
    """Eighth-order central difference; the ends, which nobody reads, stand still."""
    out = np.zeros_like(value)
    for k, weight in enumerate((4 / 5, -1 / 5, 4 / 105, -1 / 280), 1):
        out[4:-4] += weight * (value[4 + k:len(value) - 4 + k] - value[4 - k:len(value) - 4 - k])
    return out / STEP
