"""Motions of the fifth origin: chains of hinges and slides, each driven by a scalar signal with two exact derivatives.

A family is a function (rng, span) -> list of joints. State at any time: position, orientation, linear acceleration (world, z up),
angular velocity and acceleration (body). Nothing is differentiated numerically.
"""
import numpy as np
from scipy.spatial.transform import Rotation

MARGIN = 8.0  # events are drawn this far beyond both ends, s


class Signal:
    """A function of sorted times that gives value, first and second derivative as rows."""

    def __init__(self, of):
        self.of, self.asked, self.told = of, None, None

    def __call__(self, t):
        if self.asked is not t:  # phases and windows are shared by many joints
            self.asked, self.told = t, self.of(t)
        return self.told

    def __add__(self, other):
        return Signal(lambda t: self(t) + other(t))

    def __mul__(self, other):
        if not isinstance(other, Signal):
            return Signal(lambda t: self(t) * other)
        return Signal(lambda t: _product(self(t), other(t)))

    def sin(self, times=1.0, phase=0.0):
        return Signal(lambda t: _wave(self(t) * times, phase))

    def cos(self, times=1.0, phase=0.0):
        return self.sin(times, phase + np.pi / 2)


def _product(a, b):
    return np.array([a[0] * b[0], a[1] * b[0] + a[0] * b[1], a[2] * b[0] + 2 * a[1] * b[1] + a[0] * b[2]])


def _wave(a, phase):
    sine, cosine = np.sin(a[0] + phase), np.cos(a[0] + phase)
    return np.array([sine, cosine * a[1], cosine * a[2] - sine * a[1] ** 2])


def line(rate, start=0.0):
    return Signal(lambda t: np.array([start + rate * t, np.full_like(t, rate), np.zeros_like(t)]))


def constant(value):
    return line(0.0, value)


def sines(hz, amplitude, phase):
    def of(t):
        out = np.zeros((3, len(t)))
        for f, a, p in zip(hz, amplitude, phase):
            w = 2 * np.pi * f
            sine, cosine = np.sin(w * t + p), np.cos(w * t + p)
            out += a * np.array([sine, w * cosine, -w * w * sine])
        return out
    return Signal(of)


def _spectrum(rng, rms, low, high, terms):
    hz = np.exp(rng.uniform(np.log(low), np.log(high), terms))
    amplitude = rng.uniform(0.4, 1.0, terms)
    amplitude *= rms * np.sqrt(2 / (amplitude ** 2).sum())
    return hz, amplitude, rng.uniform(0, 2 * np.pi, terms)


def wander(rng, rms, low, high, terms=8):
    """Sum of sines at random frequencies: what hands, heads, waves and winds do."""
    return sines(*_spectrum(rng, rms, low, high, terms))


def path(times, values, durations, start=0.0):
    """Goes from value to value in smooth steps (7th degree: jerk is continuous)."""
    def of(t):
        out = np.zeros((3, len(t)))
        out[0] = start
        before = start
        for at, value, lasts in zip(times, values, durations):
            rise, before = value - before, value
            i, j = np.searchsorted(t, (at, at + lasts))
            s = (t[i:j] - at) / lasts
            out[0, i:j] += rise * s ** 4 * (35 - 84 * s + 70 * s ** 2 - 20 * s ** 3)
            out[0, j:] += rise
            out[1, i:j] += rise / lasts * 140 * s ** 3 * (1 - s) ** 3
            out[2, i:j] += rise / lasts ** 2 * 420 * s ** 2 * (1 - s) ** 2 * (1 - 2 * s)
        return out
    return Signal(of)


def bursts(times, peaks, hz, cycles, phase=0.0):
    """Short Gaussian wave packets whose second derivative peaks at about `peaks`: heel strikes, knocks, shakes."""
    w, width = 2 * np.pi * hz, cycles / hz / 2

    def of(t):
        out = np.zeros((3, len(t)))
        for at, peak in zip(times, peaks):
            i, j = np.searchsorted(t, (at - 6.5 * width, at + 6.5 * width))
            s = t[i:j] - at
            bell, angle = np.exp(-0.5 * (s / width) ** 2) * peak / w ** 2, w * s + phase
            e = np.array([bell, -s / width ** 2 * bell, (s ** 2 / width ** 4 - 1 / width ** 2) * bell])
            c = np.array([np.cos(angle), -w * np.sin(angle), -w * w * np.cos(angle)])
            out[:, i:j] += _product(e, c)
        return out
    return Signal(of)


