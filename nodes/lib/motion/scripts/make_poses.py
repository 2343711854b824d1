"""Makes tests/data/poses/: one motion as each tool writes it, and expected.npz: `python3 make_poses.py` (numpy, scipy, joblib, omegaconf; torch is imitated).

The motion is of the SMPL-H and SMPL-X bodies of ../body/tests/data. expected.npz holds for every file the joints (N, 24, 3), m, in a world with
z up, by SMPL's equations written anew here; of files without a trajectory relative to the pelvis, seen by a level camera along x.
"""
import collections, io, pickle, sys, types, zipfile
from pathlib import Path
import joblib, numpy as np
from omegaconf import OmegaConf
from scipy.spatial.transform import Rotation

HERE = Path(__file__).resolve().parent.parent
BODIES, DATA = HERE.parent / "body" / "tests" / "data", HERE / "tests" / "data" / "poses"
PARENTS = [-1, 0, 0, 0, 1, 2, 3, 4, 5, 6, 7, 8, 9, 9, 9, 12, 13, 14, 16, 17, 18, 19, 20, 21]
N = 6
rng = np.random.default_rng(8)

# The motion, world z up: upright with some lean, everything else turned at random.
upright = Rotation.from_euler("xyz", [90, 0, 0], degrees=True)
root = Rotation.from_euler("z", np.linspace(0, 60, N)[:, None], degrees=True) * Rotation.from_rotvec(rng.normal(size=(N, 3)) * 0.1) * upright
body = rng.normal(size=(N, 23, 3)) * 0.3
pelvis = np.cumsum(rng.normal(size=(N, 3)) * 0.05, 0) + [1.0, -2.0, 0.9]
betas = rng.normal(size=10)


def rest_joints(name, betas):
    model = np.load(BODIES / name)
    shaped = model["v_template"] + model["shapedirs"][:, :, : len(betas)] @ betas
    joints = model["J_regressor"] @ shaped
    parents = model["kintree_table"][0].astype(np.int64)
    # SMPL's hands stand at the roots of the middle fingers.
    hands = [[j for j in range(22, len(parents)) if parents[j] == wrist][1] for wrist in (20, 21)]
    return np.concatenate([joints[:22], joints[hands]])


def posed(rest, root, body, pelvis):
    """Joints (N, 24, 3) of world_from_pelvis, (N, 23, 3) axis-angles and pelvis positions."""
    out = np.zeros((len(pelvis), 24, 3))
    for n in range(len(pelvis)):
        frames = [(root[n], pelvis[n])]
        for j in range(1, 24):
            rotation, place = frames[PARENTS[j]]
            frames.append((rotation * Rotation.from_rotvec(body[n, j - 1]), place + rotation.apply(rest[j] - rest[PARENTS[j]])))
        out[n] = [place for _, place in frames]
    return out


def flat_hands(body):
    return np.concatenate([body[:, :21], np.zeros((len(body), 2, 3))], 1)


class FloatStorage: ...


class Storage:
    def __init__(self, values, key):
        self.content, self.key = np.asarray(values, "<f4"), key


def _rebuild_tensor_v2(*arguments): ...


def _load_from_bytes(content): ...


for module, names in {"torch": [FloatStorage], "torch._utils": [_rebuild_tensor_v2], "torch.storage": [_load_from_bytes]}.items():
    sys.modules[module] = made = types.ModuleType(module)
    for thing in names:
        thing.__module__ = module
        setattr(made, thing.__name__, thing)
sys.modules["torch"].Tensor = type("Tensor", (), {})  # scipy asks for it


class Tensor:
    """As torch pickles a contiguous one; within other pickles its storage is torch's legacy file."""
    def __init__(self, values, key=None):
        self.values, self.key = np.asarray(values, "<f4"), key

    def __reduce_ex__(self, protocol):
        shape = self.values.shape
        strides = tuple(int(np.prod(shape[axis + 1:])) for axis in range(len(shape)))
        storage = Storage(self.values, self.key) if self.key else Inner(self.values)
        return _rebuild_tensor_v2, (storage, 0, shape, strides, False, collections.OrderedDict())


