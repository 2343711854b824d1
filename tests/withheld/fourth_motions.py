"""Motions for the fourth suite: what people, animals, tools and machines do while somebody records them.

A motion is made on a 2 kHz grid; the grid's poses are the control points of a uniform quintic B-spline (position, and a quaternion that is
normalised afterwards), and that spline is the truth: position, velocity, acceleration, angular velocity and acceleration all come from it exactly.
Every family returns several segments of one body, so that one or three of them can carry an IMU. Quaternions are xyzw, world from segment; z is up.
"""
from math import comb

import numpy as np
from scipy.ndimage import uniform_filter1d
from scipy.spatial.transform import Rotation

GRID = 2000.0
TAU = 2 * np.pi

# ---- quaternions and the spline ----------------------------------------------------------------------------------------------------------
def qmul(a, b):
    ax, ay, az, aw = np.moveaxis(np.asarray(a), -1, 0)
    bx, by, bz, bw = np.moveaxis(np.asarray(b), -1, 0)
    return np.stack([aw * bx + ax * bw + ay * bz - az * by, aw * by - ax * bz + ay * bw + az * bx,
                     aw * bz + ax * by - ay * bx + az * bw, aw * bw - ax * bx - ay * by - az * bz], -1)

def qturn(axis, angle):
    """Rotation by angle(s) about a coordinate axis (0, 1, 2)."""
    q = np.zeros(np.shape(angle) + (4,))
    q[..., axis], q[..., 3] = np.sin(angle / 2), np.cos(angle / 2)
    return q

def qrotate(q, v):
    v = np.broadcast_to(v, q.shape[:-1] + (3,))
    return v + q[..., 3:] * (twice := 2 * np.cross(q[..., :3], v)) + np.cross(q[..., :3], twice)

def rpy(angles):
    """Columns roll, pitch, yaw -> Rz(yaw) Ry(pitch) Rx(roll)."""
    return qmul(qmul(qturn(2, angles[:, 2]), qturn(1, angles[:, 1])), qturn(0, angles[:, 0]))

def _pieces():
    """Polynomials of the six pieces of the quintic B-spline and their first two derivatives: [derivative][tap, power]."""
    table = np.zeros((3, 6, 6))
    for tap in range(6):
        piece = np.zeros(6)
        for k in range(6 - tap):  # truncated powers: (u + 5 - tap - k)^5
            base = np.array([comb(5, m) * float(5 - tap - k) ** (5 - m) for m in range(6)])
            piece += (-1) ** k * comb(6, k) * base / 120
        for order in range(3):
            table[order, tap, :6 - order] = np.polynomial.polynomial.polyder(piece, order) if order else piece
    return table

PIECES = _pieces()

class Path:
    """The true motion of one segment's mount frame; times in seconds from the session's origin."""

    def __init__(self, start, position, quaternion):
        quaternion = quaternion.copy()
        flips = np.sum(quaternion[1:] * quaternion[:-1], axis=1) < 0
        quaternion[1:] *= np.where(np.cumsum(flips) % 2, -1.0, 1.0)[:, None]
        self.start, self.control = start, np.hstack([position, quaternion])
        self.end = start + (len(position) - 1) / GRID

    def at(self, times):
        """position, acceleration (world), quaternion, angular velocity, angular acceleration (segment axes)."""
        place = (np.asarray(times) - self.start) * GRID
        cell = np.floor(place).astype(np.int64)
        if cell.min() < 2 or cell.max() > len(self.control) - 4:
            raise ValueError("the motion is too short")
        powers = (place - cell)[:, None] ** np.arange(6)
        out = np.zeros((3, len(cell), 7))
        near = self.control[cell]  # differences from a near control point keep the rounding small
        for tap in range(6):
            points = self.control[cell + tap - 2] - near
            for order in range(3):
                out[order] += (powers @ PIECES[order, tap])[:, None] * points * GRID ** order
        out[0] += near
        u, du, ddu = out[:, :, 3:]
        norm = np.sum(u * u, axis=1, keepdims=True)
        inverse = u * np.array([-1.0, -1.0, -1.0, 1.0])
        omega = 2 * qmul(inverse, du)[:, :3] / norm
        alpha = 2 * qmul(inverse, ddu)[:, :3] / norm - 2 * omega * np.sum(u * du, axis=1, keepdims=True) / norm
        return out[0, :, :3], out[2, :, :3], u / np.sqrt(norm), omega, alpha

# ---- ingredients -------------------------------------------------------------------------------------------------------------------------
def soft(x, width):
    """Three running means of `width` seconds: close to a Gaussian of half that width."""
    for _ in range(3):
        x = uniform_filter1d(x, max(1, round(width * GRID)), axis=0, mode="nearest")
    return x

def noise(rng, n, low, high, columns=None):
    """Gaussian noise of unit standard deviation within a band (Hz)."""
    count = columns or 1
    size = 1 << (n - 1).bit_length()
    f = np.fft.rfftfreq(size, 1 / GRID)
    keep = np.flatnonzero((f > low * 0.6) & (f < high * 1.6))
    spectrum = np.zeros((len(f), count), complex)
    shape = 1 / np.sqrt(1 + (low / f[keep]) ** 6 + (f[keep] / high) ** 8)
    spectrum[keep] = (rng.normal(size=(len(keep), count)) + 1j * rng.normal(size=(len(keep), count))) * shape[:, None]
    x = np.fft.irfft(spectrum, size, axis=0)[:n]
    x /= np.sqrt(np.sum(shape ** 2)) * 2 / size
    return x if columns else x[:, 0]

def reach(s):
    return s ** 3 * (10 - 15 * s + 6 * s * s)

def moves(t, starts, durations, steps):
    """Minimum-jerk steps, one after another; steps may be vectors."""
    steps = np.asarray(steps, float)
    out = np.zeros((len(t),) + steps.shape[1:])
    for start, duration, step in zip(starts, durations, steps):
        i, j = np.searchsorted(t, [start, start + duration])
        s = reach((t[i:j] - start) / duration)
        out[i:j] += np.multiply.outer(s, step) if out.ndim > 1 else s * step
        out[j:] += step
    return out

def spans(rng, t, pause, length):
    """Starts and durations that follow each other: pause (lo, hi), then length (lo, hi)."""
    starts, durations, now = [], [], t[0] + rng.uniform(0.2, 2.0)
    while now < t[-1] - 1:
        starts.append(now := now + rng.uniform(*pause))
        durations.append(rng.uniform(*length))
        now += durations[-1]
    return np.array(starts), np.array(durations)