def beats(rng, span, gap, spread=0.1, first=None):
    """Times of events about `gap` apart."""
    at, out = -MARGIN + (rng.uniform(0, gap) if first is None else first), []
    while at < span + MARGIN:
        out.append(at)
        at += gap * max(0.2, 1 + spread * rng.standard_normal())
    return np.array(out)


def bouts(rng, span, on, off):
    """1 while active, 0 at rest."""
    at, times, values, state = -MARGIN + rng.uniform(0, off), [], [], 0
    while at < span + MARGIN:
        state = 1 - state
        times.append(at)
        values.append(state)
        at += max(1.6, (on if state else off) * rng.uniform(0.6, 1.5))
    return path(times, values, np.full(len(times), rng.uniform(0.7, 1.4)))


def jumps(rng, span, gap, size, lasts, spread=0.4, hold=None):
    """Steps between random values: gaze, poses of a rate table, tools put from here to there."""
    times = beats(rng, span, gap, spread)
    values = rng.normal(0, size, len(times)) if hold is None else rng.choice(hold, len(times))
    return path(times, values, np.minimum(lasts * rng.uniform(0.7, 1.4, len(times)), 0.95 * np.diff(times, append=times[-1] + 9)))


# --- chain -----------------------------------------------------------------------------------------------------------------------

AXES = {"x": (1.0, 0, 0), "y": (0, 1.0, 0), "z": (0, 0, 1.0)}


def turn(axis, signal):
    axis = np.array(AXES.get(axis, axis) if isinstance(axis, str) else axis, float)
    return "turn", axis / np.linalg.norm(axis), signal


def slide(axis, signal):
    return "slide", np.array(AXES[axis] if isinstance(axis, str) else axis, float), signal


def offset(x, y, z):
    return "slide", np.array([x, y, z], float), constant(1.0)


def fixed(rotvec):
    return "fixed", Rotation.from_rotvec(rotvec).as_matrix(), None


def _turned(matrix, v):
    return (matrix @ v[:, :, None])[:, :, 0]


def cross(u, v):
    a, b, c = u.T if u.ndim > 1 else u
    x, y, z = v.T if v.ndim > 1 else v
    return np.stack([b * z - c * y, c * x - a * z, a * y - b * x], 1)


def _hinge(axis, angle):
    x, y, z = axis
    K = np.array([[0, -z, y], [z, 0, -x], [-y, x, 0]])
    return np.eye(3) + np.sin(angle)[:, None, None] * K + (1 - np.cos(angle))[:, None, None] * (K @ K)


def state(joints, t):
    """p, R (n,3,3), a in the world; w, alpha in the body."""
    n = len(t)
    p, a, w, alpha = (np.zeros((n, 3)) for _ in range(4))
    R = np.broadcast_to(np.eye(3), (n, 3, 3))
    for kind, axis, signal in joints:
        if kind == "fixed":
            R, w, alpha = R @ axis, w @ axis, alpha @ axis
            continue
        s, d, dd = (row[:, None] for row in signal(t))
        if kind == "slide":
            o, v = s * axis, d * axis
            p = p + _turned(R, o)
            a = a + _turned(R, dd * axis + 2 * cross(w, v) + cross(alpha, o) + cross(w, cross(w, o)))
            continue
        hinge = _hinge(axis, s[:, 0])
        back = hinge.transpose(0, 2, 1)
        w, alpha = _turned(back, w), _turned(back, alpha)
        alpha = alpha - cross(d * axis, w) + dd * axis
        w = w + d * axis
        R = R @ hinge
    return p, R, a, w, alpha


def quaternion(R):
    return Rotation.from_matrix(R).as_quat()


# --- people ----------------------------------------------------------------------------------------------------------------------

def _harmonics(rng, phase, sizes, first=1):
    total = constant(0.0)
    for k, size in enumerate(sizes):
        total = total + phase.sin(first * (k + 1), rng.uniform(0, 2 * np.pi)) * (size * rng.uniform(0.7, 1.3))
    return total


