#!/usr/bin/env python3
"""Judges the gap diagnosis on real recordings, beside a plain least-squares fit.

    real.py --cromosim PATH --out DIR [--trial NAME]... [--jobs 2] [--json FILE]
    real.py --out DIR --plain-only

Each trial is cut in two: the diagnosis and the plain fit see the first 60 % of its movement, and both are judged on the rest. The data are
looked for in $CROMOSIM_DATA, else in ../shared/data beside the repository; where there are none, it says "skipped". real_README.md says what the numbers mean.
Needs: numpy, scipy, mcap, zstandard.
"""

import argparse
import json
import os
import struct
import subprocess
import sys
import time
from concurrent.futures import ProcessPoolExecutor
from dataclasses import dataclass, replace
from functools import lru_cache
from pathlib import Path

for threads in ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS"):
    os.environ.setdefault(threads, "1")  # --jobs says how many cores are used

try:
    import numpy as np
    from mcap.reader import make_reader
    from mcap.writer import CompressionType, Writer
    from scipy.interpolate import CubicSpline, make_interp_spline
    from scipy.ndimage import binary_dilation
    from scipy.optimize import least_squares
    from scipy.signal import butter, filtfilt
    from scipy.spatial.transform import Rotation
except ImportError as error:
    sys.exit(f"real.py: {error}; it needs numpy, scipy, mcap and zstandard")

GRAVITY = np.array([0.0, 0.0, -9.80665])
EPOCH_NS = 1_700_000_000_000_000_000
FIT_SHARE = 0.6
EDGE_S = 0.15
"""Left out on either side of a gap in the reference, and at both ends."""


# --- Trials ---


@dataclass
class Recording:
    """One placement's IMU and reference; times in s after the epoch, NaN where the reference saw nothing."""

    imu_s: np.ndarray
    specific_force: np.ndarray
    angular_velocity: np.ndarray
    moving: np.ndarray
    reference_s: np.ndarray
    position: np.ndarray
    quaternion: np.ndarray  # x, y, z, w; world_from_body

    def between(self, from_s, to_s):
        """The part from `from_s` to before `to_s`."""
        imu = (self.imu_s >= from_s) & (self.imu_s < to_s)
        ref = (self.reference_s >= from_s) & (self.reference_s < to_s)
        return Recording(self.imu_s[imu], self.specific_force[imu], self.angular_velocity[imu], self.moving[imu],
                         self.reference_s[ref], self.position[ref], self.quaternion[ref])


@dataclass
class Trial:
    """A recording cut in two."""

    name: str
    placement: str
    low_pass_hz: float
    fit: Recording
    check: Recording


def cut(name, placement, low_pass_hz, whole):
    """Fit and check parts: the first 60 % of the time in movement, and the rest up to the movement's end."""
    moving = np.flatnonzero(whole.moving)
    times = whole.imu_s[moving]
    middle = times[int(FIT_SHARE * len(times))]
    return Trial(name, placement, low_pass_hz, whole.between(times[0], middle), whole.between(middle, times[-1]))


def broad(file):
    """A trial of BROAD: optics already on the IMU's times."""
    data = np.load(file)
    times = np.arange(len(data["acc"])) / float(data["fs"])
    position, quaternion = data["pos"].astype(float), data["quat_wxyz"].astype(float)[:, [1, 2, 3, 0]]
    unseen = np.isnan(position).any(axis=1) | np.isnan(quaternion).any(axis=1)
    position[unseen] = quaternion[unseen] = np.nan
    return cut(file.stem, "body", 20.0, Recording(times, data["acc"].astype(float), data["gyr"].astype(float), data["movement"], times, position, quaternion))


def rigid_frame(markers):
    """World_from_body and origin, per frame, of markers (N, M, 3) by Kabsch against their mean shape; origin: the markers' centroid.

    x runs from the first marker to the second, z is the markers' normal.
    """
    def axes(points):
        x = (points[1] - points[0]) / np.linalg.norm(points[1] - points[0])
        z = np.cross(x, points[2] - points[0])
        z /= np.linalg.norm(z)
        return np.stack([x, np.cross(z, x), z], axis=1)

    origin = markers.mean(axis=1)
    centred = markers - origin[:, None]
    shape = centred[0]
    for _ in range(20):  # the mean shape depends on the rotations and they on it
        u, _, vt = np.linalg.svd(np.einsum("nmi,mj->nij", centred, shape))
        u[:, :, 2] *= np.sign(np.linalg.det(u) * np.linalg.det(vt))[:, None]
        rotation = u @ vt
        shape = np.einsum("nij,nmi->mj", rotation, centred) / len(markers)
    return origin, rotation @ axes(shape)


