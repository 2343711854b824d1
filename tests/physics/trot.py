"""What the quadruped does: a trot with feet placed by the speed (after Raibert 1986), and moves of the trunk on the spot.

Scripts say, by time, how fast it shall walk and turn and how the trunk shall lean; the rest is the engine's.
"""

from dataclasses import dataclass

import numpy as np

from motions import smooth, through
from quadruped import HIP_X, HIP_Y, LEGS, OUT, angles, signs

HEIGHT, LIFT = 0.30, 0.055  # m: the trunk above the feet; a swinging foot above the floor
PERIOD_S, GROUNDED = 0.46, 0.56  # of a stride, and the part of it that a foot stands
PLACING_S = 0.09  # a foot goes so far ahead per m/s of too much speed
LEVEL = 0.35  # how much of a wrong lean the legs take back


@dataclass
class Wish:
    """What a script asks for: m/s and rad/s, in the trunk's axes, and the trunk's lean (rad) and lift (m)."""

    ahead: float = 0.0
    sideways: float = 0.0
    turning: float = 0.0
    trotting: float = 0.0  # 0 stands, 1 trots
    roll: float = 0.0
    pitch: float = 0.0
    yaw: float = 0.0
    lift: float = 0.0


def window(t, start, end, ramp=0.6):
    return smooth(t, start, start + ramp) - smooth(t, end - ramp, end)


def session(t):
    """19 s: leans and turns of the trunk on the spot, then a trot with bends to both sides and a step aside."""
    lean = window(t, 1.0, 7.4)
    wave = lambda hertz, phase: lean * np.sin(2 * np.pi * hertz * t + phase)
    return Wish(
        ahead=through(t, [(0, 0, 0.0), (8.2, 1.2, 0.5), (11.4, 1.0, 0.2), (13.4, 1.0, 0.6), (16.8, 1.0, 0.0)]),
        sideways=through(t, [(0, 0, 0.0), (11.4, 1.0, 0.15), (13.4, 0.8, 0.0)]),
        turning=through(t, [(0, 0, 0.0), (9.0, 1.0, 0.9), (11.8, 1.0, -1.1), (15.6, 1.0, 0.3), (16.8, 0.8, 0.0)]),
        trotting=window(t, 7.8, 18.0),
        roll=0.16 * wave(0.9, 0.0) + 0.07 * wave(1.7, 1.0),
        pitch=0.13 * wave(0.7, 2.0) + 0.06 * wave(1.9, 0.5),
        yaw=0.17 * wave(0.5, 4.0) + 0.06 * wave(1.4, 2.5),
        lift=0.02 * wave(0.8, 5.0),
    )


def check(t):
    """14 s, another run: a faster trot in a curve to the right, a short nod, a trot backwards."""
    nod = window(t, 6.6, 9.4)
    return Wish(
        ahead=through(t, [(0, 0, 0.0), (1.2, 1.2, 0.75), (5.2, 0.9, 0.0), (9.6, 1.0, -0.35), (12.2, 0.8, 0.0)]),
        turning=through(t, [(0, 0, 0.0), (1.8, 1.0, -1.0), (5.2, 0.8, 0.0), (9.8, 0.8, 0.8), (12.2, 0.8, 0.0)]),
        trotting=window(t, 0.8, 6.4) + window(t, 9.4, 13.2),
        roll=0.12 * nod * np.sin(2 * np.pi * 1.3 * t),
        pitch=0.15 * nod * np.sin(2 * np.pi * 1.0 * t),
        yaw=0.14 * nod * np.sin(2 * np.pi * 0.8 * t),
    )


SCRIPTS = {session: 19.0, check: 14.0}


def turned(roll, pitch, yaw):
    """Rz(yaw) Ry(pitch) Rx(roll)."""
    (cr, cp, cy), (sr, sp, sy) = np.cos([roll, pitch, yaw]), np.sin([roll, pitch, yaw])
    about_z = np.array([[cy, -sy, 0], [sy, cy, 0], [0, 0, 1.0]])
    about_y = np.array([[cp, 0, sp], [0, 1.0, 0], [-sp, 0, cp]])
    about_x = np.array([[1.0, 0, 0], [0, cr, -sr], [0, sr, cr]])
    return about_z @ about_y @ about_x


class Trot:
    """Targets of the servos, step by step. Feet are places on a level floor below the trunk."""

    def __init__(self):
        self.rest = {leg: self.below(leg) for leg in LEGS}
        self.feet = {leg: place.copy() for leg, place in self.rest.items()}
        self.lifted = dict(self.feet)
        self.phase = 0.0
        self.swings = dict.fromkeys(LEGS, False)

    @staticmethod
    def below(leg):
        ahead, left = signs(leg)
        return np.array([HIP_X * ahead - 0.01, (HIP_Y + OUT) * left, 0.0])

    def step(self, wish, rotation, velocity, dt):
        """Angles of all joints, from what is asked and the trunk's state (its velocity in the world)."""
        heading = np.arctan2(rotation[1, 0], rotation[0, 0])
        level = turned(0, 0, heading).T
        speed = (level @ velocity)[:2]
        asked = np.array([wish.ahead, wish.sideways])
        self.phase = (self.phase + dt / PERIOD_S * (wish.trotting > 0.0)) % 1.0
        for leg in LEGS:
            self.move(leg, wish, asked, speed, dt)
        own = level @ rotation
        roll, pitch = np.arctan2(own[2, 1], own[2, 2]), -np.arcsin(own[2, 0])
        lean = turned(wish.roll + LEVEL * (wish.roll - roll), wish.pitch + LEVEL * (wish.pitch - pitch), wish.yaw)
        down = np.array([0, 0, HEIGHT + wish.lift])
        return np.concatenate([angles(leg, lean.T @ (self.feet[leg] - down)) for leg in LEGS])

    def move(self, leg, wish, asked, speed, dt):
        """One foot: goes back with the floor while it stands, and to where it shall land while it swings."""
        ahead, left = signs(leg)
        phase = (self.phase + (0.5 if ahead * left > 0 else 0.0)) % 1.0
        swings = phase > GROUNDED and wish.trotting > 0.0
        rest, foot = self.rest[leg], self.feet[leg]
        flow = asked + wish.turning * np.array([-rest[1], rest[0]])
        if swings and not self.swings[leg]:
            self.lifted[leg] = foot.copy()
        self.swings[leg] = swings
        if not swings:
            foot[:2] -= flow * dt
            foot[2] = 0.0
            return
        part = (phase - GROUNDED) / (1 - GROUNDED)
        landing = rest[:2] + flow * (0.5 * GROUNDED * PERIOD_S) + PLACING_S * (speed - asked) * wish.trotting
        foot[:2] = self.lifted[leg][:2] + (landing - self.lifted[leg][:2]) * smooth(part, 0.0, 0.9)
        foot[2] = LIFT * wish.trotting * np.sin(np.pi * part) ** 2