def wander(rng, t, pause, length, size, columns, back=0.5):
    """Moves between random places near zero: steps go to a new drawn target each time."""
    starts, durations = spans(rng, t, pause, length)
    targets = rng.uniform(-1, 1, (len(starts), columns)) * size * np.where(rng.random((len(starts), 1)) < back, 0.3, 1.0)
    return moves(t, starts, durations, np.diff(targets, axis=0, prepend=np.zeros((1, columns))))

def bouts(rng, t, on, off, edge=0.8):
    """An envelope between 0 and 1: active for `on` seconds, then idle for `off`."""
    starts, steps, now, state = [], [], t[0] - rng.uniform(0, 1) * on[1], 0
    while now < t[-1]:
        starts.append(now)
        steps.append(1 - 2 * state)
        state = 1 - state
        now += rng.uniform(*(on if state else off)) + edge
    return np.clip(moves(t, starts, [edge] * len(starts), steps), 0, 1)

def phase(rng, t, hz, envelope=1.0, unsteady=0.04):
    """Phase of a rhythm whose pace wanders."""
    pace = hz * envelope * (1 + unsteady * np.clip(noise(rng, len(t), 0.02, 0.3), -2.5, 2.5))
    return TAU * np.cumsum(pace) / GRID + rng.uniform(0, TAU)

def crossings(t, angle, at=0.0):
    """Times at which a phase passes 2 pi k + at."""
    return t[1:][np.diff(np.floor((angle - at) / TAU)) > 0]

def rings(rng, t, times, size, hz, tau, spread=0.3, columns=None):
    """Damped oscillations that start at the given times (impacts); `size` is their peak displacement or angle."""
    out = np.zeros((len(t), columns or 1))
    for time, i in zip(times, np.searchsorted(t, times)):
        s = t[i:i + int(7 * tau * GRID)] - time
        amplitude = size * np.exp(spread * rng.normal()) * (rng.normal(size=columns or 1) if columns else 1.0)
        out[i:i + len(s)] += np.multiply.outer(np.sin(TAU * hz * (1 + 0.05 * rng.normal()) * s) * np.exp(-s / tau), np.atleast_1d(amplitude))
    return out if columns else out[:, 0]

def peak(angle, sharp):
    """A rhythm of short pulses between 0 and 1."""
    return np.exp(sharp * (np.cos(angle) - 1))

def roll(rng, low, high):
    return np.exp(rng.uniform(np.log(low), np.log(high)))

def travel(t, speed, yaw):
    """Ground track of something that goes where it points."""
    return np.stack([np.cumsum(speed * np.cos(yaw)), np.cumsum(speed * np.sin(yaw)), np.zeros(len(t))], 1) / GRID

# ---- a person ----------------------------------------------------------------------------------------------------------------------------
class Person:
    """Angles of one side of a body; x forward, y left, z up. Flexions are positive; three-columns angles are (roll, pitch, yaw)."""

    def __init__(self, rng, t):
        n = len(t)
        self.p, self.turn = np.zeros((n, 3)), np.zeros((n, 3))
        self.p[:, 2] = 0.95
        self.spine, self.neck, self.shoulder, self.hip, self.wrist = np.zeros((n, 3)), np.zeros((n, 3)), np.zeros((n, 3)), np.zeros((n, 3)), np.zeros((n, 2))
        self.elbow, self.pronation, self.knee, self.ankle = np.full(n, 0.2), np.zeros(n), np.full(n, 0.08), np.zeros(n)
        calm = roll(rng, 0.5, 2.0)  # nobody holds quite still: sway, breath, physiological tremor
        self.p += calm * noise(rng, n, 0.1, 0.6, 3) * [0.004, 0.004, 0.001]
        self.turn += calm * 0.004 * noise(rng, n, 0.1, 0.8, 3)
        self.spine[:, 1] += 0.006 * np.sin(phase(rng, t, rng.uniform(0.18, 0.35), unsteady=0.1))
        liveliness = (self.spine, 0.005, 6e-5), (self.neck, 0.008, 1e-4), (self.shoulder, 0.008, 2e-4), (self.wrist, 0.012, 5e-4), (self.hip, 0.003, 6e-5)
        for part, slow, fast in liveliness:
            columns = part.shape[1]
            part += calm * (slow * noise(rng, n, 0.1, 1.0, columns) + fast * noise(rng, n, 7, 12, columns))

    def add(self, **parts):
        """Adds to angles and positions; a tuple holds one addend per column."""
        for key, value in parts.items():
            target = getattr(self, key)
            for column, own in enumerate(value if isinstance(value, tuple) else ()):
                target[:, column] += own
            if not isinstance(value, tuple):
                target += value
        return self

    def frames(self, width, names):
        """Only the wanted segments and what carries them."""
        s, out = {key: soft(value, width) for key, value in vars(self).items()}, {}
        limb = lambda x: qmul(qturn(1, -x[:, 0]), qmul(qturn(0, -x[:, 1]), qturn(2, x[:, 2])))
        def put(name, origin, q, offset):
            if name in names:
                out[name] = (origin + qrotate(q, offset), q)
        pelvis, at = rpy(s["turn"]), s["p"]
        put("pelvis", at, pelvis, [-0.1, 0, 0.05])
        if {"thigh", "shank", "foot"} & set(names):
            at, q = at + qrotate(pelvis, [0, -0.09, -0.06]), qmul(pelvis, limb(s["hip"]))
            put("thigh", at, q, [0.07, -0.03, -0.22])
            at, q = at + qrotate(q, [0, 0, -0.42]), qmul(q, qturn(1, s["knee"]))
            put("shank", at, q, [0.04, 0, -0.2])
            at, q = at + qrotate(q, [0, 0, -0.42]), qmul(q, qturn(1, -s["ankle"]))
            put("foot", at, q, [0.1, 0, -0.04])
        chest, at = qmul(pelvis, rpy(s["spine"])), s["p"] + qrotate(pelvis, [0, 0, 0.1])
        put("chest", at, chest, [0.1, 0, 0.25])
        if "head" in names:
            put("head", at + qrotate(chest, [0, 0, 0.45]), qmul(chest, rpy(s["neck"])), [0.02, 0.05, 0.17])
        if {"upper_arm", "wrist", "hand"} & set(names):
            at, q = at + qrotate(chest, [0, -0.19, 0.36]), qmul(chest, limb(s["shoulder"]))
            put("upper_arm", at, q, [0.01, -0.05, -0.16])
            at, q = at + qrotate(q, [0, 0, -0.3]), qmul(q, qmul(qturn(1, -s["elbow"]), qturn(2, s["pronation"])))
            put("wrist", at, q, [0, -0.03, -0.23])
            at, q = at + qrotate(q, [0, 0, -0.26]), qmul(q, qmul(qturn(1, s["wrist"][:, 0]), qturn(0, s["wrist"][:, 1])))
            put("hand", at, q, [0.01, -0.02, -0.07])
        return out