class Inner:
    def __init__(self, values):
        self.values = values

    def __reduce_ex__(self, protocol):
        system = {"protocol_version": 1001, "little_endian": True, "type_sizes": {"short": 2, "int": 4, "long": 4}}
        storage = Storage(self.values, "7")
        parts = [pickle.dumps(part, protocol=2) for part in (0x1950A86A20F9469CFC6C, 1001, system)] + [torch_pickle(storage, (None,))]
        parts += [pickle.dumps(["7"], protocol=2), self.values.size.to_bytes(8, "little"), self.values.tobytes()]
        return _load_from_bytes, (b"".join(parts),)


def torch_pickle(thing, view=()):
    stream, found = io.BytesIO(), []

    class Pickler(pickle.Pickler):
        def persistent_id(self, thing):
            if not isinstance(thing, Storage):
                return None
            found.append(thing)
            return ("storage", FloatStorage, thing.key, "cpu", thing.content.size, *view)

    Pickler(stream, protocol=2).dump(thing)
    return (stream.getvalue(), found) if not view else stream.getvalue()


expected = {}
f4 = lambda values: np.asarray(values, np.float32)


def amass():
    rest, count = rest_joints("model_smplh_female.npz", betas), len(betas)
    fullpose = np.concatenate([root.as_rotvec(), body[:, :21].reshape(N, 63), rng.normal(size=(N, 90))], 1)
    common = dict(trans=pelvis - rest[0], betas=np.concatenate([betas, np.zeros(16 - count)]))
    np.savez(DATA / "amass.npz", poses=fullpose, gender=np.array(b"female"), mocap_framerate=np.array(120.0), dmpls=np.zeros((N, 8)), **common)
    details = {"mocap_frame_rate": 60.0, "gender": "female", "mocap_fname": "a.c3d", "stageii_errs": {"data": [np.zeros(3)]}}
    with open(DATA / "stageii.pkl", "wb") as file:
        pickle.dump({"fullpose": fullpose, "stageii_debug_details": details, "labels": ["LFHD"], **common}, file, protocol=2)
    expected["amass.npz"] = expected["stageii.pkl"] = posed(rest, root, flat_hands(body), pelvis)
    rest = rest_joints("model_smplx.npz", betas)
    parts = dict(root_orient=root.as_rotvec(), pose_body=body[:, :21].reshape(N, 63), pose_hand=rng.normal(size=(N, 90)), pose_jaw=rng.normal(size=(N, 3)))
    # As MoSh++ writes it: its settings are OmegaConf's objects, which lie in circles through their parents.
    details = {**details, "cfg": OmegaConf.create({"surface_model": {"type": "smplh", "gender": "${mocap.gender}"}, "mocap": {"gender": "female", "tags": [1, None]}})}
    with open(DATA / "stageii_settings.pkl", "wb") as file:
        pickle.dump({"fullpose": fullpose, "stageii_debug_details": details, "labels": ["LFHD"], **common}, file)
    expected["stageii_settings.pkl"] = expected["stageii.pkl"]
    np.savez_compressed(DATA / "stageii_smplx.npz", surface_model_type="smplx", gender="neutral", mocap_frame_rate=50, trans=pelvis - rest[0], betas=betas,
                        num_betas=16, markers=np.zeros((N, 3, 3)), labels=np.array(["a", "b", "c"]), **parts)
    expected["stageii_smplx.npz"] = posed(rest, root, flat_hands(body), pelvis)


# Axes of a level camera that looks along x: x right, y down, z forward; and of a world with y up.
camera_from_world = Rotation.from_matrix([[0, -1, 0], [0, 0, -1], [1, 0, 0]])
y_up_from_world = Rotation.from_euler("x", -90, degrees=True)


