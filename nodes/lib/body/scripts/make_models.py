"""Makes tests/data/model_*: tiny bodies with random numbers in the layout of SMPL, SMPL-H and SMPL-X files (numpy, scipy).

Their classes of chumpy are imitations: a file stores an object's attributes, not its code.
"""
import pickle, sys, types
from pathlib import Path
import numpy as np, scipy.sparse as sp

DATA = Path(__file__).resolve().parent.parent / "tests" / "data"
VERTICES = 8
SMPL = [-1, 0, 0, 0, 1, 2, 3, 4, 5, 6, 7, 8, 9, 9, 9, 12, 13, 14, 16, 17, 18, 19, 20, 21]


def fingers(first, wrist):
    return [parent for finger in range(5) for parent in (wrist, first + 3 * finger, first + 3 * finger + 1)]


SMPLH = SMPL[:22] + fingers(22, 20) + fingers(37, 21)
SMPLX = SMPL[:22] + [15, 15, 15] + fingers(25, 20) + fingers(40, 21)


class Ch: ...
class Select(Ch): ...


for name, members in {"chumpy": {}, "chumpy.ch": {"Ch": Ch}, "chumpy.reordering": {"Select": Select}}.items():
    sys.modules[name] = types.ModuleType(name)
    for key, value in members.items():
        value.__module__ = name
        setattr(sys.modules[name], key, value)


def chumpy(values):
    made = Ch()
    made.__dict__.update(x=values, _dirty_vars=set(), _itr=None, _depends_on_deps=None)
    return made


def select(values):
    made = Select()
    made.__dict__.update(a=chumpy(np.concatenate([values, values], axis=-1)), preferred_shape=values.shape)
    columns = values.shape[-1]
    made.idxs = (np.arange(values.size) // columns * 2 * columns + np.arange(values.size) % columns).astype(np.int64)
    return made


def model(parents, betas, seed):
    rng = np.random.default_rng(seed)
    joints = len(parents)
    sums = lambda rows: rows / rows.sum(axis=1, keepdims=True)
    posedirs = 0.02 * rng.normal(size=(VERTICES, 3, 9 * (joints - 1)))
    posedirs[rng.random(posedirs.shape) < 0.8] = 0
    weights = rng.random((VERTICES, joints)) ** 6
    shapedirs = 0.03 * rng.normal(size=(VERTICES, 3, betas))
    shapedirs[..., 10:][rng.random((VERTICES, 3, max(betas - 10, 0))) < 0.8] = 0
    return {
        "v_template": rng.normal(size=(VERTICES, 3)), "shapedirs": shapedirs, "posedirs": posedirs.astype("f4"), "weights": sums(weights),
        "J_regressor": sums(rng.random((joints, VERTICES)) * (rng.random((joints, VERTICES)) < 0.5) + 1e-3),
        "kintree_table": np.array([[p % 2**32 for p in parents], range(joints)], dtype="u4"), "f": np.array([[0, 1, 2], [2, 3, 4], [5, 6, 7]], "u4"),
        "bs_type": "lrotmin", "bs_style": "lbs",
    }


smpl = model(SMPL, 10, 1)
smpl.update(J_regressor=sp.csc_matrix(smpl["J_regressor"]), shapedirs=select(smpl["shapedirs"]), posedirs=chumpy(smpl["posedirs"]),
            v_template=chumpy(smpl["v_template"]), weights=chumpy(np.asfortranarray(smpl["weights"])))
(DATA / "model_smpl_m_lbs.pkl").write_bytes(pickle.dumps(smpl, protocol=2).replace(b"numpy._core.multiarray", b"numpy.core.multiarray"))
smplh = model(SMPLH, 16, 2)
np.savez_compressed(DATA / "model_smplh_female.npz", **smplh)
smplh["J_regressor"] = sp.csr_matrix(smplh["J_regressor"])
(DATA / "model_smplh_female.pkl").write_bytes(pickle.dumps(smplh, protocol=4))
np.savez_compressed(DATA / "model_smplx.npz", gender=np.array("neutral"), **model(SMPLX, 400, 3))
