"""Makes ../tests/data/smplx_golden.npz: 50 poses, shapes and translations of the embedded body by the public package smplx in float64.

Run it by hand, in an environment with numpy, torch and smplx (about 3 GB):  python make_smplx_golden.py
Holds: pose (50, 24, 3) axis-angle rad, betas (50, 10), trans (50, 3) m, vertex_ids (200,), vertices (50, 200, 3) m, joints (50, 24, 3) m."""
import json
import pathlib

import numpy as np
import smplx
import torch

import posedirs

HERE = pathlib.Path(__file__).resolve().parent
COUNT, VERTICES = 50, 200
# Joint position, rad: how far a joint is turned at one standard deviation; hips, knees, shoulders and elbows far, the spine little.
SPREAD = np.full(24, 0.3)
SPREAD[[1, 2, 4, 5, 16, 17, 18, 19]] = 0.7
SPREAD[0] = 1.5


def embedded_body():
    assets = HERE.parent / "assets"
    arrays = dict(np.load(assets / "body-without-posedirs.npz"))
    body = {key: value.astype(np.float64) if value.dtype.kind == "f" else value for key, value in arrays.items()}
    constants = json.loads((assets / "posedirs.json").read_text())
    body["posedirs"] = posedirs.make(body["v_template"], body["f"].astype(int), body["weights"], body["J"], constants)
    return body


def main():
    body = embedded_body()
    # smplx wants some named vertices; which they are does not matter here.
    names = "nose reye leye rear lear rthumb rindex rmiddle rring rpinky lthumb lindex lmiddle lring lpinky LBigToe LSmallToe LHeel RBigToe RSmallToe RHeel"
    struct = smplx.utils.Struct(**body)
    model = smplx.SMPL("", data_struct=struct, vertex_ids=dict.fromkeys(names.split(), 0), dtype=torch.float64, num_betas=10, batch_size=COUNT)
    rng = np.random.default_rng(20240601)
    pose = rng.normal(size=(COUNT, 24, 3)) * SPREAD[:, None]
    betas, trans = rng.normal(size=(COUNT, 10)), rng.uniform(-3, 3, size=(COUNT, 3))
    pose[0], betas[0], trans[0] = 0, 0, 0
    pose[1, 0] = [0, np.pi, 0]
    tensor = lambda values: torch.tensor(values, dtype=torch.float64)
    with torch.no_grad():
        out = model(betas=tensor(betas), global_orient=tensor(pose[:, 0]), body_pose=tensor(pose[:, 1:].reshape(COUNT, 69)), transl=tensor(trans))
    ids = np.sort(rng.choice(len(body["v_template"]), VERTICES, replace=False)).astype(np.uint32)
    target = HERE.parent / "tests/data/smplx_golden.npz"
    np.savez_compressed(
        target, pose=pose, betas=betas, trans=trans, vertex_ids=ids, vertices=out.vertices.numpy()[:, ids], joints=out.joints.numpy()[:, :24]
    )
    print(f"{target.name}: {target.stat().st_size} bytes, torch {torch.__version__}")


if __name__ == "__main__":
    main()
