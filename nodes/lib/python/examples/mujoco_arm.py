"""A MuJoCo arm's ideal IMU becomes a real device's, and agrees with the one that its poses give.

    python mujoco_arm.py        (needs `pip install mujoco`)

The first comparison is of two ways to the same readings: MuJoCo's own accelerometer and gyroscope, and
`simulate_rigid` on the poses of the sensor's site.
"""

import mujoco
import numpy as np

import cromosim

ARM = """
<mujoco>
  <option timestep="0.001" integrator="RK4"/>
  <worldbody>
    <body pos="0 0 1">
      <joint name="shoulder" axis="0 1 0" damping="0.02"/>
      <geom type="capsule" fromto="0 0 0 0.3 0 0" size="0.02" mass="1"/>
      <body pos="0.3 0 0">
        <joint name="elbow" axis="0 0 1" damping="0.02"/>
        <geom type="capsule" fromto="0 0 0 0.25 0 0" size="0.02" mass="0.7"/>
        <site name="imu" pos="0.2 0 0.02"/>
      </body>
    </body>
  </worldbody>
  <sensor>
    <accelerometer site="imu"/>
    <gyro site="imu"/>
  </sensor>
</mujoco>
"""
SECONDS, RATE_HZ = 5.0, 200.0


def swing():
    """Stamps, positions, quaternions x, y, z, w, specific force, angular velocity of the falling arm."""
    model = mujoco.MjModel.from_xml_string(ARM)
    data = mujoco.MjData(model)
    data.qvel[:] = [0.5, 3.0]
    rows = []
    every = round(1 / RATE_HZ / model.opt.timestep)
    for step in range(round(SECONDS / model.opt.timestep)):
        # Sensors and site of the same instant.
        mujoco.mj_forward(model, data)
        if step % every == 0:
            turn = np.empty(4)
            mujoco.mju_mat2Quat(turn, data.site_xmat[0])
            rows.append((data.time, *data.site_xpos[0], *turn[[1, 2, 3, 0]], *data.sensordata))
        mujoco.mj_step(model, data)
    table = np.array(rows)
    return np.split(table, [1, 4, 8, 11], axis=1)


def main() -> dict[str, float]:
    stamps, positions, turns, force, rate = swing()
    stamps = stamps[:, 0]
    # The two clocks are the same; `scheme="spline"` takes the poses as exact.
    ours = cromosim.simulate_rigid(
        stamps, positions, turns, rate_hz=RATE_HZ, scheme="spline", trim_s=0
    )
    count = min(len(ours), len(stamps))
    middle = slice(40, count - 40)
    differences = {
        "specific_force": np.abs(ours.specific_force - force[:count])[middle].max(),
        "angular_velocity": np.abs(ours.angular_velocity - rate[:count])[middle].max(),
    }
    print(f"poses against MuJoCo's accelerometer: {differences['specific_force']:.4f} m/s2 at most")
    print(f"poses against MuJoCo's gyroscope: {differences['angular_velocity']:.5f} rad/s at most")

    device = cromosim.Device(
        {"accel_bias": {"bias": [0.1, -0.05, 0.08]}, "gyro_bias": {"bias": [0.01, 0, -0.01]}},
        accel_density=0.0016,
        gyro_density=0.00012,
    )
    real = cromosim.apply_device(device, stamps, force, rate, rate_hz=RATE_HZ, seed=1)
    added = real.specific_force - force
    differences["bias"] = np.abs(added.mean(axis=0) - [0.1, -0.05, 0.08]).max()
    print(f"the device adds {added.mean(axis=0).round(3)} +- {added.std(axis=0).round(3)} m/s2")
    return differences


if __name__ == "__main__":
    main()
