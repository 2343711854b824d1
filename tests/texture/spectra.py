"""Spectra of real IMUs above a few hertz: what `simulate --texture` draws there is fitted to them here.

    python tests/texture/spectra.py DATA             # the constants of nodes/lib/imu/src/texture/model.rs, fitted
    python tests/texture/spectra.py DATA CROMOSIM    # what they are worth on recordings that they were not fitted to

DATA is the folder of third-party recordings (CONTRIBUTING.md), CROMOSIM the program; NumPy and SciPy are needed. By
hand; no test needs it.
"""

import glob
import subprocess
import sys
import tempfile
from pathlib import Path

import numpy as np
from scipy.signal import butter, resample_poly, sosfiltfilt, welch
from scipy.spatial.transform import Rotation

SEED = 5
WINDOW_S = 1.28
SLOW_HZ = 8.0
REFERENCE_HZ = 20.0
# Per sample at 100 Hz, as of config/devices/consumer_mems.yaml: m/s2, rad/s.
DEVICE_NOISE = (0.0157, 0.00122)
EDGES_HZ = 5.0 * 2.0 ** (np.arange(11) / 3.0)  # third octaves, 5 to 50 Hz
LEAST_VIGOUR = (0.1, 0.01)  # (m/s2)2, (rad/s)2: windows at rest show the device's own noise
CHANNELS = ("specific force", "angular velocity")
QMT = {
    "foot": ["foot_left", "foot_right"],
    "shank": ["lower_leg_left", "lower_leg_right"],
    "thigh": ["upper_leg_left", "upper_leg_right"],
    "trunk": ["hip", "lower_back", "upper_back"],
    "head": ["head"],
    "arm": [f"{part}_{side}" for part in ("hand", "forearm", "upper_arm") for side in ("left", "right")],
}
FITTED_BROAD, JUDGED_BROAD = ("01", "06", "07", "08", "09"), ("10", "11", "15", "16", "21")


def at_100_hz(series, rate_hz):
    """(N, 3) at 100 Hz."""
    if abs(rate_hz - 100.0) < 1e-6:
        return series
    up, down = {204.8: (125, 256)}.get(round(rate_hz, 1), (7, 20))
    return resample_poly(series, up, down, axis=0, padtype="line")


def recording(file, kind, place=None):
    """Specific force and angular velocity at 100 Hz."""
    data = np.load(file)
    if kind == "qmt":
        index = list(data["names"]).index(place)
        return [data["acc"][:, index].astype(float), data["gyr"][:, index].astype(float)]
    if kind == "mtw":
        return [data[f"{place}__acc"].astype(float), data[f"{place}__gyr"].astype(float)]
    rate_hz = 204.8 if kind == "gaitmap" else 2000.0 / 7.0
    return [at_100_hz(data[name].astype(float), rate_hz) for name in ("acc", "gyr")]


def fitted(data):
    """Recordings of each class that the constants are fitted to."""
    qmt = data / "imu_fullbody_qmt/fullbody16.npz"
    classes = {name: [recording(qmt, "qmt", place) for place in places] for name, places in QMT.items()}
    mtw = data / "gait_mtw/1019_pp01.npz"
    classes["foot"] += [recording(mtw, "mtw", place) for place in ("leftfoot", "rightfoot")]
    classes["held"] = [recording(broad(data, trial), "broad") for trial in FITTED_BROAD]
    return classes


def broad(data, trial):
    return glob.glob(str(data / f"paired_broad/{trial}_*.npz"))[0]


