"""Makes tests/data/captures and ../../../tests/fuzz/samples/captures: `python3 make_captures.py` (nothing but Python).

Look-alikes of what motion capture systems and sensors export, made to the formats' descriptions. All hold one motion,
which tests/captures.rs knows too: in a world whose z axis is up, after t seconds,

    position  (0.5 cos 2t, 0.5 sin 2t, 1 + 0.1 sin 3t) m
    rotation  world_from_body = Rz(0.8 t) Rx(0.4 sin 2t)

and a second body 0.1 m along the first one's x axis, 0.02 m along its z axis, which is lost in frames 10 to 13.
"""
from math import asin, atan2, cos, degrees, pi, sin, sqrt
from pathlib import Path

HERE = Path(__file__).resolve().parent.parent
DATA, SAMPLES = HERE / "tests" / "data" / "captures", HERE.parents[2] / "tests" / "fuzz" / "samples" / "captures"
FRAMES, ARM = 60, (0.1, 0.0, 0.02)
LOST = range(10, 14)


def product(a, b):
    """Of quaternions w, x, y, z."""
    return (a[0] * b[0] - a[1] * b[1] - a[2] * b[2] - a[3] * b[3], a[0] * b[1] + a[1] * b[0] + a[2] * b[3] - a[3] * b[2],
            a[0] * b[2] - a[1] * b[3] + a[2] * b[0] + a[3] * b[1], a[0] * b[3] + a[1] * b[2] - a[2] * b[1] + a[3] * b[0])


def about(axis, angle):
    quaternion = [cos(angle / 2), 0.0, 0.0, 0.0]
    quaternion["xyz".index(axis) + 1] = sin(angle / 2)
    return tuple(quaternion)


def inverse(q):
    return (q[0], -q[1], -q[2], -q[3])


def turned(q, v):
    return product(product(q, (0.0, *v)), inverse(q))[1:]


def added(a, b):
    return tuple(x + y for x, y in zip(a, b))


def matrix(q):
    columns = [turned(q, axis) for axis in ((1, 0, 0), (0, 1, 0), (0, 0, 1))]
    return [[columns[column][row] for column in range(3)] for row in range(3)]


def poses(t):
    """Position and rotation of both bodies."""
    position, rotation = (0.5 * cos(2 * t), 0.5 * sin(2 * t), 1 + 0.1 * sin(3 * t)), product(about("z", 0.8 * t), about("x", 0.4 * sin(2 * t)))
    return [(position, rotation), (added(position, turned(rotation, ARM)), rotation)]


def euler_zyx(q):
    """Angles by axis of Rz Ry Rx, rad."""
    m = matrix(q)
    return atan2(m[2][1], m[2][2]), asin(-m[2][0]), atan2(m[1][0], m[0][0])


def helical(q):
    length = sqrt(q[1] ** 2 + q[2] ** 2 + q[3] ** 2)
    angle = 2 * atan2(length, q[0])
    return tuple(part / length * angle if length else 0.0 for part in q[1:])


def y_up(pose):
    """The same with y up."""
    turn = about("x", -pi / 2)
    return turned(turn, pose[0]), product(turn, pose[1])


def optitrack():
    rate = 120
    keys = "Format Version,1.23,Take Name,Take 2026-11-25,Take Notes,,Capture Frame Rate,{0}.000000,Export Frame Rate,{0}.000000,Capture Start Time,2026-11-25 10.15.30.250 AM,Capture Start Frame,0,Total Frames in Take,60,Total Exported Frames,60,Rotation Type,Quaternion,Length Units,Meters,Coordinate Space,Global".format(rate)
    body = ["Rotation"] * 4 + ["Position"] * 3 + ["Mean Marker Error"]
    kinds = ["Rigid Body"] * 8 + ["Rigid Body Marker"] * 4 + ["Rigid Body"] * 8 + ["Marker"] * 3
    names = ["wand"] * 8 + ["wand:Marker1"] * 4 + ["Rigid Body 2"] * 8 + ["Unlabeled 1001"] * 3
    parts = body + ["Position"] * 3 + ["Marker Quality"] + body + ["Position"] * 3
    axes = list("XYZWXYZ") + [""] + list("XYZ") + [""] + list("XYZWXYZ") + [""] + list("XYZ")
    lines = [keys, ""]
    lines += [",".join(["", label, *row]) for label, row in (("Type", kinds), ("Name", names), ("ID", ["1A"] * len(kinds)), ("", parts))]
    lines.append(",".join(["Frame", "Time (Seconds)", *axes]))
    for frame in range(FRAMES):
        cells = [f"{frame}", f"{frame / rate:.6f}"]
        for body, pose in enumerate(poses(frame / rate)):
            (x, y, z), (qw, qx, qy, qz) = y_up(pose)
            lost = body == 1 and frame in LOST
            cells += [""] * 8 if lost else [f"{value:.6f}" for value in (qx, qy, qz, qw, x, y, z, 0.0002)]
            cells += [f"{x:.6f}", f"{y:.6f}", f"{z + 0.05:.6f}", "1.000000"] if body == 0 else (["", "", ""] if frame % 2 else ["0.1", "0.2", "0.3"])
        lines.append(",".join(cells))
    (DATA / "optitrack.csv").write_text("\r\n".join(lines) + "\r\n")

    # An older layout without labels: angles, millimetres, a skeleton's bones beside a body.
    keys = "Format Version,1.21,Take Name,Take,Capture Frame Rate,{0}.000000,Export Frame Rate,{0}.000000,Rotation Type,ZYX,Length Units,Millimeters,Coordinate Space,Global".format(rate)
    lines = [keys, ",,Rigid Body" + ",Rigid Body" * 5 + ",Bone" * 6, ",,wand" + ",wand" * 5 + ",suit:Hip" * 6, ",,1" + ",1" * 5 + ",2" * 6,
             ",,Rotation,Rotation,Rotation,Position,Position,Position" + ",Rotation" * 3 + ",Position" * 3, "Frame,Time,X,Y,Z,X,Y,Z,X,Y,Z,X,Y,Z"]
    for frame in range(FRAMES):
        cells = [f"{frame}", f"{frame / rate:.6f}"]
        for position, rotation in map(y_up, poses(frame / rate)):
            cells += [f"{degrees(angle):.6f}" for angle in euler_zyx(rotation)] + [f"{1000 * part:.6f}" for part in position]
        lines.append(",".join(cells))
    (DATA / "optitrack_euler.csv").write_text("\n".join(lines) + "\n")


