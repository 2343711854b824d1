"""Makes tests/data/many_* and tests/data/expected.txt: `python3 make_samples.py` (numpy, scipy, joblib; torch is imitated).

expected.txt holds, for every sample beside it, one line an array: file, key path, shape, and sum over i of (i + 1) * element_i in C order.
"""
import collections, gzip, io, pickle, struct, sys, types, zipfile
from pathlib import Path
import joblib, numpy as np, scipy.sparse as sp
from scipy.io import loadmat, savemat

DATA = Path(__file__).resolve().parent.parent / "tests" / "data"
rng = np.random.default_rng(4)


def module(name, **names):
    made = types.ModuleType(name)
    sys.modules[name] = made
    for key, value in names.items():
        value.__module__, value.__qualname__ = name, key
        setattr(made, key, value)
    return made


class Ch: ...
class Select(Ch): ...
class FloatStorage: ...
class BFloat16Storage: ...
class LongStorage: ...


class Storage:
    def __init__(self, kind, dtype, values, key):
        self.kind, self.content, self.key = kind, np.asarray(values, dtype), key


def _rebuild_tensor_v2(storage, first, shape, strides, *rest):
    item = storage.itemsize
    return np.lib.stride_tricks.as_strided(storage[first:], shape, [s * item for s in strides])


def _load_from_bytes(content):
    return legacy_load(content)


module("chumpy"); module("chumpy.ch", Ch=Ch); module("chumpy.reordering", Select=Select)
module("torch", FloatStorage=FloatStorage, BFloat16Storage=BFloat16Storage, LongStorage=LongStorage)
module("torch._utils", _rebuild_tensor_v2=_rebuild_tensor_v2); module("torch.storage", _load_from_bytes=_load_from_bytes)


class Tensor:
    def __init__(self, storage, first, shape, strides):
        self.arguments = (storage, first, shape, strides, False, collections.OrderedDict())

    def __reduce_ex__(self, protocol):
        return _rebuild_tensor_v2, self.arguments


class TorchPickler(pickle.Pickler):
    def persistent_id(self, thing):
        return ("storage", thing.kind, thing.key, "cpu", thing.content.size, *self.view) if isinstance(thing, Storage) else None


def torch_pickle(thing, view=()):
    stream = io.BytesIO()
    pickler = TorchPickler(stream, protocol=2)
    pickler.view = view
    pickler.dump(thing)
    return stream.getvalue()


def torch_files():
    floats = Storage(FloatStorage, "<f4", rng.normal(size=24), "0")
    longs = Storage(LongStorage, "<i8", np.arange(-3, 3), "1")
    halves = Storage(BFloat16Storage, "<u2", [0x3F80, 0xC020, 0x4049], "2")
    thing = {"plain": Tensor(floats, 0, (4, 6), (6, 1)), "transposed": Tensor(floats, 0, (6, 4), (1, 6)), "part": Tensor(floats, 7, (2, 3), (6, 1)),
             "expanded": Tensor(floats, 2, (5, 3), (0, 1)), "longs": Tensor(longs, 0, (6,), (1,)), "halves": Tensor(halves, 0, (3,), (1,))}
    storages = [floats, longs, halves]
    with zipfile.ZipFile(DATA / "many.pt", "w") as archive:
        archive.writestr("many/data.pkl", torch_pickle(thing))
        archive.writestr("many/byteorder", "little")
        for storage in storages:
            archive.writestr(f"many/data/{storage.key}", storage.content.tobytes())
    system = {"protocol_version": 1001, "little_endian": True, "type_sizes": {"short": 2, "int": 4, "long": 4}}
    parts = [pickle.dumps(part, protocol=2) for part in (0x1950A86A20F9469CFC6C, 1001, system)] + [torch_pickle(thing, (None,))]
    parts.append(pickle.dumps([storage.key for storage in storages], protocol=2))
    parts += [struct.pack("<q", storage.content.size) + storage.content.tobytes() for storage in storages]
    (DATA / "many_legacy.pt").write_bytes(b"".join(parts))