def _gait(rng, span, cadence, vigour, strike, climb=0.0, rests=True):
    """Strides around a loop; the sensor sits on trunk, thigh, shank, foot or wrist."""
    active = bouts(rng, span, rng.uniform(12, 30), rng.uniform(3, 7)) if rests else constant(1.0)
    phase = line(np.pi * cadence, rng.uniform(0, 6)) + wander(rng, 0.25, 0.03, 0.25, 5)  # one stride is 2 steps
    radius, speed = rng.uniform(2.0, 7.0), 0.7 * cadence * vigour
    loop = jumps(rng, span, rng.uniform(8, 16), 1.0, 7.0) * (speed * 2.5 / radius)
    joints = [turn("z", loop), offset(radius, 0, 1.0), turn("z", jumps(rng, span, 11, 0.8, 1.6))]
    if climb:
        joints.append(slide("z", jumps(rng, span, 12, climb, 9.0)))
    steps = beats(rng, span, 1 / cadence, 0.03)
    hits = bursts(steps, strike * rng.uniform(0.6, 1.3, len(steps)), rng.uniform(10, 17), 0.8, rng.uniform(0, 6)) * active
    joints += [slide("z", _harmonics(rng, phase, (0.004, 0.022, 0.003, 0.004)) * active * vigour), slide("z", hits),
               slide("y", _harmonics(rng, phase, (0.02, 0.004, 0.003)) * active), slide("x", _harmonics(rng, phase, (0.004, 0.012, 0.002)) * active),
               slide("x", hits * rng.uniform(-0.6, 0.6)), turn("z", _harmonics(rng, phase, (0.09, 0.02)) * active * vigour),
               turn("x", _harmonics(rng, phase, (0.05, 0.02, 0.008)) * active), turn("y", _harmonics(rng, phase, (0.02, 0.04, 0.006)) * active), turn("y", wander(rng, 0.05, 0.03, 0.6))]
    limb = rng.choice(["trunk", "thigh", "shank", "foot", "wrist"])
    if limb in ("thigh", "shank", "foot"):
        joints += [offset(0, 0.1, -0.1), turn("y", _harmonics(rng, phase, (0.38, 0.1, 0.03)) * active * vigour), turn("x", wander(rng, 0.04, 0.1, 2)), offset(0.05, 0, -0.3)]
    if limb in ("shank", "foot"):
        joints += [offset(0, 0, -0.12), turn("y", _harmonics(rng, phase, (0.5, 0.28, 0.07, 0.02)) * active * vigour), offset(0.03, 0.02, -0.25)]
    if limb == "foot":
        joints += [offset(0, 0, -0.18), turn("y", _harmonics(rng, phase, (0.3, 0.2, 0.07, 0.03)) * active * vigour), offset(0.1, 0, -0.05)]
    if limb == "wrist":
        joints += [offset(0, 0.2, 0.4), turn("y", _harmonics(rng, phase, (0.35, 0.08, 0.02)) * active * vigour), offset(0, 0, -0.3), turn("y", constant(-rng.uniform(0.2, 1.4))),
                   turn("y", _harmonics(rng, phase, (0.25, 0.1, 0.03)) * active * vigour), turn("x", wander(rng, 0.25, 0.05, 0.8)), offset(0, 0, -0.25)]
    return joints


def walking(rng, span):
    return _gait(rng, span, rng.uniform(1.5, 2.1), rng.uniform(0.7, 1.2), rng.uniform(1.0, 5.0))


def running(rng, span):
    return _gait(rng, span, rng.uniform(2.4, 3.0), rng.uniform(1.2, 1.7), rng.uniform(5.0, 16.0), rests=rng.random() < 0.5)


def stairs(rng, span):
    return _gait(rng, span, rng.uniform(1.3, 1.9), rng.uniform(0.8, 1.3), rng.uniform(2.0, 7.0), climb=1.5)


def _repetitions(rng, span, seconds, on, off):
    """Phase of repetitions and the window of the sets."""
    phase = line(2 * np.pi / seconds, rng.uniform(0, 6)) + wander(rng, 0.4, 0.02, 0.15, 5)
    return phase, bouts(rng, span, on, off)


def squats(rng, span):
    phase, sets = _repetitions(rng, span, rng.uniform(1.8, 3.5), 18, 6)
    depth = _harmonics(rng, phase, (0.2, 0.05, 0.015)) * sets
    return [turn("z", jumps(rng, span, 15, 0.7, 2.0)), offset(0.2, 0, 1.0), slide("z", depth), slide("x", _harmonics(rng, phase, (0.05, 0.02)) * sets),
            turn("y", _harmonics(rng, phase, (0.35, 0.1, 0.03)) * sets), turn("x", wander(rng, 0.05, 0.1, 1.2)), turn("z", wander(rng, 0.05, 0.05, 0.8)),
            slide("z", bursts(beats(rng, span, 2.4), np.full(99, rng.uniform(0.5, 3)), 11, 0.8)), slide((0.6, 1, 0.2), wander(rng, 0.004, 0.3, 3.0)),
            offset(0.05, 0.1, rng.uniform(-0.3, 0.4))]


