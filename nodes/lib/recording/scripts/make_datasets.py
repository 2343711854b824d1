"""Makes tests/data/broad.mat and ../../../tests/fuzz/samples/datasets: `python3 make_datasets.py` (numpy, scipy).

Look-alikes of the data sets' files, a few rows each; broad.mat has the keys, shapes and units of a published trial.
"""
import io, pickle, zipfile
from pathlib import Path
import numpy as np
from scipy.io import savemat
from scipy.spatial.transform import Rotation

HERE = Path(__file__).resolve().parent.parent
DATA, SAMPLES = HERE / "tests" / "data", HERE.parents[2] / "tests" / "fuzz" / "samples" / "datasets"
N, RATE = 40, 2000 / 7
rng = np.random.default_rng(3)


def text_header(path):
    """The day of their making would make them differ."""
    content = path.read_bytes()
    path.write_bytes(b"MATLAB 5.0 MAT-file".ljust(116) + content[116:])


def broad():
    time = np.arange(N) / RATE
    turn = Rotation.from_rotvec(np.stack([0 * time, 0 * time, 0.5 * time], 1))
    quat = turn.as_quat()[:, [3, 0, 1, 2]]
    quat[10:13] = np.nan
    pos = np.stack([0.1 * time, 0 * time, 1 + 0 * time], 1)
    pos[10:13] = np.nan
    still = np.tile([0.0, 0.0, 9.8], (N, 1))
    movement = np.zeros((N, 1), np.uint8)
    movement[20:] = 1
    arrays = dict(imu_acc=still, imu_gyr=np.tile([0.0, 0.0, 0.5], (N, 1)), imu_mag=np.tile([20.0, 0.0, -40.0], (N, 1)),
                  opt_pos=pos, opt_quat=quat, movement=movement, sampling_rate=RATE)
    savemat(DATA / "broad.mat", arrays, do_compression=True)
    text_header(DATA / "broad.mat")
    short = dict(zip(["imu_acc", "imu_gyr", "imu_mag", "opt_pos", "opt_quat", "sampling_rate"], ["acc", "gyr", "mag", "pos", "quat_wxyz", "fs"]))
    npz(SAMPLES / "broad.npz", {short.get(key, key): np.asarray(value) for key, value in arrays.items()})


def npz(path, arrays):
    with zipfile.ZipFile(path, "w", zipfile.ZIP_DEFLATED) as archive:
        for key, array in arrays.items():
            stream = io.BytesIO()
            np.save(stream, array)
            archive.writestr(zipfile.ZipInfo(f"{key}.npy"), stream.getvalue())


def marked_imu():
    time = np.arange(30) / 100
    shape = np.array([[0.1, 0, 0], [-0.1, 0.05, 0], [0, -0.1, 0.02]])
    seen = np.einsum("nij,mj->mni", Rotation.from_rotvec(np.stack([0 * time, 0.8 * time, 0 * time], 1)).as_matrix(), shape) + [1.0, 2.0, 0.5]
    seen[1, 4:6] = np.nan
    still = np.tile([0.0, 0.0, 9.8], (60, 1))
    npz(SAMPLES / "marked_imu.npz", dict(fs_imu=np.asarray(200.0), fs_mocap=np.asarray(100.0), acc=still, gyr=0.1 * still,
                                         marker_a=seen[0], marker_b=seen[1], marker_c=seen[2]))


def totalcapture():
    names = ["Head", "L_LowArm"]
    lines = ["2 3"]
    for frame in range(1, 4):
        lines.append(str(frame))
        lines += [f"{name}\t0.8 0 0.6 0\t{frame} 0.5 9.81\t0.1 0.2 0.3\t1 2 3" for name in names]
    (SAMPLES / "totalcapture.sensors").write_text("\n".join(lines) + "\n")
    (SAMPLES / "totalcapture_reference.txt").write_text("Hips\tHead\n0 40 0\t0 70 10\n10 40 0\t0 70 10\nHips\tHead\n0 0 0 1\t0 0.6 0 0.8\n0 0 0 1\t0 0 0 1\n")
    (SAMPLES / "totalcapture_calib.txt").write_text("2\nHead 0 0 0 1\nPelvis 0.6 0 0 0.8\n")


def pamap2():
    rows = []
    for k in range(3):
        imus = [" ".join(["NaN"] * 17 if imu == 0 and k == 1 else [f"{imu + 0.1 * column + k:.2f}" for column in range(17)]) for imu in range(3)]
        rows.append(f"{5 + 0.01 * k:.2f} {4 if k < 2 else 24} NaN {' '.join(imus)}")
    (SAMPLES / "pamap2.dat").write_text("\n".join(rows) + "\n")


def realworld():
    table = "id,attr_time,attr_x,attr_y,attr_z\n" + "".join(f"{k + 1},{1435995800000 + 20 * k},{0.1 * k},1.5,-9.5\n" for k in range(6))
    with zipfile.ZipFile(SAMPLES / "realworld.zip", "w") as archive:
        for name in ("acc_walking_chest.csv", "acc_walking_forearm.csv"):
            archive.writestr(zipfile.ZipInfo(name), table)


def dip():
    count = 2
    arrays = {"imu_ori": np.tile(np.eye(3), (count, 17, 1, 1)), "imu_acc": rng.normal(size=(count, 17, 3)), "gt": rng.normal(size=(count, 72)) * 0.2}
    (SAMPLES / "dip.pkl").write_bytes(pickle.dumps({key: value.astype("f4") for key, value in arrays.items()}, protocol=2))


def skeleton():
    turn = np.tile([1.0, 0.0, 0.0, 0.0], (3, 2, 1)).astype("f4")
    npz(SAMPLES / "skeleton.npz", dict(fps=np.float64(120.0), joints=np.array(["hip", "chest"]), parents=np.array([-1, 0]),
        offsets=np.array([[0.0, 0.9, 0.0], [0.0, 0.3, 0.0]], "f4"), local_quat_wxyz=turn, pos=np.zeros((3, 2, 3), "f4"),
        label=np.array([0, -1, 0], "i1"), label_names=np.array(["WALKING"]), subject=np.array("02"), atypical=np.array("")))


def har_spsw():
    """Two executions; the phone repeats a stamp, the watch has no second execution."""
    arrays = {}
    for execution, device, start in (("01", "sp", 0), ("01", "sw", 3), ("02", "sp", 5000)):
        count = 6
        prefix = f"{execution}_{device}__"
        arrays[prefix + "acc"] = np.tile([0.5, 9.75, -0.25], (count, 1)).astype("f4") + np.arange(count, dtype="f4")[:, None]
        arrays[prefix + "gyr"] = np.tile([0.25, 0.0, -0.5], (count, 1)).astype("f4")
        arrays[prefix + "t_ms"] = 1657533977800 + start + np.array([0, 10, 10, 21, 85, 95])
        arrays[prefix + "label"] = np.array(["SEATED"] * 3 + ["STANDING_UP"] * 2 + ["SEATED"])
    npz(DATA / "har_spsw.npz", arrays)
    npz(SAMPLES / "har_spsw.npz", arrays)


SAMPLES.mkdir(parents=True, exist_ok=True)
broad(); marked_imu(); totalcapture(); pamap2(); realworld(); dip(); skeleton(); har_spsw()