def video():
    rest = rest_joints("model_smplh_female.npz", betas)
    people = lambda n: np.tile(f4(betas), (n, 1))
    pose_in = lambda axes, n: f4(np.concatenate([(axes * root[:n]).as_rotvec(), body[:n].reshape(n, 69)], 1))
    in_place = posed(rest, root, body, np.zeros((N, 3)))
    ids = np.array([10, 11, 12, 14, 15, 16])
    vibe = lambda n, ids: {"pred_cam": np.zeros((n, 3), "f4"), "pose": pose_in(camera_from_world, n), "betas": people(n), "frame_ids": ids, "verts": np.zeros((n, 2, 3), "f4"), "joints2d": None}
    joblib.dump({1: vibe(2, np.arange(2)), 7: vibe(N, ids)}, DATA / "vibe.joblib")
    expected["vibe.joblib"] = in_place
    y_up = dict(pose_world=pose_in(y_up_from_world, N), trans_world=f4(y_up_from_world.apply(pelvis) - rest[0]))
    joblib.dump({0: {**vibe(N, np.arange(N)), **y_up}, 3: {**vibe(2, np.arange(2)), "pose_world": y_up["pose_world"][:2], "trans_world": y_up["trans_world"][:2]}}, DATA / "wham.pkl", compress=3)
    expected["wham.pkl"] = posed(rest, root, body, pelvis)
    frames = {}
    matrices = lambda rotations: f4(rotations.as_matrix())
    for n in range(N):
        one = dict(global_orient=matrices(camera_from_world * root[n])[None], body_pose=matrices(Rotation.from_rotvec(body[n])), betas=f4(betas))
        others = [one] if n < 3 else []
        frames[f"img/{n:06}.jpg"] = {"time": n, "tid": [4] + [9] * len(others), "smpl": [one] + others, "tracked_time": [int(n == 2)] + [0] * len(others), "camera": [np.zeros((1, 3), "f4")]}
    joblib.dump(frames, DATA / "phalp.pkl", compress=("zlib", 3))
    expected["phalp.pkl"] = in_place
    slahmr(rest)
    tram(rest)


def slahmr(rest):
    # Two people; the world is the first camera's axes.
    two = lambda values: np.stack([values, values])
    first = camera_from_world
    mask = np.ones((2, N))
    mask[1, :4] = 0
    np.savez(DATA / "slahmr.npz", root_orient=f4(two((first * root).as_rotvec())), pose_body=f4(two(body[:, :21].reshape(N, 63))), trans=f4(two(first.apply(pelvis) - rest[0])),
             betas=two(f4(betas)), cam_R=two(np.tile(np.eye(3, dtype="f4"), (N, 1, 1))), cam_t=np.zeros((2, N, 3), "f4"), intrins=np.ones(4), floor_plane=np.array([[0.0, 2.0, 0.0]]), track_mask=mask)
    expected["slahmr.npz"] = posed(rest, root, flat_hands(body), pelvis) @ Rotation.from_euler("z", 90, degrees=True).as_matrix().T


def tram(rest):
    # The camera moves: world_from_camera of eight frames of a world with y up; the person is seen from the third on.
    cameras = Rotation.from_rotvec(rng.normal(size=(8, 3)) * 0.5)
    places = rng.normal(size=(8, 3))
    seen = np.arange(2, 2 + N)
    in_camera = cameras[seen].inv() * y_up_from_world
    pelvis_in_camera = cameras[seen].inv().apply(y_up_from_world.apply(pelvis) - places[seen])
    rotations = np.concatenate([(in_camera * root).as_matrix()[:, None], Rotation.from_rotvec(body.reshape(-1, 3)).as_matrix().reshape(N, 23, 3, 3)], 1)
    folder = DATA / "tram"
    folder.mkdir(exist_ok=True)
    person = {"pred_rotmat": Tensor(rotations), "pred_shape": Tensor(np.tile(betas, (N, 1))), "pred_trans": Tensor((pelvis_in_camera - rest[0])[:, None]), "frame": seen}
    np.save(folder / "hps_track_0.npy", person, allow_pickle=True)
    np.save(folder / "camera.npy", {"world_cam_R": f4(cameras.as_matrix()), "world_cam_T": f4(places), "img_focal": 600.0}, allow_pickle=True)
    expected["tram/hps_track_0.npy"] = posed(rest, root, body, pelvis)


