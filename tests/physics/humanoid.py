"""A humanoid of 13 capsules, 78 kg, as MuJoCo's XML, with six sites that carry an IMU.

x points ahead, y to the left, z up. Masses of segments follow de Leva (1996) to a few per cent, lengths are those of a
person of 1.75 m, rounded; nothing is copied from another model. Joints are servos: torque = kp (target - angle) - kv
rate, within a limit. Heels and toes touch the floor, and in a fall everything does.
"""

SITES = ["wrist", "upper_arm", "pelvis", "thigh", "foot", "head"]

# Joint: axis, range in degrees, kp in Nm/rad, kv in Nm s/rad, limit in Nm.
SERVO = {
    "waist_flex": ("0 1 0", (-30, 70), 600, 40, 300),
    "waist_side": ("1 0 0", (-35, 35), 600, 40, 300),
    "waist_turn": ("0 0 1", (-45, 45), 400, 25, 200),
    "neck_flex": ("0 1 0", (-40, 40), 60, 3, 50),
    "neck_turn": ("0 0 1", (-60, 60), 40, 2, 40),
    "shoulder_flex": ("0 -1 0", (-60, 180), 150, 8, 120),
    "shoulder_side": ("1 0 0", (-30, 150), 150, 8, 120),
    "shoulder_turn": ("0 0 1", (-80, 80), 60, 2.5, 60),
    "elbow": ("0 -1 0", (0, 145), 90, 3.5, 90),
    "hip_flex": ("0 -1 0", (-30, 120), 700, 40, 350),
    "hip_side": ("1 0 0", (-30, 45), 600, 35, 300),
    "hip_turn": ("0 0 1", (-40, 40), 250, 12, 150),
    "knee": ("0 1 0", (-4, 150), 700, 30, 350),
    "ankle_flex": ("0 -1 0", (-50, 35), 300, 14, 250),
    "ankle_side": ("1 0 0", (-20, 20), 150, 6, 80),
}


def joint(name, side=""):
    """A joint's XML. On the right side the axes of sideways motion and turns are mirrored."""
    axis, limits, *_ = SERVO[name]
    if side == "right" and name.split("_")[-1] in ("side", "turn"):
        axis = " ".join(str(-float(part)) for part in axis.split())
    full = f"{side}_{name}" if side else name
    return f'<joint name="{full}" axis="{axis}" range="{limits[0]} {limits[1]}"/>'


def servo_names():
    """Actuators in their order: those of the trunk, then of the left and of the right side."""
    trunk = [name for name in SERVO if name.split("_")[0] in ("waist", "neck")]
    limbs = [name for name in SERVO if name not in trunk]
    return trunk + [f"{side}_{name}" for side in ("left", "right") for name in limbs]


def arm(side):
    y = 1 if side == "left" else -1
    site = '<site name="upper_arm" pos="0.01 0.05 -0.17" euler="-80 15 5"/>' if side == "left" else ""
    wrist = '<site name="wrist" pos="0.005 0.032 -0.235" euler="-90 10 -20"/>' if side == "left" else ""
    return f"""
    <body name="{side}_upper_arm" pos="0 {0.19 * y} 0.42">
      {joint("shoulder_flex", side)}{joint("shoulder_side", side)}{joint("shoulder_turn", side)}
      <geom type="capsule" fromto="0 0 -0.02 0 0 -0.27" size="0.043" mass="2.1"/>{site}
      <body name="{side}_forearm" pos="0 0 -0.29">
        {joint("elbow", side)}
        <geom type="capsule" fromto="0 0 -0.02 0 0 -0.25" size="0.033" mass="1.25"/>
        <geom type="capsule" fromto="0 0 -0.28 0 0 -0.38" size="0.035" mass="0.47"/>{wrist}
      </body>
    </body>"""


def leg(side):
    y = 1 if side == "left" else -1
    thigh = '<site name="thigh" pos="0.01 0.078 -0.24" euler="-90 -5 10"/>' if side == "left" else ""
    foot = '<site name="foot" pos="0.08 0.01 -0.02" euler="0 20 -6"/>' if side == "left" else ""
    return f"""
    <body name="{side}_thigh" pos="0 {0.09 * y} -0.04">
      {joint("hip_flex", side)}{joint("hip_side", side)}{joint("hip_turn", side)}
      <geom type="capsule" fromto="0 0 -0.05 0 0 -0.38" size="0.07" mass="10.4"/>{thigh}
      <body name="{side}_shank" pos="0 0 -0.43">
        {joint("knee", side)}
        <geom type="capsule" fromto="0 0 -0.03 0 0 -0.38" size="0.048" mass="3.3"/>
        <body name="{side}_foot" pos="0 0 -0.42">
          {joint("ankle_flex", side)}{joint("ankle_side", side)}
          <geom type="capsule" fromto="-0.045 {0.025 * y} -0.05 0.13 {0.03 * y} -0.055" size="0.025" mass="0.6"/>
          <geom type="capsule" fromto="-0.045 {-0.025 * y} -0.05 0.13 {-0.02 * y} -0.055" size="0.025" mass="0.6"/>{foot}
        </body>
      </body>
    </body>"""


def xml(step_s):
    """The model. Contacts are soft (time constant 30 ms), as soles and skin are."""
    kinds = {name: SERVO[name.removeprefix("left_").removeprefix("right_")] for name in servo_names()}
    servos = "".join(
        f'<position name="{name}" joint="{name}" kp="{kp}" kv="{kv}" forcerange="{-limit} {limit}"/>'
        for name, (_, _, kp, kv, limit) in kinds.items()
    )
    sensors = "".join(
        f'<accelerometer name="{site}_force" site="{site}"/><gyro name="{site}_rate" site="{site}"/>' for site in SITES
    )
    return f"""
<mujoco model="cromosim humanoid">
  <compiler angle="degree" autolimits="true"/>
  <option timestep="{step_s}" integrator="RK4" gravity="0 0 -9.80665" cone="elliptic"/>
  <default>
    <geom solref="0.03 1" friction="1.0 0.01 0.001" contype="1" conaffinity="0" condim="3"/>
    <joint damping="0.3" armature="0.01" solreflimit="0.03 1"/>
  </default>
  <worldbody>
    <geom name="floor" type="plane" size="0 0 1" contype="0" conaffinity="1"/>
    <body name="pelvis" pos="0 0 0.98">
      <freejoint name="root"/>
      <geom type="capsule" fromto="0 -0.07 0 0 0.07 0" size="0.105" mass="9"/>
      <site name="pelvis" pos="-0.11 0.01 0.03" euler="5 -85 3"/>
      <body name="torso" pos="0 0 0.12">
        {joint("waist_flex")}{joint("waist_side")}{joint("waist_turn")}
        <geom type="capsule" fromto="0 0 0.08 0 0 0.32" size="0.125" mass="24"/>
        <geom type="capsule" fromto="0 -0.13 0.40 0 0.13 0.40" size="0.05" mass="2.5"/>
        <body name="head" pos="0 0 0.48">
          {joint("neck_flex")}{joint("neck_turn")}
          <geom type="capsule" fromto="0 0 0.08 0.01 0 0.15" size="0.09" mass="5.2"/>
          <site name="head" pos="0.085 0.01 0.16" euler="0 80 8"/>
        </body>
        {arm("left")}{arm("right")}
      </body>
      {leg("left")}{leg("right")}
    </body>
  </worldbody>
  <actuator>{servos}</actuator>
  <sensor>{sensors}</sensor>
</mujoco>"""
