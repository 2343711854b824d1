"""Makes ../tests/data/posedirs_sample.npz from a body.npz of build.py and verify.py: the posedirs of every 40th vertex.

python make_posedirs_sample.py BODY.npz   (numpy). Holds: vertex_ids (K,), posedirs (K, 3, 207) m."""
import pathlib
import sys

import numpy as np

posedirs = np.load(sys.argv[1])["posedirs"]
vertex_ids = np.arange(0, len(posedirs), 40, dtype=np.uint32)
target = pathlib.Path(__file__).resolve().parent.parent / "tests/data/posedirs_sample.npz"
np.savez_compressed(target, vertex_ids=vertex_ids, posedirs=posedirs[vertex_ids])
print(target.name, target.stat().st_size, "bytes")
