#!/usr/bin/env python3
"""Subscribes to sensor_msgs/msg/Imu topics with CycloneDDS, another DDS implementation, and says what came in.

usage: cyclone_listener.py TOPIC... [--messages N] [--timeout S] [--domain D] [--any-network]

Ends when every topic has N messages and the node behind every publisher is known, or after S seconds, or at SIGINT or SIGTERM.
Prints one JSON object: for each topic the messages, the frame ids, the mean rate by the stamps, the first and the last of them,
where between them some are missing (message number, seconds after the first), and the publishing nodes as `ros_discovery_info` names
them; and all nodes. Exit code 0 where everything asked for came, 1 where not.
Needs the PyPI package cyclonedds. Listens on the loopback interface unless --any-network is given or CYCLONEDDS_URI is set.
"""

import argparse
import json
import os
import signal
import sys
import time
from dataclasses import dataclass

LOOPBACK = (
    "<CycloneDDS><Domain><General><Interfaces><NetworkInterface name='lo' multicast='true'/></Interfaces>"
    "</General></Domain></CycloneDDS>"
)


def parse_arguments():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("topics", nargs="+", metavar="TOPIC", help="absolute ROS topic, for example /imu/head/data_raw")
    parser.add_argument("--messages", type=int, default=0, help="end when every topic has this many (default: wait for the timeout)")
    parser.add_argument("--timeout", type=float, default=30.0, help="end after this many seconds")
    parser.add_argument("--domain", type=int, default=int(os.environ.get("ROS_DOMAIN_ID") or 0))
    parser.add_argument("--any-network", action="store_true", help="let CycloneDDS choose its interfaces")
    return parser.parse_args()


arguments = parse_arguments()
if not arguments.any_network:
    os.environ.setdefault("CYCLONEDDS_URI", LOOPBACK)  # read when the participant is made

from cyclonedds.builtin import BuiltinDataReader, BuiltinTopicDcpsPublication  # noqa: E402
from cyclonedds.core import Policy, Qos  # noqa: E402
from cyclonedds.domain import DomainParticipant  # noqa: E402
from cyclonedds.idl import IdlStruct, types  # noqa: E402
from cyclonedds.sub import DataReader, Subscriber  # noqa: E402
from cyclonedds.topic import Topic  # noqa: E402
from cyclonedds.util import duration  # noqa: E402


def ros(name):
    """The DDS name of a ROS type: sensor_msgs/msg/Imu -> sensor_msgs::msg::dds_::Imu_."""
    package, kind, name = name.split("/")
    return f"{package}::{kind}::dds_::{name}_"


@dataclass
class Time(IdlStruct, typename=ros("builtin_interfaces/msg/Time")):
    sec: types.int32
    nanosec: types.uint32


@dataclass
class Header(IdlStruct, typename=ros("std_msgs/msg/Header")):
    stamp: Time
    frame_id: str


@dataclass
class Quaternion(IdlStruct, typename=ros("geometry_msgs/msg/Quaternion")):
    x: types.float64
    y: types.float64
    z: types.float64
    w: types.float64


@dataclass
class Vector3(IdlStruct, typename=ros("geometry_msgs/msg/Vector3")):
    x: types.float64
    y: types.float64
    z: types.float64


@dataclass
class Imu(IdlStruct, typename=ros("sensor_msgs/msg/Imu")):
    header: Header
    orientation: Quaternion
    orientation_covariance: types.array[types.float64, 9]
    angular_velocity: Vector3
    angular_velocity_covariance: types.array[types.float64, 9]
    linear_acceleration: Vector3
    linear_acceleration_covariance: types.array[types.float64, 9]


@dataclass
class Gid(IdlStruct, typename=ros("rmw_dds_common/msg/Gid")):
    data: types.array[types.uint8, 16]


@dataclass
class NodeEntitiesInfo(IdlStruct, typename=ros("rmw_dds_common/msg/NodeEntitiesInfo")):
    node_namespace: str
    node_name: str
    reader_gid_seq: types.sequence[Gid]
    writer_gid_seq: types.sequence[Gid]


