"""Smooth true motions of the third generator: joint chains and free bodies, as knots of quintic splines (250 Hz)."""
import numpy as np
from scipy.interpolate import make_interp_spline
from scipy.ndimage import gaussian_filter1d
from scipy.spatial.transform import Rotation

KNOT = 250.0
X, Y, Z = np.eye(3)


class Motion:
    """p, v, a in world; R; w, alpha in segment axes: all derivatives of the same splines."""
    def __init__(self, t, position, rotation):
        quaternion = rotation.as_quat()
        flips = np.concatenate([[1.0], np.cumprod(np.where(np.sum(quaternion[1:] * quaternion[:-1], axis=1) < 0, -1.0, 1.0))])
        self.p = make_interp_spline(t, position, k=5)
        self.q = make_interp_spline(t, quaternion * flips[:, None], k=5)
        self.pa, self.q1, self.q2 = self.p.derivative(2), self.q.derivative(1), self.q.derivative(2)

    def pose(self, t):
        return self.p(t), Rotation.from_quat(self.q(t))

    def full(self, t):
        q, q1, q2 = self.q(t), self.q1(t), self.q2(t)
        n = np.linalg.norm(q, axis=1, keepdims=True)
        u = q / n
        n1 = np.sum(u * q1, axis=1, keepdims=True)
        u1 = (q1 - u * n1) / n
        n2 = np.sum(u1 * q1 + u * q2, axis=1, keepdims=True)
        u2 = (q2 - 2 * u1 * n1 - u * n2) / n
        return self.pa(t), Rotation.from_quat(u), 2 * _conj_vec(u, u1), 2 * _conj_vec(u, u2)


def _conj_vec(u, v):
    """Vector part of conj(u) v, quaternions xyzw."""
    return u[:, 3:] * v[:, :3] - v[:, 3:] * u[:, :3] - np.cross(u[:, :3], v[:, :3])


def wander(rng, t, low, high, rms, n=14):
    f = np.exp(rng.uniform(np.log(low), np.log(high), n))
    weight = rng.rayleigh(1.0, n) / f ** 0.7
    weight *= rms / np.sqrt(0.5 * np.sum(weight ** 2))
    return np.sum(weight[:, None] * np.sin(2 * np.pi * f[:, None] * t + rng.uniform(0, 2 * np.pi, n)[:, None]), axis=0)


def phase(rng, t, f, wobble=0.04):
    """Phase in radians of a rhythm that is not quite even."""
    return 2 * np.pi * f * t + wander(rng, t, 0.03, 0.3, wobble * 2 * np.pi) + rng.uniform(0, 2 * np.pi)


def harmonics(rng, ph, sizes):
    return sum(s * np.cos((k + 1) * ph + rng.uniform(0, 2 * np.pi)) for k, s in enumerate(sizes))


def moves(rng, t, low, high, go, rest):
    """Minimum-jerk steps between random targets, durations go, dwells rest (ranges, s)."""
    out, now, at = np.zeros_like(t), t[0], rng.uniform(low, high)
    begins, lasts, sizes = [], [], []
    start = at
    while now < t[-1]:
        now += rng.uniform(*rest)
        last, to = rng.uniform(*go), rng.uniform(low, high)
        begins.append(now), lasts.append(last), sizes.append(to - at)
        now, at = now + last, to
    out += start
    for begin, last, size in zip(begins, lasts, sizes):
        s = np.clip((t - begin) / last, 0, 1)
        out += size * s ** 3 * (10 - 15 * s + 6 * s * s)
    return out


def pulses(t, ph, width, rate_of):
    """One bump of unit height per turn of ph, width in s."""
    d = np.angle(np.exp(1j * ph))
    return np.exp(-0.5 * (d / (2 * np.pi * rate_of * width)) ** 2)


def turn(axis, angle):
    return Rotation.from_rotvec(np.asarray(angle)[:, None] * np.asarray(axis, float))


def chain(t, base, rotation, links):
    position = np.array(base, float)
    for axis, angle, offset in links:
        if axis is not None:
            rotation = rotation * turn(axis, angle)
        position = position + rotation.apply(np.array(offset, float))
    return position, rotation