def seated(rng, t):
    return Person(rng, t).add(p=(0, 0, -0.4), hip=(1.5, 0, 0), knee=1.4, elbow=0.4)

def gait(rng, t, run=False):
    """Walking or jogging about with stops and turns; every second heel strike is this leg's."""
    b, go = Person(rng, t), bouts(rng, t, (6, 30), (1, 6), 1.2)
    pace, big = (rng.uniform(1.25, 1.5), 1.4) if run else (rng.uniform(0.7, 1.05), 1.0)
    a = phase(rng, t, pace, go)
    yaw = wander(rng, t, (2, 9), (1.0, 2.5), 2.6, 1, 0.2)[:, 0]
    own, other = crossings(t, a, 1.7), crossings(t, a, 1.7 + np.pi)
    both, hard = np.r_[own, other], roll(rng, 0.4, 1.2) * (1.2 if run else 1.0)
    b.add(p=travel(t, go * pace * (1.9 if run else 1.25), yaw))
    b.add(p=(0, 0, go * (0.035 if run else 0.018) * np.cos(2 * a + 0.4) - rings(rng, t, both, 0.0012 * hard, rng.uniform(8, 12), 0.05)),
          turn=(go * 0.05 * np.sin(a + 0.3), go * 0.03 * np.sin(2 * a), yaw + go * 0.08 * np.sin(a)), spine=(0, 0, -go * 0.1 * np.sin(a)),
          hip=(go * big * (0.38 * np.sin(a) + 0.06 * np.sin(2 * a + 0.8) + 0.05), 0, 0),
          knee=go * (0.95 * peak(a - 5.2, 2.2) + 0.25 * peak(a - 1.9, 3)) + rings(rng, t, own, 0.02 * hard, rng.uniform(10, 15), 0.04),
          ankle=go * (0.2 * np.sin(a - 0.6) + 0.15 * np.sin(2 * a + 1)) - rings(rng, t, own, 0.03 * hard, rng.uniform(8, 13), 0.04),
          shoulder=(-go * big * 0.3 * np.sin(a), 0, 0), elbow=go * ((1.3 if run else 0.25) + 0.2 * np.sin(a + 2.8)),
          neck=(0, rings(rng, t, both, 0.004 * hard, 6, 0.08), 0))
    return b

def wheelchair(rng, t):
    b, go = seated(rng, t), bouts(rng, t, (5, 25), (2, 6), 1.5)
    a, yaw = phase(rng, t, rng.uniform(0.8, 1.2), go), wander(rng, t, (2, 8), (1.0, 3.0), 2.8, 1)[:, 0]
    speed = go * (rng.uniform(0.8, 1.6) + 0.18 * np.sin(a - 1))
    seams = crossings(t, TAU * np.cumsum(speed) / GRID / rng.uniform(1.5, 5))
    b.add(p=travel(t, soft(speed, 0.2), yaw))
    b.add(p=(0, 0, rings(rng, t, seams, 0.0015, rng.uniform(7, 11), 0.07) + go * 2e-4 * noise(rng, len(t), 6, 20)), turn=(0, go * 2e-3 * noise(rng, len(t), 4, 12), yaw),
          spine=(0, 0.25 + go * 0.15 * np.sin(a + 0.5), 0), elbow=0.6 - go * 0.5 * np.sin(a + 0.4), pronation=go * 0.3 * np.sin(a + 1),
          shoulder=(-0.35 + go * (0.55 * np.sin(a) + 0.1 * np.sin(2 * a)), 0.3 + go * 0.15 * np.cos(a), 0))
    return b

def cyclist(rng, t):
    b, go, road = Person(rng, t), bouts(rng, t, (10, 40), (2, 6), 1.5), roll(rng, 0.3, 1.5)
    a, lean = phase(rng, t, rng.uniform(1.0, 1.7), go), 0.2 * noise(rng, len(t), 0.03, 0.25)
    yaw = np.cumsum(lean) / GRID * 1.2
    b.add(p=travel(t, rng.uniform(3, 8) * (0.4 + 0.6 * go), yaw))
    b.add(p=(0, 0, road * (1.5e-4 * noise(rng, len(t), 8, 22) + 0.002 * noise(rng, len(t), 1, 5))),
          turn=(lean + go * 0.05 * np.sin(a), road * 0.004 * noise(rng, len(t), 2, 9), yaw), spine=(0, rng.uniform(0.5, 0.9), 0), neck=(0, -0.4, 0),
          hip=(1.0 + 0.38 * np.sin(a), 0, 0), knee=1.2 + 0.62 * np.sin(a + 0.25), ankle=0.15 * np.sin(a - 0.5),
          shoulder=(1.2, go * 0.03 * np.sin(a), 0), elbow=0.3 + road * 0.006 * noise(rng, len(t), 5, 14))
    return b

def tremor(rng, t):
    """A patient at a table: rest tremor, now and then a reach that damps it."""
    b, starts = seated(rng, t), spans(rng, t, (2, 9), (0.9, 1.8))
    a, size = phase(rng, t, rng.uniform(3.8, 6.5), unsteady=0.03), rng.uniform(0.02, 0.09)
    shake = size * (0.3 + 0.7 * bouts(rng, t, (4, 20), (2, 8), 1.0)) * np.clip(1 + 0.3 * noise(rng, len(t), 0.1, 0.8), 0.1, 2)
    way = moves(t, *starts, np.where(np.arange(len(starts[0])) % 2, -1, 1)[:, None] * rng.uniform(0.4, 0.9, (1, 3)))
    b.add(shoulder=way * [1.2, 0.4, 0.5] + np.outer(shake * np.sin(a + 0.4), [0.3, 0.2, 0.5]), elbow=0.8 - 0.6 * way[:, 0] + shake * 0.3 * np.sin(a),
          pronation=shake * (1.6 * np.sin(a + 0.7) + 0.2 * np.sin(2 * a)), wrist=(shake * np.sin(a + 1.5), shake * 0.5 * np.sin(a + 2.2)), spine=(0, 0.1 * way[:, 1], 0))
    return b