def vicon():
    rate = 100
    # Nexus: helical vectors in degrees, millimetres, markers below.
    lines = ["Segments", f"{rate}", ",,wand:wand,,,,,,tool:tip,,,,,", "Frame,Sub Frame" + ",RX,RY,RZ,TX,TY,TZ" * 2, ",," + ",".join(["deg"] * 3 + ["mm"] * 3 + ["deg"] * 3 + ["mm"] * 3)]
    for frame in range(1, FRAMES + 1):
        cells = [f"{frame}", "0"]
        for body, (position, rotation) in enumerate(poses(frame / rate)):
            lost = body == 1 and frame in LOST
            cells += [""] * 6 if lost else [f"{degrees(part):.6f}" for part in helical(rotation)] + [f"{1000 * part:.5f}" for part in position]
        lines.append(",".join(cells))
    lines += ["", "Trajectories", f"{rate}", ",,wand:a,,,wand:b,,", "Frame,Sub Frame,X,Y,Z,X,Y,Z", ",,mm,mm,mm,mm,mm,mm"]
    lines += [f"{frame},0,1,2,3,,," for frame in range(1, 4)]
    (DATA / "vicon_nexus.csv").write_text("\r\n".join(lines) + "\r\n")

    # Tracker: a quaternion and Euler angles, radians, semicolons.
    lines = ["Objects", f"{rate}", ";;Global Angle (Quaternion) wand:wand;;;;;;;Global Angle (Euler ZYX) tool:tip;;;;;;Local Angle (Helical) tool:part;;;;;",
             "Frame;Sub Frame;RX;RY;RZ;RW;TX;TY;TZ" + ";RX;RY;RZ;TX;TY;TZ" * 2, ";;;;;;mm;mm;mm" + ";rad;rad;rad;mm;mm;mm" * 2]
    for frame in range(1, FRAMES + 1):
        (position, (w, x, y, z)), (other, rotation) = poses(frame / rate)
        cells = [f"{frame}", "0"] + [f"{part:.7f}" for part in (x, y, z, w)] + [f"{1000 * part:.5f}" for part in position]
        cells += [f"{part:.7f}" for part in euler_zyx(rotation)] + [f"{1000 * part:.5f}" for part in other] + ["0"] * 6
        lines.append(";".join(cells))
    (DATA / "vicon_tracker.csv").write_text("\n".join(lines) + "\n")


def readings(t):
    """What an IMU in the first body reads: specific force, angular velocity, both in its axes."""
    rotation = poses(t)[0][1]
    acceleration = (-2 * cos(2 * t), -2 * sin(2 * t), -0.9 * sin(3 * t))
    turn, roll = 0.8, 0.8 * cos(2 * t)
    angle = 0.4 * sin(2 * t)
    return turned(inverse(rotation), added(acceleration, (0, 0, 9.80665))), (roll, turn * sin(angle), turn * cos(angle)), acceleration, rotation