def along(t, speed, heading):
    dt = t[1] - t[0]
    return np.stack([np.cumsum(speed * np.cos(heading)) * dt, np.cumsum(speed * np.sin(heading)) * dt, 0 * t], axis=1)


def gait(rng, t, place, run):
    stride = rng.uniform(1.25, 1.5) if run else rng.uniform(0.7, 1.1)
    speed = rng.uniform(2.2, 3.8) if run else rng.uniform(0.7, 1.6)
    ph = phase(rng, t, stride)
    heading = np.cumsum(moves(rng, t, -0.6, 0.6, (1.0, 3.0), (0, 4.0))) / KNOT + wander(rng, t, 0.05, 0.4, 0.1)
    effort = 1 + wander(rng, t, 0.02, 0.1, 0.12)
    pelvis = along(t, speed * effort, heading) + np.stack([0 * t, 0 * t, 0.95 + (0.04 if run else 0.02) * effort * np.cos(2 * ph)], 1)
    face = turn(Z, heading + 0.08 * np.cos(ph + 0.4))
    pelvis += face.apply(np.stack([0.012 * np.cos(2 * ph + 1), 0.025 * np.cos(ph + 2), 0 * t], 1))
    big = (1.2 if run else 0.9) * effort
    hit = pulses(t, ph - 0.5, rng.uniform(0.016, 0.03), stride)
    if place in ("pelvis", "lumbar", "chest"):
        tilt = 0.05 * big * np.cos(2 * ph + 0.3)
        return chain(t, pelvis, face, [(X, 0.06 * big * np.cos(ph), Z * 0.0), (Y, tilt + wander(rng, t, 0.1, 1, 0.03), [-0.1, 0, 0.1 if place != "chest" else 0.4])])
    if place == "wrist":
        arm = 0.35 * big * np.cos(ph + 3.0) + 0.05 * big * np.cos(2 * ph)
        bend = -(1.3 if run else 0.4) - 0.25 * big * np.cos(ph + 3.4)
        return chain(t, pelvis + [0, 0, 0.45], face, [(None, None, [0, 0.2, 0]), (Y, arm, [0, 0.03, -0.3]), (Y, bend, [0, 0, -0.24]), (Z, 0.4 + 0.25 * big * np.cos(ph + 1) + wander(rng, t, 0.2, 1.5, 0.1), Z * 0)])
    hip = -0.1 - 0.42 * big * np.cos(ph) - 0.03 * hit
    links = [(None, None, [0, 0.09, -0.05]), (X, 0.05 * big * np.cos(ph + 1), Z * 0), (Y, hip, [0.03, 0.05, -0.25 if place == "thigh" else -0.42])]
    if place != "thigh":
        knee = 0.45 * big + 0.4 * big * np.cos(ph - 1.8) - 0.2 * big * np.cos(2 * ph - 0.9) + 0.05 * hit
        links += [(Y, knee, [0, 0.02, -0.15 if place == "shank" else -0.42]), (Z, 0.08 * big * np.cos(ph + 2), Z * 0)]
        if place == "foot":
            links += [(Y, 0.25 * big * np.cos(ph + 0.8) + 0.1 * big * np.cos(2 * ph + 2) + 0.06 * hit, [0.1, 0, -0.03])]
    return chain(t, pelvis, face, links)


def arm_links(sh, el, pro, wr):
    return [(Z, sh[0], Z * 0), (Y, sh[1], Z * 0), (X, sh[2], [0.3, 0, 0]), (Z, el, [0.25, 0, 0]), (X, pro, Z * 0), (Y, wr, [0.06, 0, 0.01])]


def reach(rng, t, place):
    go, rest = ((0.45, 1.1), (0.0, 1.2)) if rng.random() < 0.6 else ((0.9, 2.0), (0.2, 2.5))
    m = lambda lo, hi: moves(rng, t, lo, hi, go, rest)
    trunk = turn(Z, moves(rng, t, -0.4, 0.4, (1, 2), (2, 8)))
    return chain(t, np.tile([0, 0, 1.3], (len(t), 1)), trunk, arm_links((m(-0.9, 0.9), m(-0.9, 0.9), m(-0.6, 0.6)), m(0.1, 1.9), m(-1.1, 1.1), m(-0.5, 0.5)))