def curls(rng, span):
    """Dumbbell with rests; the forearm turns while it lifts."""
    phase, sets = _repetitions(rng, span, rng.uniform(1.4, 2.8), 20, 7)
    elbow = _harmonics(rng, phase, (0.95, 0.15, 0.04)) * sets
    return [turn("z", jumps(rng, span, 14, 0.8, 2.0)), offset(0, 0.2, 1.3), turn("y", _harmonics(rng, phase, (0.12, 0.05)) * sets), turn("x", wander(rng, 0.1, 0.05, 0.7)),
            offset(0, 0, -0.3), turn("y", constant(-0.8)), turn("y", elbow), turn("z", _harmonics(rng, phase, (0.6, 0.1)) * sets),
            offset(rng.uniform(0.1, 0.28), 0, 0), turn("x", wander(rng, 0.12, 0.2, 4.0))]


def knee(rng, span):
    """Rehabilitation on a chair: slow hinge, holds, a little tremor."""
    times = beats(rng, span, rng.uniform(3.0, 5.0), 0.2)
    angle = path(times, rng.uniform(0.1, 1.5, len(times)) * (np.arange(len(times)) % 2), np.full(len(times), rng.uniform(1.2, 2.2)))
    return [turn("z", wander(rng, 0.1, 0.02, 0.3)), offset(0.4, 0, 0.5), turn("y", wander(rng, 0.05, 0.05, 0.5)), turn("y", angle * -1.0), turn("x", wander(rng, 0.06, 0.05, 0.7)),
            offset(0.04, 0.03, -rng.uniform(0.15, 0.35)), turn("y", wander(rng, 0.004, 4, 9)), turn("z", angle * rng.uniform(0.05, 0.2))]


def sit_to_stand(rng, span):
    times = beats(rng, span, rng.uniform(3.0, 5.5), 0.2)
    up, lasts = np.arange(len(times)) % 2, rng.uniform(1.0, 1.8)
    lean_times = np.sort(np.concatenate([times - 0.5, times + 0.5 * lasts]))
    lean = path(lean_times, rng.uniform(0.4, 0.8, len(lean_times)) * (np.arange(len(lean_times)) % 2 == 0), np.full(len(lean_times), 0.9))
    return [turn("z", jumps(rng, span, 12, 0.9, 2.2)), slide("x", path(times, 0.3 * up, np.full(len(times), lasts))), slide("z", path(times, 0.4 * up, np.full(len(times), lasts), 0.5)),
            turn("y", lean), turn("x", wander(rng, 0.04, 0.1, 1.5)), turn("z", wander(rng, 0.07, 0.05, 0.9)), slide((1, 1, 0.5), wander(rng, 0.003, 0.3, 3.5)),
            slide("z", bursts(times + lasts * 0.9, np.where(up, 0.5, rng.uniform(2, 8)), 9, 0.8)), offset(0.1, 0, 0.4)]


def sitter(rng, span):
    """Mostly still, at times a gesture; breathing and a slow change of posture."""
    talk = bouts(rng, span, 5, 8)
    return [turn("z", jumps(rng, span, 16, 0.4, 1.5)), offset(0.2, 0.2, 1.1), slide("z", sines([rng.uniform(0.2, 0.3)], [0.004], [1.0])), turn("y", jumps(rng, span, 12, 0.25, 1.6)),
            turn("x", jumps(rng, span, 14, 0.3, 1.8)), offset(0, 0, -0.3), turn("y", wander(rng, 0.22, 0.3, 1.8, 9) * talk), turn("z", wander(rng, 0.2, 0.3, 1.8, 9) * talk),
            offset(0.25, 0, 0), turn("x", wander(rng, 0.3, 0.3, 2.2, 9) * talk), slide("x", wander(rng, 0.006, 1, 3.0) * talk), turn((1, 1, 0), wander(rng, 0.0015, 6, 10))]


def writing(rng, span):
    """Pen strokes in words, carriage along the line, back to the left."""
    word = bouts(rng, span, 4, 2)
    stroke = rng.uniform(3.0, 5.0)
    rows = path(beats(rng, span, 6, 0.1), np.resize([0.16, 0.0], 99), np.resize([5.0, 0.8], 99))
    return [offset(0.3, -0.1, 0.75), turn("z", jumps(rng, span, 9, 0.3, 1.5)), slide("x", rows), slide("y", wander(rng, 0.007, stroke * 0.5, stroke * 1.5, 10) * word),
            slide("x", wander(rng, 0.004, stroke * 0.5, stroke * 1.5, 10) * word), slide("z", jumps(rng, span, 2.0, 0.012, 0.35)), turn("y", constant(-0.8)),
            turn("x", wander(rng, 0.10, stroke * 0.3, stroke, 9) * word), turn("y", wander(rng, 0.12, 0.2, stroke * 0.7, 9)), turn("z", wander(rng, 0.15, 0.05, 1.0)), offset(0, 0, 0.1)]


