"""What the humanoid does: targets of its servos (radians), and the help that it gets, as functions of time.

No person was recorded and no policy learnt: targets are scripted, the servos are soft, and what happens (landings,
wobbling, slipping, bouncing off the floor) is the engine's. Where a soft spring helps to keep the pelvis upright or in
its place this is said at the motion. Its springs are damped: `upright` Nm/rad, `along` N/m on the
horizontal place, `lift` N/m on the height.
"""

from dataclasses import dataclass, field

import numpy as np

from humanoid import servo_names

PI = np.pi


@dataclass
class Support:
    """A soft spring at the pelvis: stiffnesses, and the place and heading that it pulls to."""

    upright: float = 0.0
    along: float = 0.0
    lift: float = 0.0
    place: tuple = (0.0, 0.0, 0.965)
    heading: float = 0.0


@dataclass
class Command:
    """What a motion asks for at a time."""

    targets: dict = field(default_factory=dict)
    support: Support = field(default_factory=Support)
    stiffness: float = 1.0
    push: tuple = (0.0, 0.0, 0.0)  # N, at the torso


def smooth(t, start, end):
    """0 before start, 1 after end, minimum jerk between (Flash and Hogan 1985)."""
    s = (t - start) / (end - start)
    s = np.clip(s, 0.0, 1.0) if isinstance(t, np.ndarray) else min(max(s, 0.0), 1.0)
    return s**3 * (10 - 15 * s + 6 * s**2)


def through(t, points):
    """Minimum-jerk moves: points are (when it starts, how long it takes, target)."""
    value = points[0][2]
    for start, lasts, target in points[1:]:
        value += (target - value) * smooth(t, start, start + lasts)
    return value


NAMES = servo_names()
DRAWS = np.random.default_rng(1)
SWAY_HZ, SWAY_PHASE = DRAWS.uniform(0.15, 1.1, (len(NAMES), 5)), DRAWS.uniform(0, 2 * PI, (len(NAMES), 5))


def standing(t, size=0.012):
    """Stands and sways: five sines between 0.15 and 1.1 Hz a joint, `size` rad together."""
    values = size * np.sin(2 * PI * SWAY_HZ * t + SWAY_PHASE).sum(1) / np.sqrt(5)
    targets = dict(zip(NAMES, values))
    for side in ("left", "right"):
        targets[f"{side}_knee"] = 0.12 + 0.5 * targets[f"{side}_knee"]
        targets[f"{side}_hip_flex"] += 0.06
        targets[f"{side}_ankle_flex"] = 0.06 + 0.3 * targets[f"{side}_ankle_flex"]
        targets[f"{side}_elbow"] += 0.25
        targets[f"{side}_shoulder_side"] += 0.12
    return targets


def gait(targets, phase, size, stride):
    """Adds a stride: hip, knee and ankle of both legs, arms against them. phase in cycles, size 0 to 1."""
    for side, lag in (("left", 0.0), ("right", 0.5)):
        c = 2 * PI * (phase + lag)
        swing = np.exp(-((((phase + lag) % 1.0) - 0.72) ** 2) / (2 * 0.085**2))
        loading = np.exp(-((((phase + lag) % 1.0) - 0.14) ** 2) / (2 * 0.06**2))
        targets[f"{side}_hip_flex"] += size * stride * (0.12 + 0.42 * np.cos(c))
        targets[f"{side}_knee"] += size * (1.05 * stride * swing + 0.22 * loading)
        targets[f"{side}_ankle_flex"] += size * (0.10 * np.sin(c + 0.4) - 0.28 * np.exp(-((((phase + lag) % 1.0) - 0.58) ** 2) / 0.008))
        targets[f"{side}_shoulder_flex"] -= size * stride * 0.38 * np.cos(c + 0.15)
        targets[f"{side}_elbow"] += size * stride * (0.25 - 0.18 * np.cos(c))
    targets["waist_turn"] += size * 0.09 * np.cos(2 * PI * phase)
    targets["waist_side"] += size * 0.04 * np.sin(2 * PI * phase)


