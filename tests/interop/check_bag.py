#!/usr/bin/env python3
"""Reads a bag with two programs that are not ours, mcap-ros2-support and rosbags, and compares what they decode.

    check_bag.py BAG [--expect TOPIC=COUNT]...

BAG is an MCAP file or a rosbag2 directory. Every message is decoded by both, from the schema inside the file, and the two must agree in
every field; type hashes must be those that rosbags computes. Prints the count of each topic; exit code 1 where anything differs.
Needs: mcap, mcap-ros2-support, rosbags.
"""

import argparse
import sys
from collections import Counter
from itertools import zip_longest
from pathlib import Path

from mcap.reader import make_reader
from mcap_ros2.decoder import DecoderFactory
from rosbags.rosbag2 import Reader
from rosbags.typesys import Stores, get_types_from_msg, get_typestore


def mcap_files(bag):
    """The MCAP files of a bag, in the order of their names."""
    return sorted(bag.glob("*.mcap"), key=lambda file: (len(file.name), file.name)) if bag.is_dir() else [bag]


def plain(value, names_of):
    """A decoded message of either library as tuples, numbers and strings; `names_of` gives a message's field names."""
    if isinstance(value, (str, bool, int, float)):
        return value
    if isinstance(value, (bytes, bytearray)):
        return tuple(value)
    if hasattr(value, "tolist"):
        return plain(value.tolist(), names_of)
    if isinstance(value, (list, tuple)):
        return tuple(plain(item, names_of) for item in value)
    return tuple((name, plain(getattr(value, name), names_of)) for name in names_of(value))


def same(left, right):
    """Equality in which NaN equals NaN, and a byte equals the number it is."""
    if isinstance(left, tuple) and isinstance(right, tuple):
        return len(left) == len(right) and all(same(a, b) for a, b in zip(left, right))
    if isinstance(left, tuple) and len(left) == 1:
        return same(left[0], right)
    if isinstance(right, tuple) and len(right) == 1:
        return same(left, right[0])
    return left == right or (left != left and right != right)


def by_mcap(bag):
    """(topic, log time, message) of every message, and the schema text of every type."""
    for file in mcap_files(bag):
        with file.open("rb") as stream:
            reader = make_reader(stream, validate_crcs=True, decoder_factories=[DecoderFactory()])
            for _, channel, message, decoded in reader.iter_decoded_messages():
                yield channel.topic, message.log_time, plain(decoded, lambda value: value.__slots__)


def schemas(bag):
    """Type name to schema text."""
    found = {}
    for file in mcap_files(bag):
        with file.open("rb") as stream:
            summary = make_reader(stream).get_summary()
            found.update({schema.name: schema.data.decode() for schema in summary.schemas.values()})
    return found


def typestore(bag):
    """Types from the schemas in the bag alone, so that a wrong schema cannot hide behind a right built-in one."""
    types = {}
    for name, text in schemas(bag).items():
        types.update(get_types_from_msg(text, name))
    store = get_typestore(Stores.EMPTY)
    store.register(types)
    return store


def by_rosbags(bag, faults):
    """As `by_mcap`; notes wrong type hashes."""
    store = typestore(bag)

    def names_of(value):
        return [name for name, _ in store.fielddefs[value.__msgtype__][1]]

    with Reader(bag) as reader:
        for connection in reader.connections:
            expected = store.hash_rihs01(connection.msgtype)
            if connection.digest and connection.digest != expected:
                faults.append(f"{connection.topic}: type hash {connection.digest}, expected {expected}")
        for connection, time, payload in reader.messages():
            yield connection.topic, time, plain(store.deserialize_cdr(payload, connection.msgtype), names_of)


def per_topic(messages):
    """Topic to its messages, in the order read: the two readers order topics of one time differently."""
    topics = {}
    for topic, time, message in messages:
        topics.setdefault(topic, []).append((time, message))
    return topics


def compare(left, right, faults):
    """Notes where two readings differ."""
    for topic in sorted(left.keys() | right.keys()):
        for index, (a, b) in enumerate(zip_longest(left.get(topic, []), right.get(topic, []))):
            if a is None or b is None or a[0] != b[0] or not same(a[1], b[1]):
                faults.append(f"{topic}, message {index}: mcap-ros2-support {str(a)[:300]}, rosbags {str(b)[:300]}")
                break


def main():
    """Compares and prints."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("bag", type=Path)
    parser.add_argument("--expect", action="append", default=[], metavar="TOPIC=COUNT", help="a topic must have so many messages")
    arguments = parser.parse_args()
    faults = []
    left = per_topic(by_mcap(arguments.bag))
    compare(left, per_topic(by_rosbags(arguments.bag, faults)), faults)
    counts = Counter({topic: len(messages) for topic, messages in left.items()})
    for topic in sorted(counts):
        print(f"{topic}: {counts[topic]}")
    if not counts:
        faults.append("no message in the bag")
    for topic, count in (item.rsplit("=", 1) for item in arguments.expect):
        if counts[topic] != int(count):
            faults.append(f"{topic}: expected {count} messages, found {counts[topic]}")
    for fault in faults:
        print(f"{arguments.bag}: {fault}", file=sys.stderr)
    return 1 if faults else 0


if __name__ == "__main__":
    sys.exit(main())