def hammering(rng, span):
    """A tool: raised slowly, driven down, stopped by the work."""
    work, period = bouts(rng, span, 8, 4), rng.uniform(0.7, 1.3)
    hits = beats(rng, span, period, 0.05)
    times = np.sort(np.concatenate([hits - 0.22, hits + 0.1]))
    arm = path(times, np.resize([-0.1, 0.9], len(times)), np.resize([0.24, period * 0.5], len(times))) * work
    knock = bursts(hits, rng.uniform(10, 40) * rng.uniform(0.6, 1.2, len(hits)), rng.uniform(14, 20), 0.9, 0.5) * work
    return [turn("z", jumps(rng, span, 8, 0.6, 1.5)), offset(0.1, 0.2, 1.2), turn("y", arm * -0.4), offset(0, 0, -0.3), turn("x", wander(rng, 0.1, 0.1, 1.5)), turn("y", arm * -1.0),
            offset(0.3, 0, 0), turn("x", jumps(rng, span, 6, 0.35, 1.0)), slide("z", knock), slide("x", knock * 0.3), turn("y", wander(rng, 0.05, 0.3, 4))]


def head(rng, span):
    """Head-mounted device: quick turns of gaze, sway of the neck."""
    return [offset(0.5, 0.5, 1.6), slide((1, 0, 0), wander(rng, 0.04, 0.05, 0.9)), slide((0, 1, 0), wander(rng, 0.04, 0.05, 0.9)), slide("z", wander(rng, 0.012, 0.1, 2.0)),
            turn("z", jumps(rng, span, rng.uniform(1.2, 2.5), 0.6, 0.45)), turn("y", jumps(rng, span, 2.2, 0.3, 0.5)), turn("x", jumps(rng, span, 3.0, 0.15, 0.6)),
            turn((1, 2, 0), wander(rng, 0.03, 0.5, 5.0, 10)), offset(0.1, 0, 0.08)]


def violin(rng, span):
    """Bow hand: strokes of varying length across changing strings."""
    times = beats(rng, span, rng.uniform(0.5, 1.0), 0.18)
    lasts = np.diff(times, append=times[-1] + 0.5) * 0.93
    along = path(times, rng.uniform(0.05, 0.28, len(times)) * np.resize([-1, 1], len(times)), lasts)
    return [turn("z", wander(rng, 0.15, 0.05, 0.5)), offset(0.1, 0, 1.4), turn("x", jumps(rng, span, 1.4, 0.22, 0.25)), turn("z", along * -1.5), slide("y", along),
            slide("z", wander(rng, 0.006, 0.5, 4)),
            turn("y", wander(rng, 0.08, 0.2, 2.5)), turn("x", along * rng.uniform(0.5, 1.4)), turn("y", bursts(times, rng.uniform(2, 10, len(times)), 9, 1.0)),
            slide("y", sines([rng.uniform(5, 6.5)], [0.0015], [0.3])), offset(0.05, 0.05, 0)]


def swimming(rng, span):
    """Crawl: the arm turns over again and again while the body rolls; turns at the wall."""
    beat = rng.uniform(0.55, 0.95)
    phase = line(2 * np.pi * beat) + wander(rng, 0.3, 0.03, 0.2, 5)
    stroke = phase + phase.sin(1, 1.0) * 0.3 + phase.sin(2, 2.0) * 0.1
    lengths = beats(rng, span, 16, 0.05)
    across = path(lengths, np.resize([20.0, 0.0], len(lengths)), np.full(len(lengths), 14.0))
    return [slide("x", across), slide("x", _harmonics(rng, phase, (0.02, 0.03))), slide("z", _harmonics(rng, phase, (0.03, 0.02))),
            turn("z", path(lengths - 1.9, np.arange(len(lengths)) * np.pi, np.full(len(lengths), 1.8))),
            turn("x", _harmonics(rng, phase, (0.6, 0.08, 0.03))), turn("y", wander(rng, 0.05, 0.1, 1.5)), offset(0.1, 0.2, 0), turn("y", stroke), offset(0, 0, -0.3),
            turn("y", _harmonics(rng, phase, (0.5, 0.2, 0.05))), turn("x", _harmonics(rng, phase, (0.3, 0.1, 0.05))), offset(0, 0, -0.25), turn("z", wander(rng, 0.1, 0.5, 5))]