def walk(t):
    """Stands, walks ten steps along a bend, stops. Spring on uprightness, place and half of the weight."""
    pace = smooth(t, 1.0, 2.0) - smooth(t, 6.6, 7.5)
    # The integral of the pace, in strides of 0.95 Hz.
    done = np.interp(t, GRID, STRIDES)
    targets = standing(t)
    gait(targets, done, pace, 1.0)
    heading = 0.5 * smooth(t, 3.0, 6.0)
    far = 1.18 * done
    place = (far * np.cos(0.5 * heading), far * np.sin(0.5 * heading), 0.955)
    return Command(targets, Support(4000, 1500, 5000, place, heading))


GRID = np.linspace(0.0, 12.0, 2401)
STRIDES = np.concatenate([[0.0], np.cumsum((smooth(GRID, 1.0, 2.0) - smooth(GRID, 6.6, 7.5))[1:] * 0.95 * 0.005)])


def run(t):
    """Runs in place at 1.4 strides a second, in two bouts. Spring on uprightness and place."""
    bouts = smooth(t, 0.8, 1.3) - smooth(t, 3.6, 4.0) + smooth(t, 5.0, 5.4) - smooth(t, 7.0, 7.4)
    phase = 1.4 * t
    targets = standing(t)
    for side, lag in (("left", 0.0), ("right", 0.5)):
        up = max(0.0, np.sin(2 * PI * (phase + lag))) ** 1.3
        down = max(0.0, -np.sin(2 * PI * (phase + lag)))
        targets[f"{side}_hip_flex"] += bouts * (0.10 + 1.0 * up)
        targets[f"{side}_knee"] += bouts * (0.20 + 1.45 * up)
        targets[f"{side}_ankle_flex"] += bouts * (0.12 - 0.55 * down)
        targets[f"{side}_shoulder_flex"] += bouts * 0.7 * np.sin(2 * PI * (phase + lag + 0.5))
        targets[f"{side}_elbow"] += bouts * 1.25
    return Command(targets, Support(4000, 4000, 1500, (-0.1, 0, 1.0)))


def jump(t):
    """Two jumps from a crouch, with arms; lands, and stands. Spring on uprightness and place."""
    targets = standing(t)
    for start in (1.4, 5.0):
        crouch = smooth(t, start, start + 0.7) - smooth(t, start + 0.80, start + 0.98)
        ready = smooth(t, start + 1.0, start + 1.2) - smooth(t, start + 1.9, start + 2.7)
        off = smooth(t, start + 0.82, start + 0.98) - smooth(t, start + 1.1, start + 1.3)
        arms = -0.8 * (smooth(t, start, start + 0.6) - smooth(t, start + 0.72, start + 0.95))
        arms += 2.2 * (smooth(t, start + 0.72, start + 1.0) - smooth(t, start + 1.3, start + 2.0))
        for side in ("left", "right"):
            targets[f"{side}_hip_flex"] += 1.35 * crouch + 0.45 * ready
            targets[f"{side}_knee"] += 1.65 * crouch + 0.75 * ready
            targets[f"{side}_ankle_flex"] += 0.5 * crouch + 0.3 * ready - 0.75 * off
            targets[f"{side}_shoulder_flex"] += arms
            targets[f"{side}_elbow"] += 0.4 * crouch
        targets["waist_flex"] += 0.5 * crouch + 0.15 * ready
    return Command(targets, Support(1500, 1500, 0, (-0.1, 0, 0.965)))


