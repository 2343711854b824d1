"""Reads and writes the recordings: rosbag2 MCAP, profile ros2, CDR by hand."""
import heapq
import struct

import numpy as np
from mcap.reader import make_reader
from mcap.writer import Writer

RULE = "=" * 80
HEADER = "std_msgs/Header\nbuiltin_interfaces/Time stamp\nstring frame_id"
TIME = "builtin_interfaces/Time\nint32 sec\nuint32 nanosec"
QUATERNION = "geometry_msgs/Quaternion\nfloat64 x 0\nfloat64 y 0\nfloat64 z 0\nfloat64 w 1"
VECTOR = "geometry_msgs/Vector3\nfloat64 x\nfloat64 y\nfloat64 z"
POINT = "geometry_msgs/Point\nfloat64 x\nfloat64 y\nfloat64 z"
POSE = "geometry_msgs/Pose\ngeometry_msgs/Point position\ngeometry_msgs/Quaternion orientation"


def _schema(own, *parts):
    return "\n".join([own] + [f"{RULE}\nMSG: {part}" for part in parts])


IMU_SCHEMA = _schema(
    "std_msgs/Header header\ngeometry_msgs/Quaternion orientation\nfloat64[9] orientation_covariance\n"
    "geometry_msgs/Vector3 angular_velocity\nfloat64[9] angular_velocity_covariance\n"
    "geometry_msgs/Vector3 linear_acceleration\nfloat64[9] linear_acceleration_covariance",
    HEADER, TIME, QUATERNION, VECTOR)
POSE_SCHEMA = _schema("std_msgs/Header header\ngeometry_msgs/Pose pose", POSE, POINT, HEADER, TIME, QUATERNION)


def _cdr(stamps, frame, doubles):
    """One CDR message per row: Header, then float64 values only (true of Imu and PoseStamped)."""
    name = frame.encode() + b"\0"
    head = struct.pack("<I", len(name)) + name
    pad = b"\0" * (-(8 + len(head)) % 8)  # alignment counts from behind the encapsulation header
    rows = np.ascontiguousarray(doubles, "<f8")
    for stamp, row in zip(stamps, rows):
        sec, nanosec = divmod(int(stamp), 1_000_000_000)
        yield int(stamp), b"\0\1\0\0" + struct.pack("<iI", sec, nanosec) + head + pad + row.tobytes()


def _numbered(channel, rows):
    for sequence, (stamp, data) in enumerate(rows):
        yield stamp, channel, sequence, data


def write(path, placements):
    """placements: name -> {reference: (stamps ns, pos, quat xyzw), imu: (stamps ns, gyro, accel), variances: (gyro, accel)}"""
    with open(path, "wb") as stream:
        writer = Writer(stream)
        writer.start(profile="ros2", library="mcap-python")
        imu_schema = writer.register_schema("sensor_msgs/msg/Imu", "ros2msg", IMU_SCHEMA.encode())
        pose_schema = writer.register_schema("geometry_msgs/msg/PoseStamped", "ros2msg", POSE_SCHEMA.encode())
        streams = []  # merged as they are made: ten minutes of five placements are close to a million messages
        for name, item in placements.items():
            channel = writer.register_channel(f"/reference/{name}", "cdr", pose_schema)
            stamps, position, quaternion = item["reference"]
            streams.append(_numbered(channel, _cdr(stamps, "world", np.hstack([position, quaternion]))))
            channel = writer.register_channel(f"/imu/{name}/data_raw", "cdr", imu_schema)
            stamps, gyro, accel = item["imu"]
            gyro_variance, accel_variance = item["variances"]
            count = len(stamps)
            doubles = np.zeros((count, 37))
            doubles[:, 3] = 1.0
            doubles[:, 4] = -1.0  # no orientation
            doubles[:, 13:16], doubles[:, 25:28] = gyro, accel
            doubles[:, 16:25:4], doubles[:, 28:37:4] = gyro_variance, accel_variance
            streams.append(_numbered(channel, _cdr(stamps, f"{name}_imu", doubles)))
        for stamp, channel, sequence, data in heapq.merge(*streams, key=lambda message: message[0]):
            writer.add_message(channel, log_time=stamp, publish_time=stamp, sequence=sequence, data=data)
        writer.finish()


def _doubles(data):
    sec, nanosec, length = struct.unpack_from("<iII", data, 4)
    start = 16 + length
    start += -(start - 4) % 8
    return sec * 1_000_000_000 + nanosec, np.frombuffer(data, "<f8", offset=start)


def read(path):
    """name -> {reference: (stamps, pos, quat), imu: (stamps, gyro, accel), variances: of the first message, covariances: diagonals of each
    message (gyro, accel)}; topics that are absent stay absent."""
    rows = {}
    with open(path, "rb") as stream:
        for _, channel, message in make_reader(stream).iter_messages():
            if channel.topic.startswith(("/reference/", "/imu/")):
                rows.setdefault(channel.topic, []).append(_doubles(message.data))
    out = {}
    for topic, items in rows.items():
        stamps = np.array([stamp for stamp, _ in items], np.int64)
        values = np.array([value for _, value in items])
        order = np.argsort(stamps, kind="stable")
        stamps, values = stamps[order], values[order]
        item = out.setdefault(topic.split("/")[2], {})
        if topic.startswith("/reference/"):
            item["reference"] = (stamps, values[:, :3], values[:, 3:7])
        else:
            item["imu"] = (stamps, values[:, 13:16], values[:, 25:28])
            item["covariances"] = (values[:, 16:25:4], values[:, 28:37:4])
            item["variances"] = tuple(own[0].copy() for own in item["covariances"])
    return out