def legacy_load(content):
    stream = io.BytesIO(content)
    for _ in range(3):
        pickle.load(stream)
    return torch_load(stream, lambda keys_at: legacy_storages(keys_at))


TYPES = {"FloatStorage": "<f4", "LongStorage": "<i8", "BFloat16Storage": "bf"}


class Lazy:
    def __init__(self, kind, key):
        self.kind, self.key = kind, key


class TorchUnpickler(pickle.Unpickler):
    """Independent of torch: storages come from `fetch`."""
    fetch = None

    def persistent_load(self, identity):
        _, kind, key, _, count = identity[:5]
        content = self.fetch(key)
        name = TYPES[kind.__name__]
        if name == "bf":
            return (np.frombuffer(content, "<u2").astype("u4") << 16).view("f4")
        return np.frombuffer(content, name)


def torch_load(stream, storages):
    start = stream.tell()
    skim = TorchUnpickler(stream)
    sizes = {}
    class Probe(pickle.Unpickler):
        def persistent_load(self, identity):
            sizes[identity[2]] = {"<f4": 4, "<i8": 8, "bf": 2}[TYPES[identity[1].__name__]]
            return np.zeros(1)
        def find_class(self, mod, name):
            return (lambda *a: None) if name == "_rebuild_tensor_v2" else super().find_class(mod, name)
    Probe(stream).load()
    content = {}
    for key in pickle.load(stream):
        (count,) = struct.unpack("<q", stream.read(8))
        content[key] = stream.read(count * sizes[key])
    stream.seek(start)
    skim.fetch = content.__getitem__
    return skim.load()


def many():
    def chumpy(values):
        made = Ch()
        made.__dict__.update(x=values, _dirty_vars=set(), _itr=None)
        return made
    select = Select()
    select.__dict__.update(a=chumpy(rng.normal(size=(3, 4))), idxs=np.arange(12)[::-1].copy(), preferred_shape=(4, 3))
    shared = [1, 2.5]
    objects = np.empty((2, 2), dtype=object)
    objects[0, 0], objects[0, 1], objects[1, 0], objects[1, 1] = 1, "b", [3.0], None
    return {
        "bool": np.array([True, False, True]), "half": np.array([0.5, -2.0, 65504.0], "f2"), "big": np.arange(6, dtype=">f8").reshape(2, 3),
        "fortran": np.asfortranarray(rng.normal(size=(3, 4, 2))), "uint": np.array([0, 255], "u1"), "int": np.array([-5, 5], ">i2"),
        "empty": np.zeros((0, 3)), "scalar": np.float32(1.25), "number": -7, "long": 2**70, "wide": -(2**40), "real": 0.1, "truth": True,
        "text": "naïve 東京", "bytes": b"\xff\x00", "array": bytearray(b"ab"), "tuple": ((), (1,), (1, 2), (1, 2, 3), (1, 2, 3, 4)), "set": {7},
        "complex": 1 - 2j, "texts": np.array(["a", "bcd"]), "codes": np.array([b"a", b"bcd"]), "word": np.str_("w"), "objects": objects,
        "ordered": collections.OrderedDict([("z", 1), ("a", 2)]), "lists": collections.defaultdict(list, k=[1]), "shared": [shared, shared],
        "csc": sp.csc_matrix(np.diag([1.0, 2, 3])[:, :2]), "csr": sp.csr_matrix(np.eye(2, 3) * 4), "chumpy": chumpy(np.arange(4.0)), "select": select,
        "matrix_rows": [[1, 2, 3], [4, 5, 6]], "rows": [np.arange(2.0), np.arange(2.0) + 5],
    }