def gym(rng, t):
    """Sets of repetitions: curls, lifts or squats with a pause between sets."""
    b, go, kind = Person(rng, t), bouts(rng, t, (12, 25), (3, 9), 1.0), rng.integers(3)
    a = phase(rng, t, rng.uniform(0.3, 0.7), np.maximum(go, 0.02), 0.08)
    up = go * (0.5 - 0.5 * np.cos(a + 0.4 * np.sin(a)))
    squat, strain = up * (0.15, 0.2, 1.0)[kind], (go * 0.5 + up)[:, None]
    b.add(elbow=up * (2.0 if kind == 0 else 0.5), shoulder=(up * (0.3 if kind == 0 else 1.6), up * (0.05, 1.3, 0.2)[kind], 0), pronation=up * 0.6,
          hip=(1.5 * squat, 0, 0), knee=1.8 * squat, ankle=0.5 * squat, spine=(0, 0.4 * squat, 0),
          p=(-0.12 * squat, 0, -0.42 * squat + rings(rng, t, crossings(t, a, 0.2), 6e-4, 7, 0.08)), turn=(0, 0, wander(rng, t, (8, 20), (1, 2), 0.6, 1)[:, 0]))
    return b.add(wrist=0.002 * strain * noise(rng, len(t), 6, 12, 2), shoulder=0.001 * strain * noise(rng, len(t), 5, 11, 3))