def gaitmap(file):
    """The foot of gaitmap: a frame from three markers; optics at their own rate."""
    data = np.load(file)
    markers = np.stack([data[f"marker_{name}"] for name in ("heel_FCC", "toe_TOE", "5thmet_FM5")], axis=1).astype(float)
    position, rotation = rigid_frame(markers)
    times = np.arange(len(data["acc"])) / float(data["fs_imu"])
    turning = np.flatnonzero(np.linalg.norm(data["gyr"], axis=1) > 0.5)
    moving = np.zeros(len(times), bool)
    moving[turning[0]:turning[-1] + 1] = True
    recording = Recording(times, data["acc"].astype(float), data["gyr"].astype(float), moving,
                          np.arange(len(position)) / float(data["fs_mocap"]), position, Rotation.from_matrix(rotation).as_quat())
    return cut("gaitmap_foot", "foot", 10.0, recording)


def shared_data():
    """Where the recordings are looked for."""
    return Path(os.environ.get("CROMOSIM_DATA") or Path(__file__).resolve().parents[2].parent / "shared" / "data")


def trials(data):
    """(name, how to read it) of every trial that is there."""
    found = {file.stem: (broad, file) for file in sorted((data / "paired_broad").glob("*.npz"))}
    foot = data / "paired_gaitmap_foot" / "left_sensor.npz"
    return found | ({"gaitmap_foot": (gaitmap, foot)} if foot.exists() else {})


# --- Bags ---

SEPARATOR = "\n" + "=" * 80 + "\nMSG: "
STAMP = SEPARATOR + "builtin_interfaces/Time\nint32 sec\nuint32 nanosec\n"
HEADER = SEPARATOR + "std_msgs/Header\nbuiltin_interfaces/Time stamp\nstring frame_id\n" + STAMP
QUATERNION = SEPARATOR + "geometry_msgs/Quaternion\nfloat64 x 0\nfloat64 y 0\nfloat64 z 0\nfloat64 w 1\n"
SCHEMAS = {
    "geometry_msgs/msg/PoseStamped": "std_msgs/Header header\nPose pose\n" + HEADER + SEPARATOR + "geometry_msgs/Pose\nPoint position\nQuaternion orientation\n"
    + SEPARATOR + "geometry_msgs/Point\nfloat64 x\nfloat64 y\nfloat64 z\n" + QUATERNION,
    "sensor_msgs/msg/Imu": "std_msgs/Header header\ngeometry_msgs/Quaternion orientation\nfloat64[9] orientation_covariance\ngeometry_msgs/Vector3 angular_velocity\n"
    "float64[9] angular_velocity_covariance\ngeometry_msgs/Vector3 linear_acceleration\nfloat64[9] linear_acceleration_covariance\n"
    + HEADER + QUATERNION + SEPARATOR + "geometry_msgs/Vector3\nfloat64 x\nfloat64 y\nfloat64 z\n",
}


def nanoseconds(seconds):
    """Stamps of times after the epoch."""
    return EPOCH_NS + np.round(np.asarray(seconds) * 1e9).astype(np.int64)


def cdr(stamp_ns, frame, numbers):
    """A message made of a header and numbers, in little-endian CDR."""
    text = frame.encode() + b"\0"
    head = struct.pack("<iII", *divmod(int(stamp_ns), 10**9), len(text)) + text
    return b"\0\1\0\0" + head + b"\0" * (-len(head) % 8) + np.asarray(numbers, "<f8").tobytes()