def lift(rng, t, place):
    go, rest = (0.9, 1.7), (0.3, 1.5)
    squat = moves(rng, t, 0.0, 1.0, go, rest)
    flex = 1.1 * squat + wander(rng, t, 0.3, 1.5, 0.04)
    yaw = moves(rng, t, -1.3, 1.3, (1.2, 2.5), (0.5, 3))
    base = np.stack([0.15 * squat, wander(rng, t, 0.1, 0.6, 0.03), 0.95 - 0.35 * squat], 1)
    links = [(Y, flex, [0, 0, 0.4]), (X, wander(rng, t, 0.2, 1.2, 0.07), Z * 0)]
    if place == "wrist":
        links += [(None, None, [0, 0.2, 0]), (Y, -1.6 - 0.9 * squat + wander(rng, t, 0.3, 2, 0.15), [0.3, 0, 0.0]), (Y, moves(rng, t, -1.2, 0, go, rest), [0.25, 0, 0]), (X, wander(rng, t, 0.2, 2, 0.3), Z * 0)]
    return chain(t, base, turn(Z, yaw), links)


def gesture(rng, t, place):
    hi, v = rng.uniform(1.5, 3.0), rng.uniform(0.15, 0.4)
    w = lambda s: wander(rng, t, 0.25, hi, s * v)
    return chain(t, np.tile([0, 0, 1.35], (len(t), 1)), turn(Z, wander(rng, t, 0.05, 0.5, 0.3)), arm_links((w(1), 0.3 + w(1), w(0.8)), 1.2 + w(1.5), w(2), w(1.2)))


def sport(rng, t, place):
    """Throws and swings: rest, back, strike, follow-through."""
    joints = [0 * t for _ in range(6)]
    now = t[0] + rng.uniform(0.2, 1)
    sizes = rng.uniform([0.8, 0.4, 0.5, 0.7, 0.7, 0.3], [1.6, 0.9, 1.2, 1.5, 1.6, 0.8]) * rng.choice([-1, 1], 6)
    blend = lambda b, d: (lambda s: s ** 4 * (35 - 84 * s + 70 * s * s - 20 * s ** 3))(np.clip((t - b) / d, 0, 1))
    while now < t[-1]:
        back, strike, home = rng.uniform(0.6, 1.1), rng.uniform(0.35, 0.6), rng.uniform(0.9, 1.6)
        for j in range(6):
            size, late = sizes[j] * rng.uniform(0.7, 1.15), 0.03 * j * strike / 0.3
            joints[j] = joints[j] - 0.5 * size * blend(now, back) + 1.3 * size * blend(now + back + late, strike) - 0.8 * size * blend(now + back + late + strike + 0.1, home)
        now += back + strike + home + rng.uniform(0.2, 2.0)
    extra = lambda s: wander(rng, t, 0.2, 1.5, s)
    sway = np.stack([extra(0.04), extra(0.04), 1.3 + extra(0.03)], 1)
    return chain(t, sway, turn(Z, 0.4 * joints[0] + extra(0.1)), arm_links((joints[0], joints[1] + extra(.1), joints[2]), 0.9 + joints[3], joints[4], joints[5] + extra(.05)))


def robot(rng, t, place):
    def axis(lo, hi):
        speed, out, now, at = rng.uniform(0.5, 2.0), np.zeros_like(t), t[0], rng.uniform(lo, hi)
        knots, values = [t[0]], [at]
        while now < t[-1]:
            to = rng.uniform(lo, hi)
            last = abs(to - at) / speed + 0.15
            knots += [now + last, now + last + rng.uniform(0.1, 1.0)]
            values += [to, to]
            now, at = knots[-1], to
        return gaussian_filter1d(np.interp(t, knots, values), rng.uniform(0.04, 0.08) * KNOT)
    links = [(Z, axis(-1.8, 1.8), [0, 0, 0.35]), (Y, axis(-0.7, 0.6), [0, 0, 0.4]), (Y, axis(0.2, 1.7), [0.35, 0, 0.02]), (X, axis(-1.5, 1.5), [0.1, 0, 0]), (Y, axis(-1.2, 1.2), [0.08, 0, 0]), (X, axis(-2, 2), [0.05, 0.02, 0])]
    return chain(t, np.zeros((len(t), 3)), turn(Z, 0 * t), links)