def figure_eight(rng, span):
    """Someone calibrates a compass: eights in the air, the wrist rolling."""
    hz, size = rng.uniform(0.5, 1.1), rng.uniform(0.7, 1.2)
    phase = line(2 * np.pi * hz) + wander(rng, 0.5, 0.03, 0.3, 6)
    return [offset(0.4, 0, 1.2), turn("z", jumps(rng, span, 7, 0.6, 2.0)), slide("y", phase.sin() * (0.25 * size)), slide("z", phase.sin(2, 0.4) * (0.1 * size)),
            slide("x", wander(rng, 0.03, 0.1, 1.5)),
            turn("x", phase.sin(1, 0.5) * (1.2 * size)), turn("y", phase.sin(2, 1.0) * (0.6 * size)), turn("z", phase.sin(1, 2.0) * (0.7 * size)), turn((1, 1, 1),
            wander(rng, 0.1, 0.3, 4.0)), offset(0.05, 0, 0.1)]


def parcel(rng, span):
    """A logger inside a box: carried, tipped, set down hard, left standing."""
    times = beats(rng, span, rng.uniform(3.5, 6.0), 0.25)
    lasts, carried = rng.uniform(1.2, 2.4, len(times)), bouts(rng, span, 6, 5)
    knocks = bursts(times + lasts, rng.uniform(3, 25, len(times)), rng.uniform(10, 18), 1.0, rng.uniform(0, 6))
    pick = np.resize([1.0, 0.0], len(times))
    return [slide("x", path(times, rng.uniform(-2, 2, len(times)), lasts)), slide("y", path(times, rng.uniform(-2, 2, len(times)), lasts)),
            slide("z", path(times, pick * rng.uniform(0.4, 1.2, len(times)), lasts)),
            slide((0.4, 0.3, 1), knocks), turn("z", path(times, rng.uniform(-2, 2, len(times)), lasts)), turn("y", path(times, pick * rng.normal(0, 0.6, len(times)), lasts)),
            turn("x", path(times, rng.choice([0, 0, np.pi / 2, -np.pi / 2], len(times)), lasts)), turn("x", wander(rng, 0.08, 0.4, 3.5) * carried), turn("y", wander(rng, 0.08, 0.4, 3.5) * carried),
            slide("z", wander(rng, 0.015, 1.2, 2.2) * carried), turn((1, 0.5, 0.3), bursts(times + lasts, rng.uniform(5, 40, len(times)), 12, 1.0)), offset(0.15, 0.1, 0.1)]


# --- animals, vehicles and machines ------------------------------------------------------------------------------------------------

def collar(rng, span):
    """Dog: trot, sniffing, and now and then the whole-body shake."""
    trot = bouts(rng, span, 9, 5)
    phase = line(2 * np.pi * rng.uniform(1.9, 2.6)) + wander(rng, 0.3, 0.05, 0.3, 5)
    shakes = beats(rng, span, 14, 0.3)
    roll = bursts(shakes, rng.uniform(150, 350, len(shakes)), rng.uniform(3.8, 5.0), 5.0)
    return [turn("z", jumps(rng, span, 6, 1.0, 3.5)), offset(3.0, 0, 0.5), turn("z", jumps(rng, span, 4, 0.6, 0.9)), slide("z", _harmonics(rng, phase, (0.018, 0.006, 0.002)) * trot),
            slide("x", _harmonics(rng, phase, (0.008, 0.004)) * trot), turn("y", _harmonics(rng, phase, (0.08, 0.05, 0.01)) * trot), turn("y", jumps(rng, span, 4, 0.45, 0.8)),
            turn("x", roll), turn("x", _harmonics(rng, phase, (0.07, 0.03)) * trot), turn("z", wander(rng, 0.12, 0.3, 4.0)), offset(0.08, 0.02, -0.1)]


def _legs(rng, span, leg, drive, spin, turns):
    """Straight drives with turns on the spot between them."""
    at, x, y, heading, rows = -MARGIN, 0.0, 0.0, 0.0, []
    while at < span + MARGIN:
        far, lasts, dwell = leg * rng.uniform(0.4, 1.5), drive * rng.uniform(0.7, 1.4), spin * rng.uniform(0.7, 1.4)
        x, y = x + far * np.cos(heading), y + far * np.sin(heading)
        heading_next = heading + rng.choice(turns) * rng.uniform(0.8, 1.1)
        if np.hypot(x, y) > 5 * leg:  # home again
            heading_next = heading + (np.arctan2(-y, -x) - heading + np.pi) % (2 * np.pi) - np.pi
        rows.append((at, lasts, x, y, at + lasts, dwell, heading_next))
        at, heading = at + lasts + dwell, heading_next
    at, lasts, xs, ys, later, dwell, headings = np.array(rows).T
    return at, lasts, [slide("x", path(at, xs, lasts)), slide("y", path(at, ys, lasts)), turn("z", path(later, headings, dwell))]