def windows(series):
    """Of each window: its mean square below SLOW_HZ per axis, and its density in each band."""
    rate_hz, length = 100.0, int(WINDOW_S * 100.0)
    slow = sosfiltfilt(butter(4, SLOW_HZ / (rate_hz / 2), output="sos"), np.nan_to_num(series), axis=0)
    for start in range(0, len(series) - length, length // 2):
        part = series[start : start + length]
        if np.isfinite(part).all():
            low = slow[start : start + length]
            yield ((low - low.mean(0)) ** 2).mean(), band_densities(part)


def band_densities(series):
    frequency, density = welch(series, 100.0, nperseg=64, axis=0, detrend="linear")
    density = density.mean(1)
    inside = [(frequency >= a) & (frequency < b) for a, b in zip(EDGES_HZ, EDGES_HZ[1:])]
    return np.array([density[mask].mean() if mask.any() else np.nan for mask in inside])


def fit(recordings, channel):
    """ln density = level + power ln vigour - slope ln(f / REFERENCE_HZ), least squares."""
    rows, values, vigours = [], [], []
    centres = np.sqrt(EDGES_HZ[1:] * EDGES_HZ[:-1])
    for series in recordings:
        for vigour, densities in windows(series[channel]):
            if vigour < LEAST_VIGOUR[channel]:
                continue
            vigours.append(vigour)
            for centre, density in zip(centres, densities):
                if np.isfinite(density) and density > 0.0:
                    rows.append([1.0, np.log(vigour), -np.log(centre / REFERENCE_HZ)])
                    values.append(np.log(density))
    solution, *_ = np.linalg.lstsq(np.array(rows), np.array(values), rcond=None)
    spread = np.std(np.array(values) - np.array(rows) @ solution)
    return solution, spread, np.quantile(vigours, 0.99)


def print_fit(data):
    for name, recordings in fitted(data).items():
        for channel, title in enumerate(CHANNELS):
            (level, power, slope), spread, most = fit(recordings, channel)
            print(f"{name:6} {title:17} level {level:6.2f}, power {power:5.2f}, slope {slope:5.2f}, most vigour {most:6.2f}  (spread {spread:.2f})")


def write_tum(path, seconds, positions, quaternions_wxyz):
    sound = np.isfinite(positions).all(1) & np.isfinite(quaternions_wxyz).all(1)
    rows = np.c_[seconds, positions, quaternions_wxyz[:, [1, 2, 3, 0]]][sound]
    np.savetxt(path, rows, fmt="%.9f")


def shoe_poses(markers):
    """Frames of three markers: their mean, x from heel to toe, z up from their plane; quaternions (w, x, y, z)."""
    heel, toe, side = markers
    x = (toe - heel) / np.linalg.norm(toe - heel, axis=1, keepdims=True)
    z = np.cross(x, side - heel)
    z /= np.linalg.norm(z, axis=1, keepdims=True)
    rotations = Rotation.from_matrix(np.stack([x, np.cross(z, x), z], axis=2))
    return (heel + toe + side) / 3.0, rotations.as_quat()[:, [3, 0, 1, 2]]


def pairs(data):
    """Recordings beside a reference: name, segment, measured series, poses."""
    for trial in JUDGED_BROAD:
        file = broad(data, trial)
        stored = np.load(file)
        seconds = np.arange(len(stored["pos"])) * 7.0 / 2000.0
        yield f"BROAD {trial}", "held", recording(file, "broad"), (seconds, stored["pos"], stored["quat_wxyz"])
    file = data / "paired_gaitmap_foot/left_sensor.npz"
    stored = np.load(file)
    markers = [stored[f"marker_{name}"].astype(float) for name in ("heel_FCC", "toe_TOE", "5thmet_FM5")]
    positions, quaternions = shoe_poses(markers)
    seconds = np.arange(len(positions)) / float(stored["fs_mocap"])
    yield "gaitmap, shoe", "foot", recording(file, "gaitmap"), (seconds, positions, quaternions)


def simulated(program, poses, segment, seed):
    """Specific force and angular velocity at 100 Hz, with a device's noise, and up to which frequencies they resolve."""
    with tempfile.TemporaryDirectory() as folder:
        write_tum(f"{folder}/poses.tum", *poses)
        texture = [f"--texture={segment}"] if segment else []
        command = [program, "simulate", "--rigid", "poses.tum", "--rate", "100", "--trim", "0", "--device", "consumer_mems"]
        subprocess.run(
            [*command, "--seed", str(seed), *texture, "--out", "out.mcap"], cwd=folder, check=True, capture_output=True
        )
        said = subprocess.run([program, "inspect", "out.mcap"], cwd=folder, check=True, capture_output=True, text=True).stdout
        subprocess.run(
            [program, "bag", "csv", "out.mcap", "/imu/body/data_raw", "--out", "imu.csv"], cwd=folder, check=True, capture_output=True
        )
        table = np.genfromtxt(f"{folder}/imu.csv", delimiter=",", names=True)
    names = table.dtype.names
    force = np.stack([table[name] for name in names[-3:]], axis=1)
    rate = np.stack([table[name] for name in names[-6:-3]], axis=1)
    resolved = said.split("specific force ")[1]
    return [force, rate], [float(resolved.split(",")[0]), float(resolved.split("angular velocity ")[1].split()[0].strip(",;}"))]


def distance(found, wanted, bands):
    """Root mean square of the difference of two lists of densities, dB."""
    step = 10.0 * (np.log10(found) - np.log10(wanted))[:, bands]
    return np.sqrt(np.nanmean(step**2))


def all_densities(series):
    return np.array([densities for _, densities in windows(series)])


def judge_pairs(data, program):
    print("| recording | segment | specific force, from Hz | without | with texture | angular velocity, from Hz | without | with texture |")
    print("|---|---|---:|---:|---:|---:|---:|---:|")
    for name, segment, measured, poses in pairs(data):
        plain, resolved = simulated(program, poses, None, SEED)
        textured, _ = simulated(program, poses, segment, SEED)
        cells = []
        for channel in range(2):
            bands = EDGES_HZ[:-1] >= resolved[channel]
            real, without, with_texture = (all_densities(it[channel]) for it in (measured, plain, textured))
            count = min(map(len, (real, without, with_texture)))
            cells += [resolved[channel], distance(without[:count], real[:count], bands), distance(with_texture[:count], real[:count], bands)]
        print(f"| {name} | {segment} | " + " | ".join(f"{cell:.1f}" for cell in cells) + " |")


def worn(data):
    """Recordings without a reference, of people who are not among the fitted ones: name, segment, series."""
    mtw = data / "gait_mtw/1019_pp01.npz"
    for place, segment in (("leftshank", "shank"), ("rightshank", "shank"), ("lumbar", "trunk")):
        yield f"MTw {place}", segment, [recording(mtw, "mtw", place)]
    for device, segment in (("sw", "arm"), ("sp", "thigh")):
        people = [phone_or_watch(data / f"har_spsw/s{number:02}.npz", device) for number in range(1, 13)]
        yield f"HAR, 12 people, {dict(sw='watch', sp='phone in the pocket')[device]}", segment, [it for all_of in people for it in all_of]


def phone_or_watch(file, device):
    """The recordings of a person at 100 Hz; both channels on the accelerometer's span."""
    stored, found = np.load(file), []
    for key in stored.files:
        if not key.endswith(f"{device}__acc"):
            continue
        stem = key.removesuffix("__acc")
        times = [stored[f"{stem}__{kind}_t_ms"] if f"{stem}__{kind}_t_ms" in stored.files else stored[f"{stem}__t_ms"] for kind in ("acc", "gyr")]
        series = [stored[f"{stem}__{kind}"].astype(float) for kind in ("acc", "gyr")]
        if any(len(time) != len(values) for time, values in zip(times, series)) or len(times[0]) < 300:
            continue
        grid = np.arange(max(t[0] for t in times), min(t[-1] for t in times), 10.0)
        found.append([np.stack([np.interp(grid, t, v[:, axis]) for axis in range(3)], axis=1) for t, v in zip(times, series)])
    return found


def judge_worn(data):
    """A real IMU's own readings below 8 Hz stand in for a simulation, a device's noise is added."""
    constants = {name: [fit(recordings, channel) for channel in range(2)] for name, recordings in fitted(data).items()}
    print("| recording | segment | specific force: without | with texture | angular velocity: without | with texture |")
    print("|---|---|---:|---:|---:|---:|")
    generator = np.random.default_rng(SEED)
    for name, segment, recordings in worn(data):
        cells = []
        for channel in range(2):
            (level, power, slope), _, most = constants[segment][channel]
            real, without, with_texture = [], [], []
            for series in recordings:
                series = series[channel]
                low = sosfiltfilt(butter(4, SLOW_HZ / 50.0, output="sos"), np.nan_to_num(series), axis=0)
                low = low + generator.normal(0.0, DEVICE_NOISE[channel], low.shape)
                for (vigour, wanted), (_, found) in zip(windows(series), windows(low)):
                    if vigour < LEAST_VIGOUR[channel]:
                        continue
                    grown = min(vigour, most) ** power * max(vigour / most, 1.0)
                    centres = np.sqrt(EDGES_HZ[1:] * EDGES_HZ[:-1])
                    drawn = np.exp(level) * grown * (centres / REFERENCE_HZ) ** -slope
                    real.append(wanted), without.append(found), with_texture.append(found + drawn)
            bands = EDGES_HZ[:-1] >= 1.25 * SLOW_HZ
            cells += [distance(np.array(it), np.array(real), bands) for it in (without, with_texture)]
        print(f"| {name} | {segment} | " + " | ".join(f"{cell:.1f}" for cell in cells) + " |")


def judge(data, program):
    judge_pairs(data, program)
    print()
    judge_worn(data)


if __name__ == "__main__":
    if len(sys.argv) == 2:
        print_fit(Path(sys.argv[1]))
    else:
        judge(Path(sys.argv[1]), sys.argv[2])