def car(rng, t, place):
    speed = gaussian_filter1d(moves(rng, t, 2, 14, (2.0, 5.0), (0.5, 4)), 20)
    rate = moves(rng, t, -0.5, 0.5, (0.8, 2.0), (0.5, 4))
    heading = np.cumsum(rate) / KNOT
    forward, side = np.gradient(speed, t), speed * rate
    rough = rng.uniform(0.0005, 0.002)
    pos = along(t, speed, heading)
    pos[:, 2] += 0.5 + wander(rng, t, 0.5, 2, 0.01) + wander(rng, t, 3, 11, rough)
    pitch = -0.008 * forward + wander(rng, t, 0.4, 2.5, 0.006) + wander(rng, t, 3, 9, rough * 0.6)
    roll = 0.008 * side + wander(rng, t, 0.4, 2.5, 0.008) + wander(rng, t, 3, 9, rough * 0.6)
    return chain(t, pos, turn(Z, heading), [(Y, gaussian_filter1d(pitch, 5), Z * 0), (X, gaussian_filter1d(roll, 5), [0.6, 0.3, 0.3])])


def pendulum(rng, t, place):
    """Released again and again; planar up to a little sway of the plane."""
    length = rng.uniform(0.3, 1.2)
    f, decay = np.sqrt(9.80665 / length) / 2 / np.pi * 0.96, rng.uniform(0.02, 0.08)
    envelope, now = np.zeros_like(t), t[0] - 5
    while now < t[-1]:
        lasts = rng.uniform(12, 30)
        inside = t >= now
        envelope[inside] = rng.uniform(0.5, 1.1) * np.exp(-decay * (t[inside] - now))
        now += lasts
    envelope = gaussian_filter1d(envelope, 0.5 * KNOT)
    ph = phase(rng, t, f, 0.01)
    swing = envelope * np.cos(ph) + 0.02 * envelope ** 3 * np.cos(3 * ph)
    second = 0.25 * envelope * np.cos(ph * 1.0 + wander(rng, t, 0.05, 0.5, 0.5)) + wander(rng, t, 1.0, 2.5, 0.12 * rng.random()) * envelope
    plane = rng.uniform(0, 2 * np.pi) + (wander(rng, t, 0.02, 0.3, 0.25) if rng.random() < 0.5 else 0 * t)
    return chain(t, np.tile([0, 0, 2.0], (len(t), 1)), turn(Z, plane), [(Y, swing, [0, 0, -length * 0.7]), (Y, second, [0, 0, -length * 0.3])])


def shake(rng, t, place):
    f, on = rng.uniform(1.5, 4.0), 0.55 + 0.45 * np.tanh(3 * wander(rng, t, 0.05, 0.25, 0.8))
    ph = phase(rng, t, f, 0.1)
    way = rng.normal(size=(3, 3))
    way /= np.linalg.norm(way, axis=1)[:, None]
    size = rng.uniform(1.5, 9.0) / (2 * np.pi * f) ** 2
    pos = np.stack([0 * t, 0 * t, 0 * t + 1.1], 1) + (on * size)[:, None] * (np.cos(ph)[:, None] * way[0] + 0.4 * np.sin(ph + 1)[:, None] * way[1] + 0.12 * np.cos(2 * ph)[:, None] * way[2])
    pos += np.stack([wander(rng, t, 0.1, 1, 0.06) for _ in range(3)], 1)
    slow = [moves(rng, t, -1.2, 1.2, (1.5, 4), (0.5, 3)) for _ in range(3)]
    rot = turn(Z, slow[0]) * turn(Y, slow[1]) * turn(X, slow[2]) * turn(way[1], on * rng.uniform(0.05, 0.3) * np.sin(ph)) * turn(way[2], wander(rng, t, 0.5, 2.5, 0.08))
    return chain(t, pos, rot, [(None, None, [0.05, 0.02, -0.03])])


