"""Motion files to Parquet on a Ray cluster: `python ray_simulate.py OUT MOTION...`

Each motion is a task of Ray Data, which runs it again elsewhere where a machine is lost, and writes the
rows of its blocks to OUT. Needs `ray[data]` and the package on every machine, and motions at the same
path on all. Locally it starts Ray by itself; RAY_ADDRESS names a cluster.
"""

import os
import sys
from pathlib import Path

import numpy as np
import pyarrow as pa
import ray

import cromosim

PLACEMENTS = {"left_wrist": cromosim.Placement(site="left_watch"), "sternum": cromosim.Placement(site="sternum")}
SEED = 0


def simulate(batch: dict[str, np.ndarray]) -> pa.Table:
    """One motion's readings, all placements one after the other, with the columns of `cromosim simulate`."""
    # A task has as many cores as Ray gave it, not all of its machine; what was set before, stays.
    os.environ.setdefault("RAYON_NUM_THREADS", os.environ.get("OMP_NUM_THREADS", "1"))
    (path,) = batch["path"]
    motion = cromosim.read_motion(str(path))
    imus = cromosim.simulate(motion, PLACEMENTS, rate_hz=60, device="consumer_mems", seed=SEED)
    parts = []
    for name, readings in imus.items():
        columns: dict[str, object] = {
            "recording": pa.repeat(Path(str(path)).stem, len(readings)),
            "placement": pa.repeat(name, len(readings)),
            "stamp_ns": readings.stamps_ns,
        }
        for quantity in ("specific_force", "angular_velocity"):
            values = getattr(readings, quantity).astype(np.float32)
            columns |= {f"{quantity}_{axis}": values[:, k] for k, axis in enumerate("xyz")}
        parts.append(pa.table(columns))
    return pa.concat_tables(parts)


def main(out: str, paths: list[str]) -> int:
    """Writes OUT/*.parquet; the number of rows."""
    motions = ray.data.from_items([{"path": str(Path(path).resolve())} for path in paths], override_num_blocks=len(paths))
    # A lost machine is no fault of a motion: it is simulated again.
    # Writing asks for the same, so that Ray makes one task of both and keeps no processor aside for writing.
    again = {"max_retries": -1}
    tables = motions.map_batches(simulate, batch_size=1, **again)
    tables.write_parquet(out, mode=ray.data.SaveMode.OVERWRITE, ray_remote_args=again)
    return ray.data.read_parquet(out).count()


if __name__ == "__main__":
    ray.init(logging_level="ERROR")
    print(f"{sys.argv[1]}: {main(sys.argv[1], sys.argv[2:])} rows")