def reach(t):
    """Fast reaches of both arms, 0.25 to 0.7 s each, with rests between. Spring on uprightness and place."""
    targets = standing(t, 0.006)
    plan = {
        "left_shoulder_flex": [(0, 0, 0.0), (1.0, 0.5, 1.4), (2.0, 0.4, 0.6), (3.2, 0.3, 1.9), (4.4, 0.6, 0.1), (6.0, 0.25, 1.2), (6.4, 0.25, 0.2), (7.6, 0.5, 0.7)],
        "left_shoulder_side": [(0, 0, 0.0), (2.0, 0.4, 0.9), (3.2, 0.3, 0.1), (6.0, 0.25, 0.5), (6.4, 0.25, 0.0)],
        "left_shoulder_turn": [(0, 0, 0.0), (1.0, 0.5, 0.5), (3.2, 0.3, -0.6), (4.4, 0.6, 0.3), (7.6, 0.5, -0.3)],
        "left_elbow": [(0, 0, 0.2), (1.0, 0.5, 0.5), (1.5, 0.35, 1.7), (2.0, 0.4, 0.3), (3.2, 0.3, 1.2), (4.4, 0.6, 0.2), (6.0, 0.25, 1.6), (6.4, 0.25, 0.3), (7.6, 0.5, 1.9)],
        "right_shoulder_flex": [(0, 0, 0.0), (2.6, 0.4, 1.2), (4.9, 0.5, 0.0), (7.0, 0.4, 1.5)],
        "right_elbow": [(0, 0, 0.2), (2.6, 0.4, 1.5), (4.9, 0.5, 0.3), (7.0, 0.4, 0.6)],
        "waist_turn": [(0, 0, 0.0), (2.0, 0.5, 0.5), (3.2, 0.4, -0.3), (4.4, 0.8, 0.0)],
        "waist_flex": [(0, 0, 0.0), (6.0, 0.4, 0.3), (6.8, 0.6, 0.0)],
        "neck_turn": [(0, 0, 0.0), (1.9, 0.35, 0.7), (3.1, 0.3, -0.5), (4.3, 0.4, 0.0)],
    }
    for name, points in plan.items():
        targets[name] += through(t, points)
    return Command(targets, Support(900, 1500, 3000, (0, 0, 0.96)))


def fall(t):
    """Stands, is pushed, gives way and falls; moves an arm and a leg on the floor. Spring until the push."""
    targets = standing(t)
    held = 1.0 - smooth(t, 2.0, 2.1)
    weak = smooth(t, 2.15, 2.4)
    for side in ("left", "right"):
        targets[f"{side}_knee"] += 0.9 * weak
        targets[f"{side}_hip_flex"] += 0.5 * weak
    targets["left_shoulder_side"] += 1.0 * smooth(t, 2.2, 2.6) + 0.5 * np.sin(2 * PI * 1.1 * t) * (smooth(t, 5.2, 5.5) - smooth(t, 6.8, 7.1))
    targets["left_elbow"] += 0.8 * smooth(t, 5.0, 5.5)
    targets["left_knee"] += 0.8 * (smooth(t, 5.6, 6.2) - smooth(t, 6.6, 7.2))
    push = (190.0, 70.0, 0.0) if 2.05 <= t < 2.30 else (0.0, 0.0, 0.0)
    support = Support(500 * held, 800 * held, 0, (0, 0, 0.965))
    return Command(targets, support, 1.0 - 0.8 * weak, push)


def burst(t):
    """Stands still, then shakes, ducks and turns in bursts of half a second. Spring on uprightness and place."""
    targets = standing(t, 0.008)
    shake = lambda at, width: np.exp(-(((t - at) / width) ** 2) / 2)
    targets["left_elbow"] += 0.9 + 0.5 * np.sin(2 * PI * 5.5 * t) * shake(2.5, 0.18) + 0.4 * np.sin(2 * PI * 7.5 * t) * shake(6.6, 0.12)
    targets["left_shoulder_turn"] += 0.5 * np.sin(2 * PI * 4.5 * t) * shake(2.6, 0.2)
    targets["left_shoulder_flex"] += 0.6 * np.sin(2 * PI * 3.0 * t) * shake(6.5, 0.25)
    duck = smooth(t, 4.2, 4.45) - smooth(t, 4.5, 4.8)
    for side in ("left", "right"):
        targets[f"{side}_hip_flex"] += 0.9 * duck
        targets[f"{side}_knee"] += 1.2 * duck
        targets[f"{side}_ankle_flex"] += 0.35 * duck
    targets["waist_turn"] += 0.6 * np.sin(2 * PI * 2.2 * t) * shake(5.6, 0.2)
    targets["neck_turn"] += 0.6 * np.sin(2 * PI * 3.2 * t) * shake(3.4, 0.15)
    targets["left_ankle_side"] += 0.15 * np.sin(2 * PI * 6.0 * t) * shake(7.3, 0.1)
    return Command(targets, Support(700, 900, 500, (0, 0, 0.96)))


# Name, seconds.
MOTIONS = {walk: 8.5, run: 8.0, jump: 8.0, reach: 8.5, fall: 8.0, burst: 8.0}