def write_bag(file, placement, recording):
    """The recording as a rosbag2 MCAP, in the order of its stamps; what the reference did not see is not there."""
    seen = ~np.isnan(recording.position[:, 0])
    poses = np.hstack([recording.position, recording.quaternion])[seen]
    readings = np.zeros((len(recording.imu_s), 37))  # orientation 4 + 9, angular velocity 3 + 9, specific force 3 + 9; covariances zero: unknown
    readings[:, 3] = 1.0
    readings[:, 4] = -1.0  # "no orientation", as sensor_msgs says it
    readings[:, 13:16] = recording.angular_velocity
    readings[:, 25:28] = recording.specific_force
    topics = [
        (f"/reference/{placement}", "geometry_msgs/msg/PoseStamped", "world", nanoseconds(recording.reference_s[seen]), poses),
        (f"/imu/{placement}/data_raw", "sensor_msgs/msg/Imu", f"{placement}_imu", nanoseconds(recording.imu_s), readings),
    ]
    with file.open("wb") as stream:
        writer = Writer(stream, compression=CompressionType.ZSTD)
        writer.start(profile="ros2", library="real.py")
        messages = []
        for topic, kind, frame, stamps, rows in topics:
            schema = writer.register_schema(kind, "ros2msg", SCHEMAS[kind].encode())
            channel = writer.register_channel(topic, "cdr", schema)
            messages += [(int(stamp), channel, frame, row) for stamp, row in zip(stamps, rows)]
        messages.sort(key=lambda message: message[:2])
        for sequence, (stamp, channel, frame, row) in enumerate(messages):
            writer.add_message(channel, log_time=stamp, publish_time=stamp, sequence=sequence, data=cdr(stamp, frame, row))
        writer.finish()