def tumble(rng, t, place):
    """Turned by hand through all attitudes, as one calibrates a device."""
    angles = [np.cumsum(moves(rng, t, -2.2, 2.2, (0.8, 2.5), (0, 2))) / KNOT for _ in range(3)]
    pos = np.stack([wander(rng, t, 0.15, 1.2, 0.08) for _ in range(3)], 1) + [0, 0, 1]
    return chain(t, pos, turn(Z, angles[0]) * turn(X, angles[1]) * turn(Y, angles[2]), [(None, None, [0.04, 0, 0.05])])


def head(rng, t, place):
    yaw, pitch = moves(rng, t, -1.1, 1.1, (0.35, 0.9), (0.1, 1.5)), moves(rng, t, -0.6, 0.5, (0.4, 1.0), (0.3, 2.5))
    base = np.stack([wander(rng, t, 0.05, 0.6, 0.1), wander(rng, t, 0.05, 0.6, 0.1), 1.55 + wander(rng, t, 0.1, 1.8, 0.02)], 1)
    return chain(t, base, turn(Z, yaw), [(Y, pitch + wander(rng, t, 0.5, 3, 0.03), [0, 0, 0.08]), (X, wander(rng, t, 0.1, 1.5, 0.12), [0.1, 0.0, 0.12])])


def boat(rng, t, place):
    pos = np.stack([wander(rng, t, 0.05, 0.4, 0.3), wander(rng, t, 0.05, 0.4, 0.3), wander(rng, t, 0.12, 0.5, 0.25)], 1)
    return chain(t, pos, turn(Z, wander(rng, t, 0.02, 0.2, 0.4)), [(X, wander(rng, t, 0.12, 0.6, 0.16), Z * 0), (Y, wander(rng, t, 0.15, 0.8, 0.09) + wander(rng, t, 1.0, 3, 0.006), [1.5, 0.4, 1.8])])


def pedal(rng, t, place):
    cadence = rng.uniform(0.9, 1.7)
    ph = phase(rng, t, cadence, 0.15)
    hip = -0.75 + 0.4 * np.cos(ph) + 0.04 * np.cos(2 * ph + 1)
    knee = 1.2 + 0.55 * np.cos(ph - 2.6) + 0.06 * np.cos(2 * ph)
    rock = turn(X, 0.05 * np.cos(ph) + wander(rng, t, 0.1, 0.5, 0.03)) * turn(Z, 0.03 * np.cos(ph + 1))
    links = [(Y, hip, [0, 0.02, -0.2 if place == "thigh" else -0.42])]
    if place != "thigh":
        links += [(Y, knee, [0, 0.03, -0.2]), (Z, 0.05 * np.cos(ph + 0.5), Z * 0)]
    base = np.stack([wander(rng, t, 0.1, 0.5, 0.01), 0.01 * np.cos(ph), 0.9 + wander(rng, t, 0.5, 2, 0.004)], 1)
    return chain(t, base, rock, links)


def row(rng, t, place):
    f = rng.uniform(0.35, 0.6)
    ph = phase(rng, t, f, 0.08)
    slide = np.cos(ph) + 0.15 * np.cos(2 * ph + 1)
    base = np.stack([0.3 * slide, 0 * t, 0.4 + 0.01 * np.cos(ph)], 1)
    links = [(Y, 0.35 * np.cos(ph + 0.7), [0, 0, 0.45])]
    if place == "wrist":
        links += [(Y, -1.4 + 0.35 * np.cos(ph + 2), [0.3, 0.2, 0]), (Y, 0.8 + 0.7 * np.cos(ph - 2.3), [0.26, 0, 0]), (X, wander(rng, t, 0.2, 1.2, 0.1), Z * 0)]
    return chain(t, base, turn(Z, wander(rng, t, 0.05, 0.2, 0.05)), links)