def mat_files(thing):
    keys = ["bool", "half", "big", "fortran", "uint", "int", "empty", "number", "real", "truth", "matrix_rows"]
    arrays = {key: np.asarray(thing[key], "f4") if key == "half" else thing[key] for key in keys}
    more = {"words": "none \u00e9", "struct": {"inner": 1.0}, "cells": np.array([1, "a"], dtype=object), "complex": thing["complex"], "sparse": thing["csc"]}
    for name, compress in ("many_v6.mat", False), ("many_v7.mat", True):
        savemat(DATA / name, {**arrays, **more}, do_compression=compress)
        # The day of their making would make them differ.
        content = (DATA / name).read_bytes()
        (DATA / name).write_bytes(b"MATLAB 5.0 MAT-file".ljust(116) + content[116:])


def weighted(array):
    values = np.asarray(array, dtype=float).ravel()
    return float(np.sum((np.arange(values.size) + 1) * values))


def lines(name, key, value):
    if isinstance(value, np.ndarray) and value.dtype == object and value.shape == ():
        value = value.item()
    if isinstance(value, np.ndarray) and value.dtype == object and isinstance(value.ravel()[0], (int, str)):
        return
    if isinstance(value, dict):
        for inner, item in value.items():
            yield from lines(name, f"{key}.{inner}" if key else str(inner), item)
    elif isinstance(value, list) and value and isinstance(value[0], dict):
        for index, item in enumerate(value):
            yield from lines(name, f"{key}[{index}]", item)
    else:
        if isinstance(value, Select):
            value = value.a.x.ravel()[value.idxs].reshape(value.preferred_shape)
        value = getattr(value, "x", value)
        value = value.toarray() if sp.issparse(value) else value
        try:
            array = np.asarray(value, dtype=float)
        except (TypeError, ValueError):
            return
        if not isinstance(value, (str, bytes, bytearray, type(None), set)) and not (isinstance(value, np.ndarray) and value.dtype.kind in "US"):
            yield "\t".join([name, key, ",".join(map(str, array.shape)), repr(weighted(array))])


def loaded(path):
    content = path.read_bytes()
    if path.suffix == ".pt" and content[:2] == b"PK":
        with zipfile.ZipFile(path) as archive:
            name = next(n for n in archive.namelist() if n.endswith("data.pkl"))
            unpickler = TorchUnpickler(io.BytesIO(archive.read(name)))
            unpickler.fetch = lambda key: archive.read(name[:-8] + "data/" + key)
            return unpickler.load()
    if path.suffix == ".pt":
        return legacy_load(content)
    if path.suffix == ".mat":
        # What is passed over here is left out there too.
        return {key: value for key, value in loadmat(path).items() if key[0] != "_" and key not in ("struct", "cells", "complex", "sparse")}
    if path.suffix in (".npz", ".npy"):
        read = np.load(path, allow_pickle=True)
        return dict(read) if path.suffix == ".npz" else read
    if b"NumpyArrayWrapper" in content or content[:1] == b"\x78" or content[:2] == b"\x1f\x8b":
        return joblib.load(path)
    return pickle.loads(content, encoding="latin1")


def main():
    thing = many()
    for protocol in range(6):
        (DATA / f"many_p{protocol}.pkl").write_bytes(pickle.dumps(thing, protocol=protocol))
    joblib.dump(thing, DATA / "many.joblib")
    joblib.dump(thing, DATA / "many_zlib.joblib", compress=("zlib", 3))
    joblib.dump(thing, DATA / "many_gzip.joblib", compress=("gzip", 3))
    np.savez_compressed(DATA / "many.npz", **{key: value for key, value in thing.items() if isinstance(value, np.ndarray)})
    torch_files()
    mat_files(thing)
    with open(DATA / "expected.txt", "w") as expected:
        for path in sorted(DATA.iterdir()):
            if path.suffix != ".txt":
                expected.writelines(line + "\n" for line in lines(path.name, "", loaded(path)))


main()