def read_imu(file, placement):
    """Stamp to six values (specific force, angular velocity) of every IMU message of the bag."""
    readings = {}
    with file.open("rb") as stream:
        for _, _, message in make_reader(stream).iter_messages(topics=[f"/imu/{placement}/data_raw"]):
            seconds, nanos, length = struct.unpack_from("<iII", message.data, 4)
            start = 4 + -(-(12 + length) // 8) * 8
            numbers = np.frombuffer(message.data, "<f8", 37, start)
            readings[seconds * 10**9 + nanos] = np.concatenate([numbers[25:28], numbers[13:16]])
    return readings


# --- The measure ---


def low_passed(values, rate_hz, cutoff_hz, order=4):
    """Zero-phase Butterworth along the first axis."""
    if cutoff_hz >= 0.45 * rate_hz:
        return values
    b, a = butter(order, cutoff_hz / (rate_hz / 2))
    return filtfilt(b, a, values, axis=0)


def bridged(times, values):
    """Linear interpolation across rows that hold NaN."""
    lost = np.isnan(values).any(axis=1)
    if not lost.any() or lost.all():
        return values
    return np.stack([np.where(lost, np.interp(times, times[~lost], column[~lost]), column) for column in values.T], axis=1)


def rate(times):
    """Samples per second."""
    return (len(times) - 1) / (times[-1] - times[0])


def trusted(recording, edge_s=EDGE_S):
    """IMU samples that lie at least `edge_s` within what the reference saw."""
    seen = ~np.isnan(recording.position[:, 0])
    steps = max(1, int(np.ceil(edge_s * rate(recording.reference_s))))
    near = binary_dilation(~seen, iterations=steps)
    near[:steps] = near[-steps:] = True
    index = np.clip(np.searchsorted(recording.reference_s, recording.imu_s), 1, len(seen) - 1)
    return ~(near[index] | near[index - 1])


def root_mean_square(residual):
    """Of the vector residual (N, 3): three axes together."""
    return float(np.sqrt(np.mean(np.sum(residual**2, axis=1)))) if len(residual) else float("nan")


def measure(recording, simulated, low_pass_hz, also_known):
    """RMSE of measured - simulated (N, 6) over the trusted samples, low-passed in movement and as it is."""
    residual = np.hstack([recording.specific_force, recording.angular_velocity]) - simulated
    smooth = low_passed(bridged(recording.imu_s, residual), rate(recording.imu_s), low_pass_hz)
    inside = trusted(recording) & also_known
    judged = inside & recording.moving
    return {
        "accel": root_mean_square(smooth[judged, :3]), "gyro": root_mean_square(smooth[judged, 3:]),
        "accel_unfiltered": root_mean_square(residual[inside, :3]), "gyro_unfiltered": root_mean_square(residual[inside, 3:]),
        "samples": int(judged.sum()), "missing": int(np.isnan(simulated[:, 0]).sum()),
    }


# --- The plain fit ---


@dataclass
class Smoothing:
    """How the plain fit takes derivatives of the reference."""

    position_hz: float
    rotation_hz: float
    position_order: int = 4
    rotation_order: int = 4
    spline: bool = True
    """Derivatives of a quintic spline through the smoothed samples; else central differences."""

    def __str__(self):
        how = "spline" if self.spline else "differences"
        return f"{how}, position {self.position_hz:g} Hz (order {self.position_order}), rotation {self.rotation_hz:g} Hz (order {self.rotation_order})"


def continuous(quaternion):
    """The same rotations without jumps of sign; NaN are kept."""
    seen = np.flatnonzero(~np.isnan(quaternion[:, 0]))
    result = quaternion.copy()
    flips = np.cumsum(np.sum(result[seen[1:]] * result[seen[:-1]], axis=1) < 0) % 2 == 1
    result[seen[1:][flips]] *= -1
    return result


def filled(times, values):
    """Gaps bridged by a cubic through what is seen: only the smoothing next to a gap feels it."""
    seen = ~np.isnan(values[:, 0])
    return values if seen.all() else np.where(seen[:, None], values, CubicSpline(times[seen], values[seen])(np.clip(times, times[seen][0], times[seen][-1])))


def hamilton(left, right):
    """Product of quaternions (x, y, z, w), row by row."""
    (a, b, c, d), (x, y, z, w) = left.T, right.T
    return np.stack([d * x + a * w + b * z - c * y, d * y - a * z + b * w + c * x, d * z + a * y - b * x + c * w, d * w - a * x - b * y - c * z], axis=1)


@dataclass
class Kinematics:
    """What the reference says of its origin, in body axes, with the six columns that a lever arm needs."""

    times: np.ndarray
    specific_force: np.ndarray
    angular_velocity: np.ndarray
    lever: np.ndarray  # (N, 3, 3): specific force per metre of lever arm


def kinematics(recording, smoothing):
    """Derivatives of the smoothed reference."""
    times, hz = recording.reference_s, rate(recording.reference_s)
    position = low_passed(filled(times, recording.position), hz, smoothing.position_hz, smoothing.position_order)
    quaternion = low_passed(filled(times, continuous(recording.quaternion)), hz, smoothing.rotation_hz, smoothing.rotation_order)
    if smoothing.spline:
        # A spline of the quaternion, normalised: q = s / |s|, so q* q' = s* s' / |s|^2 up to its real part.
        curve = make_interp_spline(times, quaternion, k=5)
        conjugate = quaternion * [-1, -1, -1, 1]
        first, second = curve(times, 1), curve(times, 2)
        square = np.sum(quaternion**2, axis=1, keepdims=True)
        angular_velocity = 2 * hamilton(conjugate, first)[:, :3] / square
        slope = 2 * np.sum(quaternion * first, axis=1, keepdims=True)
        # The derivative of s* s' is s* s'' + s'* s', and s'* s' is real.
        angular_acceleration = 2 * hamilton(conjugate, second)[:, :3] / square - angular_velocity * slope / square
        acceleration = make_interp_spline(times, position, k=5)(times, 2)
    else:
        rotation = Rotation.from_quat(quaternion)
        angular_velocity = np.zeros_like(position)
        angular_velocity[1:-1] = (rotation[:-2].inv() * rotation[2:]).as_rotvec() * hz / 2
        angular_acceleration = np.gradient(angular_velocity, 1 / hz, axis=0)
        acceleration = np.zeros_like(position)
        acceleration[1:-1] = (position[2:] - 2 * position[1:-1] + position[:-2]) * hz**2
    body_from_world = Rotation.from_quat(quaternion).inv()
    return Kinematics(times, body_from_world.apply(acceleration - GRAVITY), angular_velocity, lever_columns(angular_velocity, angular_acceleration))


def cross_matrices(vectors):
    """(N, 3, 3) with M u = v x u."""
    x, y, z = vectors.T
    zero = np.zeros_like(x)
    return np.stack([zero, -z, y, z, zero, -x, -y, x, zero], axis=1).reshape(-1, 3, 3)


def lever_columns(angular_velocity, angular_acceleration):
    """alpha x l + w x (w x l) as a matrix on l."""
    spin = cross_matrices(angular_velocity)
    return cross_matrices(angular_acceleration) + spin @ spin


@dataclass
class Plain:
    """The plain fit's answer: what every textbook calibration would find."""

    lag_s: float
    mount: np.ndarray  # rotation vector, segment_from_sensor
    lever_arm: np.ndarray
    accel_bias: np.ndarray
    gyro_bias: np.ndarray

    def simulate(self, motion, times):
        """Six values at each time."""
        unmount = Rotation.from_rotvec(self.mount).inv()
        body = np.hstack([motion.specific_force + motion.lever @ self.lever_arm, motion.angular_velocity])
        shifted = CubicSpline(motion.times, body)(np.clip(times - self.lag_s, motion.times[0], motion.times[-1]))
        return np.hstack([unmount.apply(shifted[:, :3]) + self.accel_bias, unmount.apply(shifted[:, 3:]) + self.gyro_bias])


def fit_plain(recording, smoothing, low_pass_hz, near=None):
    """Lag by a grid (or from an answer that is `near`), then everything together by least squares; accel and gyro weighted by what they leave."""
    motion = kinematics(recording, smoothing)
    # Filtering and a constant rotation commute, so all signals are filtered once.
    bundle = np.hstack([motion.specific_force, motion.angular_velocity, motion.lever.reshape(-1, 9)])
    curve = CubicSpline(motion.times, low_passed(bundle, rate(motion.times), low_pass_hz))
    measured = low_passed(np.hstack([recording.specific_force, recording.angular_velocity]), rate(recording.imu_s), low_pass_hz)
    use = np.flatnonzero(trusted(recording) & recording.moving)
    use = use[::max(1, int(rate(recording.imu_s) / (2.5 * low_pass_hz)))]  # the low-passed signal holds no more than this
    times, measured = recording.imu_s[use], measured[use]

    @lru_cache(maxsize=2)  # of a gradient's steps only one changes the lag
    def signals_at(lag):
        return curve(times - lag * 1e-3)

    def residual(parameters, weights):
        lag, mount, lever, accel_bias, gyro_bias = parameters[0], *parameters[1:].reshape(4, 3)
        signals = signals_at(lag)
        unmount = Rotation.from_rotvec(mount).inv()
        force = signals[:, :3] + signals[:, 6:].reshape(-1, 3, 3) @ lever
        both = np.hstack([unmount.apply(force) + accel_bias, unmount.apply(signals[:, 3:6]) + gyro_bias])
        return (measured - both) * weights

    def start(lag):
        """Rotation by Kabsch on specific force and angular velocity; how well it fits."""
        signals = signals_at(lag)
        pairs = [(signals[:, :3] / 10, measured[:, :3] / 10), (signals[:, 3:6], measured[:, 3:])]
        rotation, _ = Rotation.align_vectors(np.vstack([pair[0] for pair in pairs]), np.vstack([pair[1] for pair in pairs]))
        turned = rotation.apply(measured[:, 3:])
        return np.sum((turned - signals[:, 3:6]) ** 2), rotation

    if near:
        parameters = np.concatenate([[near.lag_s * 1e3], near.mount, near.lever_arm, near.accel_bias, near.gyro_bias])
    else:
        lag = min(np.arange(-100.0, 100.1, 4.0), key=lambda lag: start(lag)[0])  # ms
        parameters = np.concatenate([[lag], start(lag)[1].as_rotvec(), np.zeros(9)])
    weights = np.ones(6)
    for _ in range(3):  # the weights settle
        parameters = least_squares(lambda p: residual(p, weights).ravel(), parameters, x_scale="jac").x
        left = residual(parameters, np.ones(6))
        weights = 1 / np.repeat([root_mean_square(left[:, :3]), root_mean_square(left[:, 3:])], 3)
    return Plain(parameters[0] * 1e-3, *parameters[1:].reshape(4, 3)), motion


def best_plain(trial):
    """The plain fit with the derivatives that serve it best on the fit part, and what it leaves on the check part.

    The rotation's smoothing is chosen by the gyro, then the position's by the accelerometer.
    """
    def attempt(smoothing, near=None):
        answer, motion = fit_plain(trial.fit, smoothing, trial.low_pass_hz, near)
        left = measure(trial.fit, answer.simulate(motion, trial.fit.imu_s), trial.low_pass_hz, True)
        return left, smoothing, answer

    hz = trial.low_pass_hz
    tried = [attempt(Smoothing(hz, hz, spline=False))]
    tried += [attempt(Smoothing(hz, share * hz, rotation_order=order), tried[0][2]) for order in (2, 4) for share in (0.8, 1.0, 1.25, 1.75)]
    best = min(tried, key=lambda one: one[0]["gyro"])
    tried = [(4, share) for share in (0.5, 0.6, 0.7, 0.8, 0.9, 1.25, 2.0)] + [(2, share) for share in (0.5, 0.7, 0.9)]
    tried = [best] + [attempt(replace(best[1], position_hz=share * hz, position_order=order), best[2]) for order, share in tried]
    left, smoothing, answer = min(tried, key=lambda one: one[0]["accel"])
    return left, smoothing, answer, answer.simulate(kinematics(trial.check, smoothing), trial.check.imu_s)


# --- Cromosim ---


def run(command, log):
    """Runs a command; whether it succeeded, and its seconds. What it said goes into the log."""
    start = time.monotonic()
    try:
        done = subprocess.run([str(word) for word in command], stdout=subprocess.PIPE, stderr=subprocess.STDOUT, timeout=900)
        code, said = done.returncode, done.stdout
    except (OSError, subprocess.TimeoutExpired) as error:
        code, said = -1, str(error).encode()
    with log.open("ab") as stream:
        stream.write(f"$ {' '.join(str(word) for word in command)}\n".encode() + said + f"\nexit {code}\n".encode())
    return code == 0, time.monotonic() - start


def simulated(file, trial):
    """Six values for each IMU sample of the check part; NaN where the bag says nothing."""
    readings = read_imu(file, trial.placement)
    silent = np.full(6, np.nan)
    return np.array([readings.get(int(stamp), silent) for stamp in nanoseconds(trial.check.imu_s)])


def named_causes(diagnosis):
    """(effect, probability) in the order of the report."""
    return [(cause["effect"], cause["probability"]) for cause in diagnosis.get("causes", [])]


def evaluate(name, how, file, cromosim, out):
    """All numbers of one trial."""
    trial, folder = how(file), out / name
    folder.mkdir(parents=True, exist_ok=True)
    log = folder / "cromosim.log"
    log.unlink(missing_ok=True)
    for part in ("fit", "check"):
        write_bag(folder / f"{part}.mcap", trial.placement, getattr(trial, part))

    start = time.monotonic()
    left, smoothing, answer, plain = best_plain(trial)
    row = {"name": name, "plain_seconds": time.monotonic() - start, "smoothing": str(smoothing), "plain_on_fit": left, "seconds_of_fit": float(np.ptp(trial.fit.imu_s)),
           "plain_parameters": {"lag_s": answer.lag_s, **{key: list(getattr(answer, key)) for key in ("mount", "lever_arm", "accel_bias", "gyro_bias")}}}

    series = {"plain": plain}
    if cromosim:
        diagnosis, effects = folder / "diagnosis", folder / "diagnosis" / "effects.yaml"
        for old in (diagnosis / "diagnosis.json", effects, folder / "nominal.mcap", folder / "after.mcap"):
            old.unlink(missing_ok=True)  # an old answer must not pass for a new one
        row["diagnosed"], row["diagnose_seconds"] = run([cromosim, "diagnose", folder / "fit.mcap", "--out", diagnosis, "--force"], log)
        base = [cromosim, "simulate", "--reference", folder / "check.mcap", "--no-noise", "--force"]
        if run([*base, "--out", folder / "nominal.mcap"], log)[0]:
            series["nominal"] = simulated(folder / "nominal.mcap", trial)
        if row["diagnosed"]:
            found = json.loads((diagnosis / "diagnosis.json").read_text())["placements"][trial.placement]
            row["causes"], row["promised"] = named_causes(found), found["gap"]["after"]
            if run([*base, "--effects", effects, "--out", folder / "after.mcap"], log)[0]:
                series["after"] = simulated(folder / "after.mcap", trial)

    # All are judged on the samples that all of them have.
    known = np.all([~np.isnan(values).any(axis=1) for values in series.values()], axis=0)
    for key, values in series.items():
        row[key] = measure(trial.check, values, trial.low_pass_hz, known)
    return row


# --- The report ---


def pair(row, key, suffix="", digits=3):
    """"accel / gyro", or a dash."""
    return f"{row[key]['accel' + suffix]:.{digits}f} / {row[key]['gyro' + suffix]:.{digits + 1}f}" if key in row else "-"


def ratios(row):
    """What cromosim leaves over what the plain fit leaves; None without an answer."""
    return (row["after"]["accel"] / row["plain"]["accel"], row["after"]["gyro"] / row["plain"]["gyro"]) if "after" in row else None


def table(rows):
    """The rows as Markdown."""
    lines = ["RMSE on the check part, accel [m/s2] / gyro [rad/s]; low-passed but for the two columns \"unfiltered\".", "",
             "| trial | nominal | plain fit | after | after/plain | causes (probability) | promised, unfiltered | measured, unfiltered | diagnose s / s of data |", "|---|---|---|---|---|---|---|---|---|"]
    for row in rows:
        ratio = "{:.2f} / {:.2f}".format(*ratios(row)) if ratios(row) else "-"
        causes = ", ".join(f"{effect} {probability:.2f}" for effect, probability in row["causes"]) or "none" if "causes" in row else "-"
        promised = f"{row['promised']['accel_rmse']:.3f} / {row['promised']['gyro_rmse']:.4f}" if "promised" in row else "-"
        seconds = f"{row['diagnose_seconds']:.1f} / {row['seconds_of_fit']:.0f}" if row.get("diagnosed") else "-"
        cells = [row["name"], pair(row, "nominal"), pair(row, "plain"), pair(row, "after"), ratio, causes, promised, pair(row, "after", "_unfiltered"), seconds]
        lines.append("| " + " | ".join(cells) + " |")
    return "\n".join(lines)


def summary(rows):
    """On how many trials cromosim beats the plain fit."""
    judged = [ratios(row) for row in rows if ratios(row)]
    accel, gyro, both = (sum(test(*one) for one in judged) for test in (lambda a, g: a < 1, lambda a, g: g < 1, lambda a, g: a < 1 and g < 1))
    silent = f"; {len(rows) - len(judged)} without a diagnosis" if len(judged) < len(rows) else ""
    return f"cromosim beats the plain fit on {accel} of {len(rows)} trials in accel, {gyro} in gyro, {both} in both{silent}"


def arguments():
    """The command line."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--cromosim", type=Path, help="the program to judge")
    parser.add_argument("--plain-only", action="store_true", help="only the bags and the plain fit")
    parser.add_argument("--out", type=Path, required=True, help="where bags and diagnoses go")
    parser.add_argument("--trial", action="append", help="only this one (a part of its name is enough); may be given again")
    parser.add_argument("--jobs", type=int, default=2)
    parser.add_argument("--json", type=Path, help="write all numbers here")
    given = parser.parse_args()
    if not given.plain_only and not given.cromosim:
        parser.error("--cromosim PATH, or --plain-only")
    return given


def main():
    """Evaluates the trials and prints the table."""
    given = arguments()
    data = shared_data()
    found = trials(data)
    if not found:
        print("skipped: no recordings; CROMOSIM_DATA names the folder that holds paired_broad and paired_gaitmap_foot")
        return
    wanted = {name: reader for name, reader in found.items() if not given.trial or any(part in name for part in given.trial)}
    if not wanted:
        sys.exit(f"no trial is called {' or '.join(given.trial)}; there are {', '.join(found)}")
    cromosim = None if given.plain_only else given.cromosim.resolve()
    if cromosim and not os.access(cromosim, os.X_OK):
        sys.exit(f"{cromosim}: no such program")
    given.out.mkdir(parents=True, exist_ok=True)
    rows = []
    with ProcessPoolExecutor(given.jobs) as pool:
        waiting = [pool.submit(evaluate, name, how, file, cromosim, given.out) for name, (how, file) in wanted.items()]
        for done in waiting:
            rows.append(done.result())
            print(f"{len(rows)} of {len(waiting)}: {rows[-1]['name']}", file=sys.stderr, flush=True)
    print(table(rows))
    print()
    print(summary(rows))
    if given.json:
        given.json.write_text(json.dumps(rows, indent=1))


if __name__ == "__main__":
    main()
