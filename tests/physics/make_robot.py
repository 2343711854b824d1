"""A quadruped's two runs as its own stack would record them, with faults in its IMUs: bags/robot.

    python -m venv physics && physics/bin/pip install -r requirements.txt
    physics/bin/python make_robot.py ../../bags/robot

Writes `session` and `check` (rosbag2, MCAP) and truth.json; README.md in bags/robot says what is in them.
"""

import json
import shutil
import sys
from pathlib import Path

import mujoco
import numpy as np
import zstandard
from rosbags.rosbag2 import CompressionFormat, CompressionMode, StoragePlugin, Writer
from rosbags.typesys import Stores, get_typestore

from quadruped import FOOT, JOINTS, LEGS, RUBBER_DAMPING, RUBBER_HZ, SHANK_IMU, SHANK_TURN, TRUNK_IMU, joint_places, xml
from trot import HEIGHT, SCRIPTS, Trot, Wish

STEP_HZ, IMU_HZ, POSE_HZ = 2400, 200, 100
BEFORE_S = 1.0  # to settle on the floor, not written
# The chips: an anti-aliasing filter, white noise, rounding at +-16 g and 2000 deg/s.
FILTER_HZ = 42.0
ACCEL_DENSITY, GYRO_DENSITY = 0.0007, 5e-5  # (m/s2)/sqrt(Hz), (rad/s)/sqrt(Hz)
ACCEL_LSB, GYRO_LSB = 9.80665 / 2048, np.deg2rad(1 / 16.4)  # m/s2, rad/s
ACCEL_LIMIT, GYRO_LIMIT = 16 * 9.80665, np.deg2rad(2000)
# The faults of the trunk's IMU, beside its place: URDF and odometry know of no distance from base_link.
LATE_S, GYRO_BIAS = 0.012, (0.012, -0.020, 0.008)  # s, rad/s
# The state estimator and the encoders of the joints.
PLACE_STD, TURN_STD = 1e-4, 1e-4  # m, rad; white, of each pose
SPEED_DRIFT, TURN_DRIFT, DRIFT_S = 0.01, 0.0003, 5.0  # m/s and rad/s (yaw), Gauss-Markov of this time constant
ENCODER_STEP = 2 * np.pi / 2**16  # rad
BEGIN_NS = {"session": 1_764_000_000_000_000_000, "check": 1_764_000_600_000_000_000}
IMUS = {
    "trunk": ("/trunk/imu/data_raw", "imu_link"),
    "shank_fl": ("/shank_fl/imu", "shank_fl_imu"),
    "shank_hr": ("/shank_hr/imu", "shank_hr_imu"),
}


def run(script, seconds):
    """Every state of a run: the trunk's pose and twist, angles of the joints, what is felt at the chips."""
    model = mujoco.MjModel.from_xml_string(xml(1 / STEP_HZ))
    data, trot = mujoco.MjData(model), Trot()
    trunk = model.body("base_link").id
    joints = [model.jnt_qposadr[model.joint(f"{joint}_{leg}").id] for leg in LEGS for joint in JOINTS]
    data.ctrl[:] = data.qpos[joints] = trot.step(Wish(), np.eye(3), np.zeros(3), 0.0)
    data.qpos[2] = HEIGHT + FOOT
    steps = int(round((BEFORE_S + seconds) * STEP_HZ)) + 1
    place, quat, twist, angle = (np.empty((steps, size)) for size in (3, 4, 6, len(joints)))
    felt = np.empty((steps, len(IMUS), 6))
    for n in range(steps):
        # Readings and poses of this very state; what mj_step leaves is from within its step.
        mujoco.mj_forward(model, data)
        place[n], quat[n], angle[n] = data.qpos[:3], data.qpos[3:7], data.qpos[joints]
        rotation = data.xmat[trunk].reshape(3, 3)
        twist[n] = np.concatenate([rotation.T @ data.qvel[:3], data.qvel[3:6]])
        felt[n] = data.sensordata.reshape(len(IMUS), 6)
        wish = script(max(n / STEP_HZ - BEFORE_S, 0.0))
        data.ctrl[:] = trot.step(wish, rotation, data.qvel[:3], 1 / STEP_HZ)
        mujoco.mj_step(model, data)
    if data.warning.number.any() or place[:, 2].min() < 0.8 * HEIGHT:
        raise SystemExit(f"{script.__name__}: the engine warns, or the robot has fallen")
    return place, quat, twist, angle, felt


def filtered(series):
    """Butterworth of second order, as it runs in a chip, and how late it is at low frequencies, s."""
    k = np.tan(np.pi * FILTER_HZ / STEP_HZ)
    scale = 1 / (1 + np.sqrt(2) * k + k * k)
    b, a1, a2 = k * k * scale, 2 * (k * k - 1) * scale, (1 - np.sqrt(2) * k + k * k) * scale
    out = np.empty_like(series)
    x1 = x2 = y1 = y2 = series[0]
    for n, x in enumerate(series):
        out[n] = b * (x + 2 * x1 + x2) - a1 * y1 - a2 * y2
        x1, x2, y1, y2 = x, x1, out[n], y1
    return out, np.sqrt(2) / (2 * np.pi * FILTER_HZ)