def vacuum(rng, span):
    at, lasts, joints = _legs(rng, span, 1.2, 3.0, 1.3, [np.pi / 2, -np.pi / 2, 2.4, -2.4, np.pi])
    bumps = at + lasts * rng.uniform(0.3, 0.8, len(at))
    hits = rng.uniform(0.5, 4.0, len(at))
    return joints + [slide("z", wander(rng, 0.0003, 3, 9)), slide("z", bursts(bumps, hits, 11, 1.0)), slide("x", bursts(at + lasts, hits, 13, 0.9)), turn("y", bursts(bumps, hits * 5, 8, 1.0)),
                     turn("x", wander(rng, 0.006, 0.5, 8)), turn("y", wander(rng, 0.006, 0.5, 8)), turn("z", wander(rng, 0.03, 0.3, 2)), offset(0.08, 0.05, 0.06)]


def forklift(rng, span):
    at, lasts, joints = _legs(rng, span, 4.0, 5.0, 3.0, [np.pi / 2, -np.pi / 2, 0.5, -0.5])
    return joints + [turn("x", wander(rng, 0.012, 0.4, 3.0)), turn("y", wander(rng, 0.012, 0.4, 3.0)), slide("z", wander(rng, 0.002, 1.0, 5.0)),
            slide("z", bursts(beats(rng, span, 2.5, 0.5), np.full(99, 3.0), 7, 1.0)),
                     turn("y", jumps(rng, span, 7, 0.08, 1.5)), slide("z", jumps(rng, span, 8, 0.7, 3.0)), turn("z", wander(rng, 0.02, 0.2, 2.0)),
                     turn("x", wander(rng, 0.0003, 6, 14)), offset(1.0, 0.3, 0.4)]


def sailing(rng, span):
    wave = rng.uniform(0.15, 0.35)
    return [slide("x", wander(rng, 1.5, 0.02, 0.1)), slide("y", wander(rng, 1.5, 0.02, 0.1)), slide("z", wander(rng, 0.3, wave, wave * 3)), turn("z", jumps(rng, span, 18, 0.8, 5.0)),
            turn("x", jumps(rng, span, 18, 0.3, 3.5)), turn("x", wander(rng, 0.14, wave, wave * 3)), turn("y", wander(rng, 0.08, wave, wave * 3.5)),
            turn("z", wander(rng, 0.06, wave * 0.5, wave * 2)), offset(-1.0, 0.5, rng.uniform(0.5, 4.0)), slide("z", bursts(beats(rng, span, 5, 0.4), np.full(99, rng.uniform(1, 4)), 5, 1.0)),
            turn("y", bursts(beats(rng, span, 5, 0.4), np.full(99, 1.0), 5, 1.2))]


def quadcopter(rng, span):
    """Sideways acceleration and tilt belong together; gusts and a quick correction loop on top."""
    joints, tilts = [], []
    for axis, about, sign in (("x", "y", 1.0), ("y", "x", -1.0)):
        hz, amplitude, phase = _spectrum(rng, rng.uniform(0.3, 0.7), 0.1, 0.9, 9)
        amplitude = amplitude * np.minimum(1.0, 0.4 / hz)
        joints.append(slide(axis, sines(hz, amplitude, phase)))
        tilts.append(turn(about, sines(hz, -sign * amplitude * (2 * np.pi * hz) ** 2 / 9.80665, phase)))
    return joints + [slide("z", jumps(rng, span, 6, 0.7, 2.0)), turn("z", jumps(rng, span, 5, 1.2, 1.8))] + tilts + [
        turn("x", wander(rng, 0.015, 2, 12)), turn("y", wander(rng, 0.015, 2, 12)), slide("z", wander(rng, 0.001, 4, 15)), turn("z", wander(rng, 0.01, 1, 6)), offset(0.02, 0.0, 0.04)]


def wheel(rng, span):
    """On a rim or hub: spins on and on, many turns at constant rate, with the road below."""
    spin = rng.uniform(0.6, 2.5) * rng.choice([-1, 1])
    angle = line(2 * np.pi * spin) + jumps(rng, span, 15, 3.0, 6.0)
    return [turn("z", wander(rng, 0.3, 0.02, 0.15)), slide("x", wander(rng, 6.0, 0.02, 0.06)), slide("z", wander(rng, 0.002, 1.0, 8.0)), turn("x", wander(rng, 0.05, 0.05, 0.6)),
            slide("z", bursts(beats(rng, span, 2.5, 0.5), np.full(99, rng.uniform(1, 8)), 10, 1.0)), turn("y", angle), offset(rng.uniform(0.02, 0.25), 0.02, 0.0), fixed(rng.normal(0, 0.6, 3))]


