"""AHRS filters of others (vqf, ahrs, imufusion) on the topics of a bag of `cromosim simulate --orientation vqf --magnetic-field`.

Prints each filter's root mean square errors of tilt and heading against /reference, degrees, and fails where one is
beyond what its authors publish for slow to medium motion, or where our VQF is not theirs.
"""
import sys

import numpy as np
import vqf
import ahrs
import imufusion
from mcap_ros2.reader import read_ros2_messages

topics = {}
for message in read_ros2_messages(sys.argv[1]):
    topics.setdefault(message.channel.topic, []).append(message.ros_msg)


def stamps(messages):
    return np.array([m.header.stamp.sec + m.header.stamp.nanosec * 1e-9 for m in messages])


def rows(messages, of):
    return np.array([[getattr(of(m), axis) for axis in "xyz"] for m in messages])


def quaternions(messages, of):
    return np.array([[getattr(of(m), axis) for axis in "wxyz"] for m in messages])


def product(a, b):
    w, x, y, z = a.T
    p, q, r, s = b.T
    return np.stack([w*p - x*q - y*r - z*s, w*q + x*p + y*s - z*r, w*r - x*s + y*p + z*q, w*s + x*r - y*q + z*p], 1)


def conjugate(a):
    return a * [1, -1, -1, -1]


def errors(estimate, truth):
    """Tilt and heading, degrees, root mean square of the second half, when the filters have settled."""
    e = product(estimate, conjugate(truth))[len(truth) // 2 :]
    heading = 2 * np.arctan2(e[:, 3], e[:, 0])
    heading = (heading + np.pi) % (2 * np.pi) - np.pi
    tilt = 2 * np.arccos(np.clip(np.hypot(e[:, 0], e[:, 3]), 0, 1))
    return [np.degrees(np.sqrt(np.mean(v ** 2))) for v in (tilt, heading)]


# Published averages: VQF (Laidig and Seel 2023, table of BROAD) 9D about 1 to 4 degrees; of the others up to 8.
LIMITS = {"vqf": 4.0, "ahrs.Madgwick": 8.0, "imufusion": 8.0, "ours": 4.0}
failed = []
for name in sorted(topic.split("/")[2] for topic in topics if topic.endswith("/mag")):
    raw, data, mag = (topics[f"/imu/{name}/{ending}"] for ending in ("data_raw", "data", "mag"))
    assert len(raw) == len(mag) and (stamps(raw) == stamps(mag)).all()
    gyr, acc = rows(raw, lambda m: m.angular_velocity), rows(raw, lambda m: m.linear_acceleration)
    field, times = rows(mag, lambda m: m.magnetic_field), stamps(raw)
    reference = topics[f"/reference/{name}"]
    poses, at = quaternions(reference, lambda m: m.pose.orientation), stamps(reference)
    for k in range(1, len(poses)):
        poses[k] *= np.sign(poses[k] @ poses[k - 1]) or 1.0
    truth = np.stack([np.interp(times, at, poses[:, k]) for k in range(4)], 1)
    truth /= np.linalg.norm(truth, axis=1, keepdims=True)
    step = 1 / round(1 / np.median(np.diff(times)))

    theirs = vqf.VQF(step).updateBatch(gyr.copy(), acc.copy(), field.copy())["quat9D"]
    ours = quaternions(data, lambda m: m.orientation)
    estimates = {"vqf": theirs, "ours": ours}
    estimates["ahrs.Madgwick"] = ahrs.filters.Madgwick(gyr=gyr, acc=acc, mag=field * 1e9, frequency=1 / step).Q
    fusion = imufusion.Ahrs()
    fusion.set_sample_period(step)
    quaternion = []
    for k in range(len(gyr)):
        fusion.update(np.degrees(gyr[k]), acc[k] / 9.80665, field[k] * 1e6)
        quaternion.append(fusion.get_quaternion())
    estimates["imufusion"] = np.array(quaternion)
    # Both of them call north x; REP-103 has east there.
    quarter = np.array([[np.sqrt(0.5), 0, 0, np.sqrt(0.5)]])
    for other in ("ahrs.Madgwick", "imufusion"):
        estimates[other] = product(np.repeat(quarter, len(times), 0), estimates[other])
    for filter_name, estimate in estimates.items():
        tilt, heading = errors(estimate, truth)
        print(f"{name:12} {filter_name:14} tilt {tilt:5.2f}  heading {heading:6.2f} degrees")
        if max(tilt, heading) > LIMITS[filter_name]:
            failed.append(f"{name} {filter_name}")
    apart = np.degrees(2 * np.arccos(np.clip(np.abs(np.sum(theirs * ours, 1)), 0, 1)))
    print(f"{name:12} ours from vqf: {apart.max():.2e} degrees at most")
    # Stamps are rounded to nanoseconds, and what is beyond a threshold depends on every digit.
    if apart.max() > 0.01:
        failed.append(f"{name}: ours is not vqf")
sys.exit(f"beyond what is published: {', '.join(failed)}" if failed else 0)