def readings(felt, generator):
    """What the chips say at IMU_HZ: steps of the run, and float32 of (readings, IMUs, 6)."""
    series, delay = filtered(felt)
    taken = np.arange(int(BEFORE_S * STEP_HZ), len(series), STEP_HZ // IMU_HZ)
    said = series[taken]
    density = np.repeat([ACCEL_DENSITY, GYRO_DENSITY], 3)
    said = said + generator.normal(0.0, density * np.sqrt(IMU_HZ / 2), said.shape)
    said[:, list(IMUS).index("trunk"), 3:] += GYRO_BIAS
    step, limit = np.repeat([ACCEL_LSB, GYRO_LSB], 3), np.repeat([ACCEL_LIMIT, GYRO_LIMIT], 3)
    said = np.clip(np.round(said / step) * step, -limit, limit).astype(np.float32)
    # The driver knows its chip's filter and takes that delay off.
    return taken / STEP_HZ - BEFORE_S - delay, said


def times(a, b):
    """Product of quaternions, w x y z."""
    (aw, av), (bw, bv) = (a[..., :1], a[..., 1:]), (b[..., :1], b[..., 1:])
    return np.concatenate([aw * bw - np.sum(av * bv, -1, keepdims=True), aw * bv + bw * av + np.cross(av, bv)], -1)


def markov(count, deviation, generator):
    """A Gauss-Markov process at POSE_HZ, from 0 on."""
    keep = np.exp(-1 / (DRIFT_S * POSE_HZ))
    kicks = generator.normal(0.0, deviation * np.sqrt(1 - keep**2), count)
    out = np.zeros(count)
    for n in range(1, count):
        out[n] = keep * out[n - 1] + kicks[n]
    return out


def estimated(place, quat, angle, generator):
    """What estimator and encoders say at POSE_HZ: seconds, and float32 of place, turn and angles."""
    taken = np.arange(int(BEFORE_S * STEP_HZ), len(place), STEP_HZ // POSE_HZ)
    count = len(taken)
    moved = np.stack([markov(count, SPEED_DRIFT, generator) for _ in range(2)] + [np.zeros(count)], 1)
    place = place[taken] + np.cumsum(moved, 0) / POSE_HZ + generator.normal(0.0, PLACE_STD, (count, 3))
    yaw = np.cumsum(markov(count, TURN_DRIFT, generator)) / POSE_HZ
    drifted = np.stack([np.cos(yaw / 2), *np.zeros((2, count)), np.sin(yaw / 2)], 1)
    shaken = np.concatenate([np.ones((count, 1)), generator.normal(0.0, TURN_STD / 2, (count, 3))], 1)
    quat = times(times(drifted, quat[taken]), shaken)
    quat /= np.linalg.norm(quat, axis=1, keepdims=True)
    angle = np.round(angle[taken] / ENCODER_STEP) * ENCODER_STEP
    return taken, taken / STEP_HZ - BEFORE_S, place.astype(np.float32), quat.astype(np.float32), angle


class Bag:
    """Messages of a run in order of their stamps."""

    def __init__(self, path, begin_ns):
        self.path, self.begin_ns, self.messages = path, begin_ns, []
        self.store = get_typestore(Stores.ROS2_JAZZY)

    def make(self, name, *values):
        return self.store.types[name.replace("/", "/msg/")](*values)

    def vector(self, values):
        return self.make("geometry_msgs/Vector3", *map(float, values))

    def quaternion(self, wxyz):
        w, x, y, z = map(float, wxyz)
        return self.make("geometry_msgs/Quaternion", x, y, z, w)

    def header(self, at, frame):
        seconds, nanos = divmod(at, 1_000_000_000)
        return self.make("std_msgs/Header", self.make("builtin_interfaces/Time", seconds, nanos), frame)

    def nanos(self, seconds):
        return self.begin_ns + int(round(seconds * 1e9))

    def transform(self, at, parent, child, place, wxyz):
        moved = self.make("geometry_msgs/Transform", self.vector(place), self.quaternion(wxyz))
        return self.make("geometry_msgs/TransformStamped", self.header(at, parent), child, moved)

    def add(self, topic, kind, at, message):
        kind = kind.replace("/", "/msg/")
        self.messages.append((at, topic, kind, self.store.serialize_cdr(message, kind)))

    def write(self):
        shutil.rmtree(self.path, ignore_errors=True)
        writer = Writer(self.path, version=9, storage_plugin=StoragePlugin.MCAP)
        writer.set_compression(CompressionMode.STORAGE, CompressionFormat.ZSTD)
        with writer:
            # rosbags has no setting for it; a sixth of the file.
            writer.storage.compressor = lambda raw: zstandard.compress(raw, 19)
            known = {}
            for at, topic, kind, raw in sorted(self.messages, key=lambda one: one[:2]):
                if topic not in known:
                    known[topic] = writer.add_connection(topic, kind, typestore=self.store)
                writer.write(known[topic], at, raw)


def add_statics(bag):
    """The places of the IMUs by the robot's description: that of the trunk's is wrong."""
    still = (1.0, 0.0, 0.0, 0.0)
    places = [("base_link", "imu_link", (0.0, 0.0, 0.0), still)]
    places += [(f"shank_{leg}", f"shank_{leg}_imu", SHANK_IMU, SHANK_TURN) for leg in ("fl", "hr")]
    message = bag.make("tf2_msgs/TFMessage", [bag.transform(bag.begin_ns, *place) for place in places])
    bag.add("/tf_static", "tf2_msgs/TFMessage", bag.begin_ns, message)


def add_odometry(bag, at, place, quat, twist):
    pose = bag.make("geometry_msgs/Pose", bag.make("geometry_msgs/Point", *map(float, place)), bag.quaternion(quat))
    diagonal = np.diag([1e-8] * 6).ravel()
    twist = bag.make("geometry_msgs/Twist", bag.vector(twist[:3]), bag.vector(twist[3:]))
    with_covariance = (
        bag.make("geometry_msgs/PoseWithCovariance", pose, diagonal),
        bag.make("geometry_msgs/TwistWithCovariance", twist, np.zeros(36)),
    )
    message = bag.make("nav_msgs/Odometry", bag.header(at, "odom"), "base_link", *with_covariance)
    bag.add("/odom", "nav_msgs/Odometry", at, message)


def add_transforms(bag, at, place, quat, angles):
    """odom to base_link and the legs, as robot_state_publisher has them from the encoders."""
    found = [bag.transform(at, "odom", "base_link", place, quat)]
    for leg, own in zip(LEGS, angles.reshape(len(LEGS), 3)):
        parent = "base_link"
        for joint, between, angle in zip(JOINTS, joint_places(leg), own):
            cosine, sine = np.float32(np.cos(angle / 2)), np.float32(np.sin(angle / 2))
            turn = (cosine, sine, 0, 0) if joint == "hip" else (cosine, 0, sine, 0)
            found.append(bag.transform(at, parent, f"{joint}_{leg}", between, turn))
            parent = f"{joint}_{leg}"
    bag.add("/tf", "tf2_msgs/TFMessage", at, bag.make("tf2_msgs/TFMessage", found))


def add_readings(bag, seconds, said):
    # No orientation; covariances as of most drivers: not known.
    not_reported, zeros = np.array([-1.0] + [0.0] * 8), np.zeros(9)
    for number, (name, (topic, frame)) in enumerate(IMUS.items()):
        late = LATE_S if name == "trunk" else 0.0
        for second, values in zip(seconds, said[:, number]):
            at = bag.nanos(second + late)
            none = bag.quaternion((1, 0, 0, 0))
            rate, force = bag.vector(values[3:]), bag.vector(values[:3])
            message = bag.make(
                "sensor_msgs/Imu", bag.header(at, frame), none, not_reported, rate, zeros, force, zeros
            )
            bag.add(topic, "sensor_msgs/Imu", at, message)


def truth():
    return {
        "trunk": {
            "time_offset": {"seconds": LATE_S},
            "lever_arm": {"offset": TRUNK_IMU},
            "gyro_bias": {"bias": GYRO_BIAS},
        },
        "shank_fl": {"soft_tissue": {"natural_hz": RUBBER_HZ, "damping_ratio": RUBBER_DAMPING}},
        "shank_hr": {},
    }


def main():
    folder = Path(sys.argv[1])
    folder.mkdir(parents=True, exist_ok=True)
    for seed, (script, seconds) in enumerate(SCRIPTS.items()):
        name, generator = script.__name__, np.random.default_rng(seed)
        place, quat, twist, angle, felt = run(script, seconds)
        bag = Bag(folder / name, BEGIN_NS[name])
        add_statics(bag)
        taken, at, *poses = estimated(place, quat, angle, generator)
        for step, second, place, quat, angles in zip(taken, at, *poses):
            add_odometry(bag, bag.nanos(second), place, quat, np.round(twist[step], 3))
            add_transforms(bag, bag.nanos(second), place, quat, angles)
        add_readings(bag, *readings(felt, generator))
        bag.write()
        size = sum(file.stat().st_size for file in bag.path.iterdir())
        print(f"{name}: {len(bag.messages)} messages, {size / 1000:.0f} kB")
    (folder / "truth.json").write_text(json.dumps(truth(), indent=2) + "\n")


if __name__ == "__main__":
    main()