def rate_table(rng, span):
    # stepwise, mostly still
    gap, hold = rng.uniform(2.5, 4.5), np.radians([-90, -60, -45, -30, 0, 30, 45, 60, 90])
    lasts = rng.uniform(1.3, 2.2)
    return [offset(0, 0, 1.0), turn("z", jumps(rng, span, gap * 1.7, 0, lasts, 0.2, hold * 2)), turn("y", jumps(rng, span, gap, 0, lasts, 0.2, hold)),
            turn("x", jumps(rng, span, gap * 1.3, 0, lasts, 0.2, hold * 2)), offset(rng.uniform(0.02, 0.3), rng.uniform(-0.1, 0.1), 0.05), fixed(rng.normal(0, 0.5, 3))]


def gimbal(rng, span):
    """Camera held level: slow pans and tilts, the carrier's steps mostly filtered out."""
    step = rng.uniform(1.6, 2.0)
    return [slide("x", wander(rng, 0.8, 0.03, 0.2)), slide("y", wander(rng, 0.8, 0.03, 0.2)), offset(0, 0, 1.5), slide("z", sines([step, 2 * step], [0.02, 0.003], [0, 1])),
            slide((1, 0.5, 0), wander(rng, 0.01, 0.5, 2.5)),
            turn("z", jumps(rng, span, 5, 0.9, 3.0)), turn("y", jumps(rng, span, 6, 0.4, 2.5)), turn("x", jumps(rng, span, 11, 0.5, 2.0)), turn((1, 0.3, 1),
            wander(rng, 0.004, 1, 8)), offset(0.05, 0.02, -0.03)]


def crank(rng, span):
    """Pedal: turns that speed up and slow down, the ankle working."""
    phase = line(2 * np.pi * rng.uniform(0.9, 1.6)) + jumps(rng, span, 12, 4.0, 7.0)
    phase = phase + phase.sin(2, 0.3) * 0.06
    return [slide("x", wander(rng, 0.05, 0.1, 0.8)), turn("z", wander(rng, 0.4, 0.02, 0.12)), turn("x", _harmonics(rng, phase, (0.05, 0.02))), offset(0, 0.1, 0.3),
            slide("x", phase.cos() * 0.17), slide("z", phase.sin() * 0.17),
            turn("y", _harmonics(rng, phase, (0.35, 0.08, 0.03))), turn("x", wander(rng, 0.04, 0.3, 3)), turn("z", wander(rng, 0.05, 0.2, 2)),
            slide("z", wander(rng, 0.0004, 6, 14)), offset(0.06, 0.03, 0.05)]


def robot_arm(rng, span):
    times = beats(rng, span, rng.uniform(1.2, 2.2), 0.15)
    lasts = np.minimum(rng.uniform(0.6, 1.1), 0.9 * np.diff(times, append=times[-1] + 3))

    def joint(size):
        return path(times, rng.normal(0, size, len(times)), lasts)
    ring = bursts(times + lasts, rng.uniform(2, 12, len(times)), rng.uniform(9, 14), 2.0)
    return [offset(0, 0, 0.4), turn("z", joint(0.8)), turn("y", joint(0.35)), offset(0, 0, 0.45), turn("y", joint(0.5)), offset(0.4, 0, 0), turn("x", joint(0.6)),
            turn("y", joint(0.5)), turn("y", ring), offset(0.1, 0, 0), turn("x", joint(0.8)), offset(0.03, 0.02, 0.02)]


FAMILIES = {f.__name__: f for f in (walking, running, stairs, squats, curls, knee, sit_to_stand, sitter, writing, hammering, head, violin, swimming, figure_eight, parcel,
            collar, vacuum, forklift,
                                    sailing, quadcopter, wheel, rate_table, gimbal, crank, robot_arm)}


def limb(rng, joints, span):
    """Another sensor on the same body: some way off, on a hinge of its own."""
    axis = rng.normal(0, 1, 3)
    return joints + [offset(*rng.uniform(-0.25, 0.25, 3)), fixed(rng.normal(0, 0.7, 3)), turn(axis, wander(rng, rng.uniform(0.1, 0.35), 0.1, 1.8)),
            offset(*rng.uniform(-0.15, 0.15, 3))]