def movella():
    rate, step, first = 60, 16667, 2 ** 32 - 10 * 16667
    columns = "PacketCounter,SampleTimeFine,Quat_W,Quat_X,Quat_Y,Quat_Z,FreeAcc_X,FreeAcc_Y,FreeAcc_Z,Acc_X,Acc_Y,Acc_Z,Gyr_X,Gyr_Y,Gyr_Z,Mag_X,Mag_Y,Mag_Z,Status"
    lines = ["sep=,", "DeviceTag:,Left wrist", "FirmwareVersion:,2.4.0", "AppVersion:,v2023.6", "SyncStatus:,Synced", f"OutputRate:,{rate}Hz", "FilterProfile:,General", "Measurement Mode:,Sensor fusion Mode - Custom Mode 5", "StartTime:,2026-11-25 10:15:30", "", columns]
    for sample in range(FRAMES):
        t = sample * step / 1e6
        force, rate_of_turn, acceleration, rotation = readings(t)
        cells = [f"{sample}", f"{(first + sample * step) % 2 ** 32}"] + [f"{value:.7f}" for value in (*rotation, *acceleration, *force, *map(degrees, rate_of_turn), 0.5, 0.1, -0.8)] + ["0"]
        # A packet that the receiver lost.
        lines.append(",".join(cells[:2] + [""] * (len(cells) - 2) if sample == 20 else cells))
    (DATA / "dot.csv").write_text("\n".join(lines) + "\n")

    # MT Manager: radians a second, tenths of milliseconds or none at all, tabs, a counter of 16 bits.
    rate = 100
    lines = ["// Start Time: Unknown", f"// Update Rate: {rate}.0Hz", "// Filter Profile: human (46.1)", "// Firmware Version: 4.0.2", "\t".join("PacketCounter SampleTimeFine Acc_X Acc_Y Acc_Z Gyr_X Gyr_Y Gyr_Z Quat_q0 Quat_q1 Quat_q2 Quat_q3".split())]
    for sample in range(FRAMES):
        force, rate_of_turn, _, rotation = readings(sample / rate)
        lines.append("\t".join([f"{(65530 + sample) % 65536:05d}", ""] + [f"{value:.7f}" for value in (*force, *rate_of_turn, *rotation)]))
    (DATA / "mt_manager.txt").write_text("\n".join(lines) + "\n")

    # Increments of velocity and orientation, as a DOT in one of its modes has them.
    rate = 60
    lines = ["DeviceTag:,", f"OutputRate:,{rate}Hz", "PacketCounter,SampleTimeFine,dq_W,dq_X,dq_Y,dq_Z,dv[1],dv[2],dv[3]"]
    for sample in range(FRAMES):
        force, rate_of_turn, _, _ = readings(sample * step / 1e6)
        turn = [part / rate for part in rate_of_turn]
        length = sqrt(sum(part ** 2 for part in turn))
        quaternion = (cos(length / 2), *(sin(length / 2) * part / length for part in turn))
        lines.append(",".join([f"{sample}", f"{sample * step}"] + [f"{value:.9f}" for value in (*quaternion, *(part / rate for part in force))]))
    (DATA / "dot_increments.csv").write_text("\n".join(lines) + "\n")


def mvnx():
    """Two segments, each with a sensor that is turned by a quarter about its z axis."""
    rate, mount = 60, about("z", pi / 2)
    words = lambda values: " ".join(f"{value:.7f}" for value in values)
    lines = ['<?xml version="1.0" encoding="UTF-8"?>', '<mvnx xmlns="http://www.xsens.com/mvn/mvnx" version="4">', '<mvn version="2021.0" build="1"/>', "<comment/>",
             f'<subject label="one" frameRate="{rate}" segmentCount="2" recDateMSecsSinceEpoch="1700000000250" originalFilename="one.mvn">',
             "<segments>", '<segment label="Pelvis" id="1"><points><point label="pHipOrigin"><pos_b>0 0 0</pos_b></point></points></segment>', '<segment label="L5" id="2"/>', "</segments>",
             '<sensors><sensor label="Pelvis"/></sensors>', f'<frames segmentCount="2" sensorCount="1" jointCount="1">',
             '<frame time="0" index="" type="identity"><orientation>1 0 0 0 1 0 0 0</orientation><position>0 0 0 0.1 0 0.02</position></frame>']
    for frame in range(FRAMES):
        (position, rotation), (other, _) = poses(frame / rate)
        _, rate_of_turn, acceleration, _ = readings(frame / rate)
        in_world = turned(rotation, rate_of_turn)
        lines += [f'<frame time="{round(1000 * frame / rate)}" index="{frame}" tc="00:00:00:00" ms="0" type="normal">', f"<orientation>{words(rotation * 2)}</orientation>", f"<position>{words(position + other)}</position>",
                  f"<angularVelocity>{words(in_world * 2)}</angularVelocity>", f"<sensorFreeAcceleration>{words(acceleration)}</sensorFreeAcceleration>",
                  f"<sensorOrientation>{words(product(rotation, mount))}</sensorOrientation>", "<jointAngle>0 0 0</jointAngle>", "</frame>"]
    lines += ["</frames>", "</subject>", "</mvnx>"]
    (DATA / "suit.mvnx").write_text("\n".join(lines) + "\n")


def main():
    for folder in (DATA, SAMPLES):
        folder.mkdir(parents=True, exist_ok=True)
    optitrack(); vicon(); movella(); mvnx()
    # Fuzzing starts from a few frames of each.
    for path in DATA.iterdir():
        lines = path.read_text().splitlines(keepends=True)
        few = lines[:28] + lines[-3:] if path.suffix == ".mvnx" else lines[:24]
        (SAMPLES / path.name).write_text("".join(few))


main()
