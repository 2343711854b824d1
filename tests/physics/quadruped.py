"""A quadruped of 12 joints, 14 kg, as MuJoCo's XML, with three sites that carry an IMU.

x points ahead, y to the left, z up. A trunk and four alike legs, each of a hip (about x), a thigh and a shank (about y),
with a ball of rubber as its foot. Sizes and masses are round numbers of a machine that one person can carry; nothing is
copied from another model.
"""

import numpy as np

LEGS = ("fl", "fr", "hl", "hr")  # fore, hind; left, right
HIP_X, HIP_Y = 0.20, 0.06  # m, from the trunk's middle to the axis of a hip
OUT, LINK, FOOT = 0.08, 0.21, 0.022  # m: hip to thigh sideways, thigh and shank, radius of the foot
KP, KV, TORQUE = 150.0, 4.0, 45.0  # Nm/rad, Nm s/rad, Nm
JOINTS = ("hip", "thigh", "shank")

# Where the IMUs are: (body, place in m, turn as w x y z).
TRUNK_IMU = (-0.08, 0.03, 0.055)
SHANK_IMU = (0.025, 0.0, -0.09)
SHANK_TURN = (0.70710678, 0.0, 0.70710678, 0.0)  # x of the chip points down along the shank
# Rubber mounts of the IMU at the left fore shank: a mass on springs along each axis.
RUBBER_HZ, RUBBER_DAMPING, RUBBER_KG = 14.0, 0.2, 0.03


def signs(leg):
    """(1 for fore, -1 for hind), (1 for left, -1 for right)."""
    return (1 if leg[0] == "f" else -1), (1 if leg[1] == "l" else -1)


def joint_places(leg):
    """Translations from the trunk to hip, from hip to thigh, from thigh to shank, m."""
    ahead, left = signs(leg)
    return (HIP_X * ahead, HIP_Y * left, 0.0), (0.0, OUT * left, 0.0), (0.0, 0.0, -LINK)


def angles(leg, foot):
    """Angles of hip, thigh and shank that bring the foot's middle to a place in the trunk's axes."""
    x, y, z = np.subtract(foot, joint_places(leg)[0])
    out = OUT * signs(leg)[1]
    height = np.sqrt(max(y * y + z * z - out * out, 1e-4))
    hip = np.arctan2(z, y) - np.arctan2(-height, out)
    hip = (hip + np.pi) % (2 * np.pi) - np.pi
    reach = min(np.hypot(x, height), 1.96 * LINK)
    knee = -2 * np.arccos(reach / (2 * LINK))
    return hip, np.arctan2(-x, height) - knee / 2, knee


def rubber():
    """The joints of a mass on rubber, and what rides on it."""
    omega = 2 * np.pi * RUBBER_HZ
    stiffness, damping = RUBBER_KG * omega**2, 2 * RUBBER_DAMPING * RUBBER_KG * omega
    joints = "".join(
        f'<joint name="rubber_{axis}" type="slide" axis="{" ".join(str(int(axis == other)) for other in "xyz")}"'
        f' stiffness="{stiffness}" damping="{damping}" armature="0"/>'
        for axis in "xyz"
    )
    return joints + f'<geom type="box" size="0.015 0.012 0.005" mass="{RUBBER_KG}" contype="0" conaffinity="0"/>'


def imu(leg):
    place, turn = (" ".join(map(str, values)) for values in (SHANK_IMU, SHANK_TURN))
    site = f'<site name="shank_{leg}" pos="{{}}" quat="{turn}"/>'
    if leg == "fl":
        return f'<body name="mounted" pos="{place}">{rubber()}{site.format("0 0 0")}</body>'
    return site.format(place) if leg == "hr" else ""


def leg_xml(leg):
    hip, thigh, shank = (" ".join(map(str, place)) for place in joint_places(leg))
    return f"""
    <body name="hip_{leg}" pos="{hip}">
      <joint name="hip_{leg}" axis="1 0 0"/>
      <geom type="capsule" fromto="0 0 0 {thigh}" size="0.035" mass="0.6"/>
      <body name="thigh_{leg}" pos="{thigh}">
        <joint name="thigh_{leg}" axis="0 1 0"/>
        <geom type="capsule" fromto="0 0 0 {shank}" size="0.025" mass="0.9"/>
        <body name="shank_{leg}" pos="{shank}">
          <joint name="shank_{leg}" axis="0 1 0"/>
          <geom type="capsule" fromto="0 0 0 0 0 -{LINK}" size="0.012" mass="0.18"/>
          <geom type="sphere" pos="0 0 -{LINK}" size="{FOOT}" mass="0.05" contype="1"/>{imu(leg)}
        </body>
      </body>
    </body>"""


def xml(step_s):
    """The model. Feet are rubber (time constant 12 ms); nothing but feet and trunk touches the floor."""
    names = [f"{joint}_{leg}" for leg in LEGS for joint in JOINTS]
    servos = "".join(
        f'<position name="{name}" joint="{name}" kp="{KP}" kv="{KV}" forcerange="-{TORQUE} {TORQUE}"/>' for name in names
    )
    sites = ("trunk", "shank_fl", "shank_hr")
    sensors = "".join(
        f'<accelerometer name="{site}_force" site="{site}"/><gyro name="{site}_rate" site="{site}"/>' for site in sites
    )
    return f"""
<mujoco model="cromosim quadruped">
  <compiler angle="radian" autolimits="true"/>
  <option timestep="{step_s}" integrator="RK4" gravity="0 0 -9.80665" cone="elliptic"/>
  <default>
    <geom solref="0.012 1" friction="0.9 0.01 0.001" contype="0" conaffinity="0" condim="3"/>
    <joint damping="0.05" armature="0.01"/>
  </default>
  <worldbody>
    <geom name="floor" type="plane" size="0 0 1" contype="0" conaffinity="1"/>
    <body name="base_link" pos="0 0 0.34">
      <freejoint name="root"/>
      <geom type="box" size="0.24 0.07 0.05" mass="7" contype="1"/>
      <site name="trunk" pos="{" ".join(map(str, TRUNK_IMU))}"/>
      {"".join(map(leg_xml, LEGS))}
    </body>
  </worldbody>
  <actuator>{servos}</actuator>
  <sensor>{sensors}</sensor>
</mujoco>"""