def drone(rng, t, place):
    pos = np.stack([moves(rng, t, -3, 3, (1.5, 3.5), (0.2, 2)), moves(rng, t, -3, 3, (1.5, 3.5), (0.2, 2)), 2 + moves(rng, t, -0.8, 0.8, (1.5, 3), (0.5, 3))], 1)
    pos = gaussian_filter1d(pos, 12, axis=0)
    acc = gaussian_filter1d(np.gradient(np.gradient(pos, t, axis=0), t, axis=0), 12, axis=0)
    yaw = moves(rng, t, -1.5, 1.5, (1.5, 4), (1, 5))
    body = turn(Y, np.arctan2(acc[:, 0], 9.8)) * turn(X, -np.arctan2(acc[:, 1], 9.8)) * turn(Z, yaw)
    return chain(t, pos, body * turn(X, wander(rng, t, 1, 5, 0.015)) * turn(Y, wander(rng, t, 1, 5, 0.015)), [(None, None, [0.05, 0, 0.03])])


def dance(rng, t, place):
    beat = rng.uniform(1.6, 2.3)
    ph = phase(rng, t, beat / 2, 0.02)
    spin = np.cumsum(moves(rng, t, -3.0, 3.0, (0.5, 1.5), (0, 2))) / KNOT
    base = np.stack([wander(rng, t, 0.1, 0.8, 0.25), wander(rng, t, 0.1, 0.8, 0.25), 1 + 0.035 * np.cos(2 * ph)], 1)
    w = lambda s: wander(rng, t, beat / 5, beat * 0.8, s)
    if place == "wrist":
        return chain(t, base + [0, 0, 0.4], turn(Z, spin), arm_links((w(0.5), w(0.5), w(0.3)), 1 + w(0.4), w(0.5), w(0.3)))
    return chain(t, base, turn(Z, spin), [(X, 0.12 * np.cos(ph) + w(0.04), [0, 0, 0.15]), (Y, w(0.08), [-0.1, 0, 0.05])])


# name -> (function, placements)
FAMILIES = {
    "walk": (lambda r, t, p: gait(r, t, p, False), ("wrist", "shank", "thigh", "pelvis", "foot", "chest")),
    "run": (lambda r, t, p: gait(r, t, p, True), ("wrist", "shank", "thigh", "lumbar", "foot")),
    "reach": (reach, ("hand", "wrist")), "lift": (lift, ("wrist", "trunk")), "gesture": (gesture, ("hand", "wrist")),
    "sport": (sport, ("wrist", "racket")), "robot": (robot, ("gripper", "flange")), "car": (car, ("chassis",)), "pendulum": (pendulum, ("bob",)),
    "shake": (shake, ("phone", "handheld")), "tumble": (tumble, ("device",)), "head": (head, ("head",)), "boat": (boat, ("mast",)),
    "pedal": (pedal, ("shank", "thigh")), "row": (row, ("wrist", "trunk")), "drone": (drone, ("airframe",)), "dance": (dance, ("wrist", "sacrum")),
}
WEIGHTS = {"walk": 3, "run": 2, "reach": 3, "lift": 2, "gesture": 3, "sport": 2, "robot": 2, "car": 1, "pendulum": 1.2, "shake": 2, "tumble": 1, "head": 1.2,
           "boat": 0.6, "pedal": 1.2, "row": 1, "drone": 1, "dance": 1.5}
BODY = ("walk", "run", "lift", "dance", "row", "pedal", "gesture", "reach")


def make(rng, family, place, begin, end):
    t = np.arange(np.floor((begin - 4) * KNOT), np.ceil((end + 4) * KNOT) + 1) / KNOT
    position, rotation = FAMILIES[family][0](rng, t, place)
    # a fixed turn and place of the mount frame in its segment, so that no axis lies along the world's by design
    fixed = Rotation.random(random_state=int(rng.integers(2 ** 31))) if rng.random() < 0.5 else Rotation.from_euler("xyz", rng.choice([0, 90, 180, -90], 3), degrees=True)
    return Motion(t, position, rotation * fixed)