@dataclass
class ParticipantEntitiesInfo(IdlStruct, typename=ros("rmw_dds_common/msg/ParticipantEntitiesInfo")):
    gid: Gid
    node_entities_info_seq: types.sequence[NodeEntitiesInfo]


def gaps(stamps):
    """Where an interval is half as long again as the usual one: message number and seconds after the first stamp."""
    intervals = [after - before for before, after in zip(stamps, stamps[1:])]
    if not intervals:
        return []
    usual = sorted(intervals)[len(intervals) // 2]
    return [
        [number, round(stamps[number] - stamps[0], 3)]
        for number, interval in enumerate(intervals, 1)
        if not 0.5 * usual <= interval <= 1.5 * usual
    ]


RELIABLE = Policy.Reliability.Reliable(duration(milliseconds=100))


class Listener:
    """All readers, and what they have read."""

    def __init__(self, domain, topics):
        participant = DomainParticipant(domain)
        subscriber = Subscriber(participant)
        deep = Qos(RELIABLE, Policy.Durability.Volatile, Policy.History.KeepLast(5000))
        self.imus = {
            name: DataReader(subscriber, Topic(participant, "rt" + name, Imu, qos=deep), qos=deep) for name in topics
        }
        latched = Qos(RELIABLE, Policy.Durability.TransientLocal, Policy.History.KeepLast(1000))
        info = Topic(participant, "ros_discovery_info", ParticipantEntitiesInfo, qos=latched)
        self.info = DataReader(subscriber, info, qos=latched)
        self.publications = BuiltinDataReader(subscriber, BuiltinTopicDcpsPublication)
        self.messages = {name: [] for name in topics}
        self.publishers = {name: set() for name in topics}  # GIDs
        self.node_of = {}  # GID -> node

    def poll(self):
        """Takes over whatever has come in."""
        for publication in self.publications.take(N=1000):
            topic = (publication.topic_name or "").removeprefix("rt")
            if topic in self.publishers:
                self.publishers[topic].add(publication.key.bytes)
        for sample in self.info.take(N=1000):
            for node in getattr(sample, "node_entities_info_seq", []):
                name = node.node_namespace.rstrip("/") + "/" + node.node_name
                for gid in node.writer_gid_seq:
                    self.node_of[bytes(gid.data)] = name
        for name, reader in self.imus.items():
            for imu in reader.take(N=5000):
                if isinstance(imu, Imu):
                    stamp = imu.header.stamp.sec + imu.header.stamp.nanosec * 1e-9
                    self.messages[name].append((stamp, imu.header.frame_id))

    def nodes_behind(self, topic):
        return sorted({self.node_of.get(gid, "unknown") for gid in self.publishers[topic]})

    def has_all(self, messages):
        """True where every topic has its messages and no publisher is without a node."""
        counted = all(len(received) >= messages for received in self.messages.values())
        known = all(self.publishers[topic] and "unknown" not in self.nodes_behind(topic) for topic in self.messages)
        return counted and known

    def report(self):
        topics = {}
        for name, received in self.messages.items():
            span = received[-1][0] - received[0][0] if len(received) > 1 else 0.0
            topics[name] = {
                "messages": len(received),
                "frame_ids": sorted({frame for _, frame in received}),
                "rate_hz": round((len(received) - 1) / span, 3) if span > 0 else None,
                "stamps_s": [received[0][0], received[-1][0]] if received else None,
                "gaps": gaps([stamp for stamp, _ in received]),
                "nodes": self.nodes_behind(name),
            }
        return {"topics": topics, "nodes": sorted(set(self.node_of.values()))}


def main():
    ended = []
    for signal_number in (signal.SIGINT, signal.SIGTERM):
        signal.signal(signal_number, lambda *_: ended.append(True))
    listener = Listener(arguments.domain, arguments.topics)
    deadline = time.monotonic() + arguments.timeout
    while time.monotonic() < deadline and not ended:
        listener.poll()
        if arguments.messages and listener.has_all(arguments.messages):
            break
        time.sleep(0.01)
    print(json.dumps(listener.report(), indent=2))
    return 0 if listener.has_all(max(arguments.messages, 1)) else 1


if __name__ == "__main__":
    sys.exit(main())