def gvhmr():
    rest = rest_joints("model_smplx.npz", betas)
    parts = lambda axes, key: {"global_orient": Tensor((axes * root).as_rotvec(), key + "0"), "body_pose": Tensor(body[:, :21].reshape(N, 63), key + "1"),
                               "transl": Tensor(axes.apply(pelvis) - rest[0], key + "2"), "betas": Tensor(np.tile(betas, (N, 1)), key + "3")}
    content, storages = torch_pickle({"smpl_params_global": parts(y_up_from_world, "1"), "smpl_params_incam": parts(camera_from_world, "2"), "K_fullimg": Tensor(np.eye(3), "9")})
    with zipfile.ZipFile(DATA / "gvhmr.pt", "w", zipfile.ZIP_DEFLATED) as archive:
        for name, part in [("data.pkl", content), ("byteorder", b"little")] + [(f"data/{s.key}", s.content.tobytes()) for s in storages]:
            archive.writestr(zipfile.ZipInfo(f"hmr4d_results/{name}"), part)
    expected["gvhmr.pt"] = posed(rest, root, flat_hands(body), pelvis)


def chains():
    """Two seconds of smooth motion, long enough for derivatives and for the nodes: chain_amass.npz at 60 Hz, chain_wham.pkl at 30 Hz with two people."""
    rest = rest_joints("model_smplh_female.npz", betas)

    def motion(times, phase):
        n = len(times)
        swing = lambda amplitude, hz, shift: amplitude * np.sin(2 * np.pi * hz * times + phase + shift)
        root = Rotation.from_euler("z", 0.4 * times[:, None] + phase) * Rotation.from_euler("x", 90 + 3 * swing(1, 1.1, 0.5)[:, None], degrees=True)
        body = np.zeros((n, 23, 3))
        # Hips and knees, spine, shoulders and elbows, in the order of SMPL's joints less one.
        body[:, 0, 0], body[:, 1, 0] = swing(0.4, 1, 0), swing(0.4, 1, np.pi)
        body[:, 3, 0], body[:, 4, 0] = 0.3 + swing(0.25, 1, 1), 0.3 + swing(0.25, 1, 1 + np.pi)
        body[:, 2, 1] = swing(0.1, 1, 0.3)
        body[:, 15, 2], body[:, 16, 2] = -1.2 + swing(0.2, 1, 2), 1.2 + swing(0.2, 1, 2)
        body[:, 17, 1], body[:, 18, 1] = -0.4 + swing(0.3, 1.3, 0), 0.4 + swing(0.3, 1.3, 1)
        pelvis = np.stack([0.9 * times + 2 * phase, swing(0.03, 1, 0), 0.93 + swing(0.02, 2, 0)], 1)
        return root, body, pelvis

    root, body, pelvis = motion(np.arange(121) / 60, 0.0)
    fullpose = np.concatenate([root.as_rotvec(), body[:, :21].reshape(-1, 63), np.zeros((121, 90))], 1)
    np.savez_compressed(DATA / "chain_amass.npz", poses=fullpose, trans=pelvis - rest[0], betas=np.concatenate([betas, np.zeros(6)]), gender=np.array(b"female"), mocap_framerate=np.array(60.0))
    people = {}
    for person, (first, count), phase in [(0, (0, 61), 0.0), (3, (6, 50), 1.0)]:
        root, body, pelvis = motion((first + np.arange(count)) / 30, phase)
        pose = lambda axes: f4(np.concatenate([(axes * root).as_rotvec(), body.reshape(-1, 69)], 1))
        people[person] = {"pose": pose(camera_from_world), "trans": np.zeros((count, 3), "f4"), "pose_world": pose(y_up_from_world),
                          "trans_world": f4(y_up_from_world.apply(pelvis) - rest[0]), "betas": np.tile(f4(betas), (count, 1)), "frame_ids": first + np.arange(count)}
    joblib.dump(people, DATA / "chain_wham.pkl", compress=3)


DATA.mkdir(parents=True, exist_ok=True)
chains()
amass()
video()
gvhmr()
np.savez_compressed(DATA / "expected.npz", **expected)