def dance(rng, t):
    """On the beat, with spins, hits and changes of direction."""
    b, beat = Person(rng, t), rng.uniform(1.5, 2.2)
    a, ticks = phase(rng, t, beat / 2, unsteady=0.005), np.arange(t[0], t[-1], 1 / beat)
    def hits(columns, size, every):
        chosen = ticks[::every] + 0.02 * rng.normal(size=len(ticks[::every]))
        targets = rng.uniform(-1, 1, (len(chosen), columns)) * size
        return moves(t, chosen, rng.uniform(0.3, 0.5, len(chosen)), np.diff(targets, axis=0, prepend=np.zeros((1, columns))))
    spins = np.sort(rng.choice(ticks[8:-4:8], max(1, len(ticks) // 24), replace=False))
    b.add(shoulder=hits(3, [0.9, 0.5, 0.5], 1) + [0.5, 0.4, 0], elbow=0.8 + hits(1, 0.6, 1)[:, 0], pronation=hits(1, 0.7, 2)[:, 0], neck=hits(3, [0.1, 0.2, 0.4], 2),
          spine=hits(3, [0.12, 0.15, 0.3], 2), hip=hits(3, [0.35, 0.15, 0.25], 1) + [0.3, 0, 0], knee=0.4 + 0.15 * (1 + np.cos(2 * a)) + 0.2 * hits(1, 1.0, 1)[:, 0], p=hits(3, [0.15, 0.15, 0.0], 4),
          turn=(0, 0, hits(1, 0.5, 2)[:, 0] + moves(t, spins, [rng.uniform(0.9, 1.4)] * len(spins), rng.choice([-1, 1], len(spins)) * TAU)))
    return b.add(p=(0, 0, 0.025 * np.cos(2 * a) - rings(rng, t, ticks, 5e-4, 9, 0.05)))

def head_turns(rng, t):
    """Someone seated looks about: quick turns of the head, long looks, nods; an office chair."""
    nod = bouts(rng, t, (1, 3), (4, 15), 0.3) * 0.2 * np.sin(phase(rng, t, rng.uniform(1.5, 2.6)))
    b = seated(rng, t).add(neck=wander(rng, t, (0.3, 3.0), (0.25, 0.7), [0.15, 0.45, 1.1], 3, 0.4), spine=wander(rng, t, (4, 12), (0.7, 2), [0.15, 0.25, 0.5], 3),
                           shoulder=wander(rng, t, (2, 8), (0.5, 1.2), [0.9, 0.4, 0.5], 3), elbow=0.8 + wander(rng, t, (2, 8), (0.5, 1.2), 0.6, 1)[:, 0])
    return b.add(neck=(0, nod, 0), turn=(0, 0, wander(rng, t, (6, 20), (1, 2), 0.8, 1)[:, 0]))

def typing(rng, t):
    """Bursts of keystrokes, hops over the keyboard, reaches for the mouse, a look aside."""
    b, go = seated(rng, t), bouts(rng, t, (4, 18), (1, 6), 0.3)
    keys = np.cumsum(rng.gamma(3, 0.06, int((t[-1] - t[0]) / 0.18) + 50)) + t[0]
    keys = keys[keys < t[-1] - 0.5]
    keys = keys[go[np.searchsorted(t, keys)] > 0.5]
    mouse = wander(rng, t, (5, 15), (0.5, 0.9), [0.5, 0.35, 0.8], 3, 0.3)
    b.add(wrist=(rings(rng, t, keys, 0.015, rng.uniform(7, 10), 0.05) + go * 0.02 * noise(rng, len(t), 1, 5), go * 0.05 * noise(rng, len(t), 0.5, 3)),
          shoulder=wander(rng, t, (0.5, 4), (0.25, 0.6), [0.12, 0.1, 0.25], 3) + mouse + [0.35, 0, 0], elbow=0.95 + rings(rng, t, keys, 0.002, 12, 0.04), pronation=1.2 + 0.4 * mouse[:, 2])
    return b.add(neck=wander(rng, t, (2, 8), (0.4, 0.8), [0.1, 0.3, 0.5], 3), spine=wander(rng, t, (8, 25), (0.8, 2.0), [0.08, 0.2, 0.15], 3))

def hammer(rng, t):
    """Series of blows: slow up, fast down, a shock that runs through the arm."""
    b, blows, turns, shock = Person(rng, t), [], wander(rng, t, (5, 15), (1, 2), 0.9, 1)[:, 0], roll(rng, 0.3, 1.0)
    now, lift = t[0] + 1.5, np.zeros(len(t))
    while now < t[-1] - 3:
        for _ in range(rng.integers(3, 9) if now < t[-1] - 12 else 1):
            up, down, height = rng.uniform(0.4, 0.7), rng.uniform(0.22, 0.32), rng.uniform(0.5, 0.9)
            lift += moves(t, [now, now + up + 0.04], [up, down], [height, -height])
            blows.append(now + up + 0.04 + down * 0.75)
            now += up + down + rng.uniform(0.1, 0.3)
        now += rng.uniform(1, 6)
    b.add(elbow=0.6 + lift + rings(rng, t, blows, 0.02 * shock, rng.uniform(8, 13), 0.05), shoulder=(0.5 + 0.6 * lift, 0.25 + 0.15 * lift, 0.5 * turns), turn=(0, 0, turns),
          wrist=(rings(rng, t, blows, 0.03 * shock, rng.uniform(10, 16), 0.05), 0.4 * lift), pronation=wander(rng, t, (3, 9), (0.5, 1.5), 0.8, 1)[:, 0],
          spine=(0, 0.35 - 0.15 * lift, 0), p=rings(rng, t, blows, 5e-4 * shock, 8, 0.08, columns=3))
    return b

def ladder(rng, t):
    """Up, rest, down: hands and feet in turn, a small shock at each rung."""
    b, (starts, durations) = Person(rng, t), spans(rng, t, (0.25, 0.7), (0.6, 1.0))
    direction, mine = np.where((np.arange(len(starts)) // rng.integers(6, 11)) % 2, -1, 1), np.arange(len(starts)) % 2 == 0
    def lifted(late):
        at, long, one = (starts + late * durations)[mine], durations[mine], np.ones(mine.sum())
        return moves(t, at, 0.5 * long, one) + moves(t, at + 0.55 * long, 0.6 * long, -one)
    arm, leg, land = lifted(0.0), lifted(0.3), starts + 0.95 * durations
    b.add(p=rings(rng, t, land, 8e-4, rng.uniform(7, 11), 0.06, columns=3), turn=(0.07 * soft(np.interp(t, starts, np.where(mine, 1.0, -1.0)), 0.4), 0, 0.1 * noise(rng, len(t), 0.05, 0.4)),
          shoulder=(1.2 + 1.1 * arm + rings(rng, t, land[1::2], 0.012, 9, 0.06), 0.15 + 0.3 * arm, 0), elbow=0.9 - 0.5 * arm, pronation=0.5 + 0.4 * arm,
          hip=(0.3 + leg, 0, 0.2 * leg), knee=0.4 + 1.2 * leg, ankle=rings(rng, t, land[::2], 0.03, 10, 0.05))
    return b.add(p=(0, 0, moves(t, starts, durations, 0.28 * direction)))

def fall(rng, t):
    """Standing and pottering, then a fall, some seconds on the floor, and slowly up again; sometimes twice."""
    b = Person(rng, t).add(turn=(0, 0, wander(rng, t, (2, 6), (1, 2), 1.5, 1)[:, 0]), shoulder=wander(rng, t, (1, 5), (0.6, 1.3), [1.0, 0.5, 0.5], 3),
                           elbow=0.4 + wander(rng, t, (1, 5), (0.6, 1.3), 0.5, 1)[:, 0], spine=wander(rng, t, (3, 9), (0.8, 2), [0.1, 0.4, 0.4], 3))
    for at in t[0] + (t[-1] - t[0]) * (np.array([0.2, 0.55]) + rng.uniform(0, 0.15, 2))[:rng.integers(1, 3)]:
        drop, way, hit = rng.uniform(0.6, 0.9), rng.choice([-1, 1]), []
        down = moves(t, [at, at + rng.uniform(4, 9)], [drop, rng.uniform(2.5, 5)], [1, -1])
        hit.append(at + 0.85 * drop)
        b.add(p=(0.4 * way * down, 0, -0.8 * down), turn=(rng.uniform(-0.5, 0.5) * down, way * rng.uniform(1.2, 1.5) * down, 0), shoulder=(1.2 * down, 0, 0), hip=(0.6 * down, 0, 0), knee=0.7 * down)
        b.add(p=rings(rng, t, hit, 0.004, rng.uniform(6, 9), 0.08, columns=3), turn=rings(rng, t, hit, 0.02, 7, 0.08, columns=3))
    return b

def still(rng, t):
    """Seated for long, with rare movements: a cup, a shift on the chair, a scratch."""
    return seated(rng, t).add(shoulder=wander(rng, t, (4, 14), (0.6, 1.5), [1.1, 0.5, 0.7], 3, 0.2), elbow=0.8 + wander(rng, t, (4, 14), (0.6, 1.5), 0.7, 1)[:, 0],
                              pronation=wander(rng, t, (4, 14), (0.5, 1.2), 1.0, 1)[:, 0], spine=wander(rng, t, (9, 25), (0.8, 2), [0.2, 0.35, 0.3], 3),
                              neck=wander(rng, t, (3, 10), (0.4, 0.9), [0.15, 0.4, 0.7], 3), hip=wander(rng, t, (9, 25), (0.8, 2), [0.25, 0.15, 0.2], 3),
                              turn=wander(rng, t, (12, 30), (0.8, 2), [0.1, 0.15, 0.3], 3))

def tai_chi(rng, t):
    b, a = Person(rng, t), phase(rng, t, rng.uniform(0.08, 0.14), unsteady=0.15)
    b.add(p=(0.3 * np.sin(a / 2), 0.2 * np.sin(a), -0.1 - 0.05 * np.cos(a)), turn=(0, 0, 0.9 * np.sin(a / 2 + 1) + wander(rng, t, (6, 14), (3, 5), 0.8, 1)[:, 0]),
          shoulder=(0.8 + 0.7 * np.sin(a), 0.4 + 0.35 * np.cos(a), 0.5 * np.sin(2 * a)), elbow=0.7 + 0.5 * np.cos(a + 1), pronation=1.1 * np.sin(a + 0.5),
          hip=(0.5 + 0.4 * np.sin(a / 2), 0.15 + 0.1 * np.cos(a / 2), 0.3 * np.sin(a / 2)), knee=0.7 + 0.35 * np.cos(a / 2), spine=wander(rng, t, (2, 6), (2, 4), [0.1, 0.2, 0.4], 3))
    return b.add(shoulder=wander(rng, t, (2, 5), (2, 4), [0.5, 0.3, 0.4], 3), wrist=wander(rng, t, (1, 4), (1.5, 3), [0.5, 0.3], 2))

def punches(rng, t):
    """Boxing at a bag: guard, bursts of straight and round punches, footwork."""
    b, go, (starts, durations) = Person(rng, t), bouts(rng, t, (3, 9), (2, 7), 0.5), spans(rng, t, (0.3, 1.0), (0.35, 0.6))
    keep = go[np.clip(np.searchsorted(t, starts), 0, len(t) - 1)] > 0.5
    starts, durations = np.r_[t[0] + 0.1, starts[keep]], np.r_[0.5, durations[keep]]
    one, hit = np.ones(len(starts)), starts + durations * 0.4
    out, hook = moves(t, starts, durations * 0.5, one) - moves(t, starts + durations * 0.55, durations * 0.8, one), soft(np.interp(t, starts, rng.random(len(starts))), 0.3)
    b.add(shoulder=(0.5 + 0.8 * out, 0.2 + 0.6 * out * hook, -0.4 * out), elbow=1.7 - 1.2 * out * (1 - 0.5 * hook) + rings(rng, t, hit, 0.015, 10, 0.05), pronation=1.0 * out,
          wrist=rings(rng, t, hit, 0.03, rng.uniform(9, 14), 0.05, columns=2), spine=(0, 0, 0.4 * out), turn=(0, 0, wander(rng, t, (1, 4), (0.4, 1), 1.0, 1)[:, 0] + 0.2 * out),
          hip=wander(rng, t, (0.5, 2), (0.4, 0.7), [0.4, 0.2, 0.2], 3), knee=0.4 + wander(rng, t, (0.5, 2), (0.4, 0.7), 0.3, 1)[:, 0], p=wander(rng, t, (0.5, 3), (0.5, 0.9), [0.3, 0.3, 0.0], 3))
    return b.add(p=(0, 0, 0.015 * go * np.cos(phase(rng, t, rng.uniform(1.8, 2.4)))))

# ---- machines and animals ----------------------------------------------------------------------------------------------------------------
def mounted(rng, n, p, q, offsets, loose=1.0):
    """Several places on one body that is almost stiff: each gives a little of its own."""
    out = {}
    for name, offset in offsets.items():
        shiver = qmul(q, rpy(loose * roll(rng, 2e-4, 2e-3) * noise(rng, n, 3, 12, 3)))
        out[name] = (p + qrotate(q, offset) + loose * roll(rng, 3e-5, 3e-4) * noise(rng, n, 3, 12, 3), shiver)
    return out

def robot_arm(rng, t, width):
    """Six joints, trapezoidal speeds rounded to S-curves, dwells, and a little ringing at each stop."""
    angles = np.zeros((len(t), 6)) + [0.3, -1.0, 1.4, -0.4, 1.2, 0.0]
    starts, now, at = [], t[0] + 0.5, np.zeros(6)
    speed, ramp = roll(rng, 0.5, 2.5), rng.uniform(0.1, 0.35)
    while now < t[-1] - 1:
        target = rng.uniform(-1, 1, 6) * [1.4, 0.6, 0.7, 0.9, 0.9, 2.2]
        duration = max(np.abs(target - at).max() / speed, 2.2 * ramp)
        i, j = np.searchsorted(t, [now, now + duration])
        s = t[i:j] - now
        trapezoid = np.clip(np.minimum(s, duration - s) / ramp, 0, 1)
        angles[i:j] += np.outer(np.cumsum(trapezoid) / max(trapezoid.sum(), 1), target - at)
        angles[j:] += target - at
        at = target
        now += duration + (rng.uniform(0.1, 0.4) if rng.random() < 0.6 else rng.uniform(0.8, 4.0))
        starts.append(now)
    angles = soft(angles, rng.uniform(0.02, 0.07))
    angles += rings(rng, t, starts, 1.5e-3, rng.uniform(7, 14), 0.12, columns=6) + 4e-5 * noise(rng, len(t), 5, 20, 6)
    angles = soft(angles, width)
    q, p, out = np.tile([0.0, 0, 0, 1], (len(t), 1)), np.zeros((len(t), 3)), {}
    links = ((2, [0, 0, 0.16]), (1, [0, 0.13, 0]), (1, [0, -0.1, 0.42]), (1, [0, 0, 0.39]), (2, [0, 0.1, 0]), (1, [0, 0, 0.1]))
    for joint, (axis, offset) in enumerate(links):
        p = p + qrotate(q, offset)
        q = qmul(q, qturn(axis, angles[:, joint]))
        if joint in (2, 3, 5):
            name, lever = {2: ("link3", [0.06, 0, 0.2]), 3: ("link4", [0.05, 0, 0.03]), 5: ("tool0", [0.03, 0, 0.14])}[joint]
            out[name] = (p + qrotate(q, lever), q)
    return out

def quadruped(rng, t, width):
    """A legged robot at a trot: body, thigh and shank; stance, swing and touch-downs."""
    go = bouts(rng, t, (5, 20), (2, 5), 1.0)
    a = phase(rng, t, rng.uniform(1.4, 2.4), go, 0.02)
    yaw = wander(rng, t, (2, 6), (1.5, 3), 2.0, 1)[:, 0]
    p = travel(t, go * rng.uniform(0.4, 1.2), yaw) + [0, 0, 0.5]
    p[:, 2] += go * 0.012 * np.cos(2 * a)
    land = np.r_[crossings(t, a, 1.0), crossings(t, a, 1.0 + np.pi)]
    p[:, 2] -= rings(rng, t, land, 8e-4 * roll(rng, 0.5, 2), rng.uniform(9, 14), 0.05)
    turn = np.stack([go * 0.04 * np.sin(a), go * 0.03 * np.sin(2 * a + 0.6), yaw], 1) + 0.004 * noise(rng, len(t), 0.3, 5, 3)
    turn[:, :2] += wander(rng, t, (4, 10), (0.8, 2), 0.3, 2) * (1 - go)[:, None] + rings(rng, t, land, 0.004, 10, 0.05, columns=2)
    swing = peak(a - 4.0, 1.5)
    hip = soft(0.8 + go * (0.35 * np.sin(a) + 0.1 * swing) + rings(rng, t, land[::2], 0.01, 14, 0.04), width)
    knee = soft(1.5 + go * 0.6 * swing + rings(rng, t, land[::2], 0.02, 13, 0.04), width)
    ab = soft(go * 0.08 * np.sin(a + 1) + 0.01 * noise(rng, len(t), 0.5, 4), width)
    p, q = soft(p, width), rpy(soft(turn, width))
    hip_at = p + qrotate(q, [0.19, 0.14, 0])
    thigh = qmul(q, qmul(qturn(0, ab), qturn(1, hip)))
    shank = qmul(thigh, qturn(1, -knee))
    return {"trunk": (p + qrotate(q, [0.05, 0, 0.06]), q), "fl_thigh": (hip_at + qrotate(thigh, [0, 0.04, -0.1]), thigh),
            "fl_calf": (hip_at + qrotate(thigh, [0, 0, -0.21]) + qrotate(shank, [0.02, 0, -0.12]), shank)}

def dog(rng, t, width):
    """Collar, harness and rump of a dog: trot, sniffing with the head down, lying, and the wet shake."""
    n, go = len(t), bouts(rng, t, (3, 15), (2, 10), 0.8)
    a = phase(rng, t, rng.uniform(1.8, 2.6), go)
    yaw = wander(rng, t, (1, 5), (0.6, 2), 3.0, 1)[:, 0]
    p = travel(t, go * rng.uniform(1.2, 2.4), yaw) + [0, 0, 0.55]
    p[:, 2] += go * 0.02 * np.cos(2 * a) - rings(rng, t, crossings(t, 2 * a), 8e-4, 9, 0.05)
    shake = bouts(rng, t, (1.0, 2.2), (9, 25), 0.4) * np.sin(phase(rng, t, rng.uniform(4.2, 5.5), unsteady=0.02))
    body = np.stack([go * 0.05 * np.sin(a) + 0.22 * shake, go * 0.04 * np.sin(2 * a), yaw], 1) + 0.01 * noise(rng, n, 0.3, 4, 3)
    body[:, 1] += wander(rng, t, (6, 15), (0.7, 1.5), 0.4, 1)[:, 0]
    head = wander(rng, t, (0.6, 4), (0.3, 0.8), [0.3, 0.8, 0.9], 3)
    head += np.stack([0.35 * shake, go * 0.08 * np.sin(2 * a + 1), 0.1 * shake], 1) + 0.02 * noise(rng, n, 1, 8, 3)
    q, p = rpy(soft(body, width)), soft(p, width)
    neck = qmul(q, rpy(soft(head, width)))
    slide = soft(np.outer(shake, [0, 0.012, 0.006]) + 0.0015 * noise(rng, n, 1, 8, 3), width)
    out = mounted(rng, n, p, q, {"harness": [0.12, 0, 0.12], "rump": [-0.3, 0.02, 0.1]})
    out["collar"] = (p + qrotate(q, [0.25, 0, 0.1]) + qrotate(neck, slide + [0.08, 0, -0.03]), neck)
    return out

def power_tool(rng, t, width):
    """A sander or a saw in the hand: strokes along a plank, the tool's own orbit at 9 to 18 Hz, pauses and re-gripping."""
    n, go = len(t), bouts(rng, t, (4, 15), (2, 7), 0.5)
    a = phase(rng, t, rng.uniform(0.5, 1.2), np.maximum(go, 0.03), 0.1)
    orbit, size = phase(rng, t, rng.uniform(9, 18), unsteady=0.01), go * roll(rng, 3e-4, 1.2e-3)
    p = np.stack([go * 0.18 * np.sin(a), 0.05 * np.sin(a / 3), 0.02 * go * np.sin(2 * a)], 1) + wander(rng, t, (2, 8), (0.7, 1.6), [0.3, 0.4, 0.25], 3) + [0.4, 0, 1.0]
    p += np.stack([size * np.cos(orbit), size * np.sin(orbit), 0.3 * size * np.sin(2 * orbit)], 1) * np.clip(1 + 0.2 * noise(rng, n, 0.3, 2), 0.3, 2)[:, None]
    turn = wander(rng, t, (1.5, 6), (0.6, 1.5), [0.8, 0.7, 1.2], 3) + 0.03 * noise(rng, n, 0.3, 4, 3)
    turn += np.stack([go * 0.1 * np.sin(a), go * 0.08 * np.cos(a), go * 0.2 * np.sin(a + 1)], 1)
    turn += np.stack([8 * size * np.sin(orbit + 1), 8 * size * np.cos(orbit), 4 * size * np.sin(orbit)], 1)
    p, q = soft(p, min(width, 0.012)), rpy(soft(turn, min(width, 0.012)))
    return mounted(rng, n, p, q, {"tool": [0.05, 0, 0.06], "grip": [-0.1, 0.02, 0.08], "battery": [-0.15, 0, -0.05]}, 1.5)

def drone(rng, t, width):
    """Waypoints with tilt where the thrust must point, gusts, yaw, and the wobble of the controller."""
    n = len(t)
    p = wander(rng, t, (0.4, 3), (1.2, 2.6), [3, 3, 1.2], 3, 0.2) + [0, 0, 3]
    p = soft(p + noise(rng, n, 0.1, 1.0, 3) * [0.05, 0.05, 0.02], 0.06)
    thrust = np.gradient(np.gradient(p, 1 / GRID, axis=0), 1 / GRID, axis=0) + [0, 0, 9.80665]
    yaw = wander(rng, t, (2, 7), (1, 3), 2.5, 1)[:, 0]
    ahead, left = thrust[:, 0] * np.cos(yaw) + thrust[:, 1] * np.sin(yaw), -thrust[:, 0] * np.sin(yaw) + thrust[:, 1] * np.cos(yaw)
    turn = np.stack([-np.arctan2(left, np.hypot(ahead, thrust[:, 2])), np.arctan2(ahead, thrust[:, 2]), yaw], 1)
    turn += noise(rng, n, 1.5, 6, 3) * [0.012, 0.012, 0.006] + noise(rng, n, 12, 20, 3) * 6e-4 * roll(rng, 0.3, 1.5)
    p = p + noise(rng, n, 12, 20, 3) * 3e-5 * roll(rng, 0.3, 1.5)
    return mounted(rng, n, soft(p, width), rpy(soft(turn, width)), {"fc": [0.02, 0, 0.03], "gimbal": [0.12, 0, -0.08], "arm1": [0.18, 0.18, 0.01]})

def boat(rng, t, width):
    """Irregular waves, slams into them, a wandering course."""
    n, sea, hz = len(t), roll(rng, 0.4, 1.5), rng.uniform(0.12, 0.3)
    yaw = 0.2 * noise(rng, n, 0.01, 0.06) + wander(rng, t, (8, 25), (4, 9), 1.2, 1)[:, 0] + sea * 0.04 * noise(rng, n, hz, 2 * hz)
    waves = noise(rng, n, hz, 1.8 * hz, 4)
    chop = noise(rng, n, 0.6, 2.5, 6)
    p = travel(t, rng.uniform(1, 4) + 0.3 * waves[:, 3], yaw)
    p += np.stack([0 * yaw, 0.15 * sea * waves[:, 1], 0.35 * sea * waves[:, 0]], 1) + 0.012 * sea * chop[:, :3]
    turn = np.stack([0.16 * sea * waves[:, 1], 0.1 * sea * waves[:, 2], yaw], 1) + 0.02 * sea * chop[:, 3:]
    slam = np.sort(rng.uniform(t[0], t[-1], int((t[-1] - t[0]) / rng.uniform(4, 15))))
    p[:, 2] += rings(rng, t, slam, 0.003 * sea, rng.uniform(4, 8), 0.12)
    turn[:, 1] += rings(rng, t, slam, 0.008 * sea, rng.uniform(4, 8), 0.12)
    turn += noise(rng, n, 8, 16, 3) * 2e-4  # the engine
    return mounted(rng, n, soft(p, width), rpy(soft(turn, width)), {"hull": [0.5, 0, 0.2], "mast": [0.3, 0, 4.0], "cabin": [-1.2, 0.6, 1.1]})

def car(rng, t, width):
    """Town driving: braking, corners, lane changes, speed bumps, rough patches; the body rolls and pitches on its springs."""
    n = len(t)
    speed = np.maximum(6 + wander(rng, t, (1, 5), (2, 4), 5, 1, 0.2)[:, 0], 0.0)
    speed = soft(speed, 0.3)
    bend = wander(rng, t, (1, 6), (1, 2.5), 0.09, 1)[:, 0] + 0.01 * noise(rng, n, 0.1, 0.6)
    yaw = np.cumsum(speed * bend) / GRID
    push = np.gradient(speed, 1 / GRID)
    rough = 0.4 + bouts(rng, t, (3, 9), (4, 15), 1.0) * roll(rng, 0.5, 2)
    go = np.clip(speed / 6, 0, 1.5)
    p = travel(t, speed, yaw)
    bumps = np.cumsum(rng.uniform(4, 16, int((t[-1] - t[0]) / 8) + 2)) + t[0]
    p[:, 2] += go * rough * (0.004 * noise(rng, n, 0.9, 2.2) + 1.3e-4 * noise(rng, n, 8, 15)) + rings(rng, t, bumps, 0.025, 1.4, 0.35) + rings(rng, t, bumps, 0.002, 9, 0.08)
    turn = np.stack([-0.012 * np.clip(speed ** 2 * bend, -6, 6), -0.012 * push, yaw], 1)
    turn += (go * rough)[:, None] * (0.006 * noise(rng, n, 0.8, 2.5, 3) * [1, 0.7, 0.1] + 3e-4 * noise(rng, n, 7, 14, 3))
    turn[:, 1] += rings(rng, t, bumps, 0.02, 1.6, 0.3) + rings(rng, t, bumps + 0.35, -0.015, 1.6, 0.3)
    turn[:, :2] += wander(rng, t, (5, 15), (2, 5), 0.06, 2)  # the street's slope
    return mounted(rng, n, soft(p, width), rpy(soft(turn, width)), {"chassis": [0.2, 0, 0.4], "dashboard": [0.9, 0.3, 0.8], "seat": [-0.3, 0.4, 0.6]})

def swing(rng, t, width):
    """A playground swing or a crane's hook: a long pendulum that is pumped, slows down, twists and knocks."""
    n, length = len(t), rng.uniform(1.6, 3.0)
    force = rng.uniform(0.25, 0.8) * (0.15 + bouts(rng, t, (8, 25), (4, 12), 5.0))
    a = phase(rng, t, np.sqrt(9.81 / length) / TAU, unsteady=0.01)
    fore, side = force * np.sin(a) + 0.01 * force * np.sin(3 * a), 0.05 * np.sin(a * 1.02 + 1) + 0.02 * noise(rng, n, 0.1, 0.6)
    twist = 0.3 * noise(rng, n, 0.05, 0.4) + wander(rng, t, (5, 14), (1, 3), 1.0, 1)[:, 0]
    knocks = crossings(t, a, 0.3)[::3]
    fore = fore + rings(rng, t, knocks, 0.004, rng.uniform(5, 9), 0.1)
    q = qmul(qmul(qturn(1, soft(fore, width)), qturn(0, soft(side, width))), qturn(2, soft(twist, width)))
    p = qrotate(q, [0.0, 0.0, -length]) + [0, 0, length + 0.4] + soft(4e-4 * noise(rng, n, 2, 9, 3), width)
    return mounted(rng, n, p, q, {"seat": [0.1, 0.15, 0.02], "rope": [0, 0.25, 0.9], "rider": [0.05, 0, 0.4]}, 1.5)

PEOPLE = {f.__name__: f for f in (gait, wheelchair, cyclist, tremor, gym, dance, head_turns, typing, hammer, ladder, fall, still, tai_chi, punches)}
PEOPLE["jog"] = lambda rng, t: gait(rng, t, run=True)
OTHERS = {f.__name__: f for f in (robot_arm, quadruped, dog, power_tool, drone, boat, car, swing)}
FAMILIES = tuple(PEOPLE) + tuple(OTHERS)
ALL, UPPER = ("pelvis", "chest", "head", "upper_arm", "wrist", "hand", "thigh", "shank", "foot"), ("chest", "head", "upper_arm", "wrist", "hand")
SEGMENTS = {**{name: ALL for name in PEOPLE}, **{name: UPPER for name in ("tremor", "head_turns", "typing", "hammer", "still", "wheelchair")},
            "robot_arm": ("link3", "link4", "tool0"), "quadruped": ("trunk", "fl_thigh", "fl_calf"), "dog": ("harness", "rump", "collar"), "power_tool": ("tool", "grip", "battery"),
            "drone": ("fc", "gimbal", "arm1"), "boat": ("hull", "mast", "cabin"), "car": ("chassis", "dashboard", "seat"), "swing": ("seat", "rope", "rider")}
MARGIN = 4.0  # seconds of motion before and after what is recorded

def body(family, rng, start, seconds, width, turns, names):
    """Segment name -> Path over [start - MARGIN, start + seconds + MARGIN]; `turns` (name -> rotation) places the mount frames on the segments."""
    t = start - MARGIN + np.arange(int((seconds + 2 * MARGIN) * GRID)) / GRID
    frames = PEOPLE[family](rng, t).frames(width, names) if family in PEOPLE else OTHERS[family](rng, t, width)
    return {name: Path(t[0], frames[name][0], qmul(frames[name][1], turns.get(name, Rotation.identity()).as_quat())) for name in names}
