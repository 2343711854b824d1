#!/usr/bin/env python3
"""Writes the bags beside this file with rosbags 0.11.9 (PyPI), a program that is not ours: the same messages as SQLite (plain, each
file packed, each message packed) and as bags of ROS 1 (plain, bz2, lz4).

Usage: make.py [FOLDER]
"""

import pathlib
import shutil
import sys

import numpy as np
from rosbags.rosbag1 import Writer as Writer1
from rosbags.rosbag2 import CompressionFormat, CompressionMode, StoragePlugin
from rosbags.rosbag2 import Writer as Writer2
from rosbags.typesys import Stores, get_types_from_msg, get_typestore

# Whatever ROS 1 has, in an order that CDR has to pad.
ODD = """uint8 COUNT=3  # a constant
bool flag
float64 value
string name
int8[3] small
uint16 middle
time at
duration[] spans
std_msgs/Header[] headers
geometry_msgs/Vector3[2] vectors
string[] words
float64[] empty
"""
START = 1_700_000_000_000_000_000
PERIOD = 10_000_000


def store_of(name):
    store = get_typestore(name)
    text = ODD if name == Stores.ROS1_NOETIC else ODD.replace("time at", "builtin_interfaces/Time at").replace(
        "duration[] ", "builtin_interfaces/Duration[] "
    )
    store.register(get_types_from_msg(text, "demo_msgs/msg/Odd"))
    return store


def messages(store, is_ros1):
    """Topic, type, message and time; topics in ROS 2's names."""
    t = store.types

    def time(nanos):
        return t["builtin_interfaces/msg/Time"](sec=nanos // 10**9, nanosec=nanos % 10**9)

    def header(k, frame):
        seq = {"seq": 100 + k} if is_ros1 else {}
        return t["std_msgs/msg/Header"](stamp=time(START + k * PERIOD), frame_id=frame, **seq)

    def vector(x, y, z):
        return t["geometry_msgs/msg/Vector3"](x=x, y=y, z=z)

    def turn():
        return t["geometry_msgs/msg/Quaternion"](x=0.0, y=0.0, z=0.6, w=0.8)

    for k in range(20):
        at = START + k * PERIOD
        imu = t["sensor_msgs/msg/Imu"](
            header=header(k, "wrist_imu"),
            orientation=turn(),
            orientation_covariance=np.zeros(9),
            angular_velocity=vector(0.5 * k, -0.25, 0.125),
            angular_velocity_covariance=np.arange(9.0),
            linear_acceleration=vector(0.1 * k, 0.2, 9.8),
            linear_acceleration_covariance=np.arange(9.0),
        )
        yield "/imu/wrist/data_raw", "sensor_msgs/msg/Imu", imu, at
        pose = t["geometry_msgs/msg/Pose"](
            position=t["geometry_msgs/msg/Point"](x=float(k), y=2.0, z=3.0), orientation=turn()
        )
        yield "/reference/wrist", "geometry_msgs/msg/PoseStamped", t["geometry_msgs/msg/PoseStamped"](
            header=header(k, "world"), pose=pose
        ), at
        if k % 5 == 0:
            odd = t["demo_msgs/msg/Odd"](
                flag=True,
                value=k / 3,
                name="an odd \u00fcber-name"[: 3 + k],
                small=np.array([-1, 2, -3], np.int8),
                middle=65535,
                at=time(at),
                spans=[t["builtin_interfaces/msg/Duration"](sec=-1, nanosec=5), t["builtin_interfaces/msg/Duration"](sec=2, nanosec=7)],
                headers=[header(k, "a"), header(k + 1, "bcd")],
                vectors=[vector(1.0, 2.0, 3.0), vector(4.0, 5.0, 6.0)],
                words=["", "x", "five5"],
                empty=np.array([], np.float64),
                COUNT=3,
            )
            yield "/odd", "demo_msgs/msg/Odd", odd, at


def write_sqlite(path, mode):
    store = store_of(Stores.ROS2_HUMBLE)
    writer = Writer2(path, version=9, storage_plugin=StoragePlugin.SQLITE3)
    if mode is not None:
        writer.set_compression(mode, CompressionFormat.ZSTD)
    with writer:
        connections = {}
        for topic, kind, message, at in messages(store, False):
            if topic not in connections:
                connections[topic] = writer.add_connection(topic, kind, typestore=store)
            writer.write(connections[topic], at, store.serialize_cdr(message, kind))


def write_ros1(path, compression):
    store = store_of(Stores.ROS1_NOETIC)
    writer = Writer1(path)
    if compression is not None:
        writer.set_compression(compression)
    writer.chunk_threshold = 4096
    with writer:
        connections = {}
        for topic, kind, message, at in messages(store, True):
            if topic not in connections:
                connections[topic] = writer.add_connection(topic, kind, typestore=store)
            writer.write(connections[topic], at, store.serialize_ros1(message, kind))


def main():
    folder = pathlib.Path(sys.argv[1] if len(sys.argv) > 1 else pathlib.Path(__file__).parent)
    for name, mode in [("sqlite", None), ("sqlite_files", CompressionMode.FILE), ("sqlite_messages", CompressionMode.MESSAGE)]:
        shutil.rmtree(folder / name, ignore_errors=True)
        write_sqlite(folder / name, mode)
    formats = Writer1.CompressionFormat
    for name, compression in [("plain", None), ("bz2", formats.BZ2), ("lz4", formats.LZ4)]:
        path = folder / f"{name}.bag"
        path.unlink(missing_ok=True)
        write_ros1(path, compression)


if __name__ == "__main__":
    main()
