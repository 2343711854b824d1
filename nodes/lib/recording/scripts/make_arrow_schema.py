#!/usr/bin/env python3
"""Writes src/columns/arrow_schema.txt: the columns' Arrow schema as readers look for it in Parquet's
metadata (`ARROW:schema`), which alone can hold units of fields and say that texts are categories.

    python3 nodes/lib/recording/scripts/make_arrow_schema.py        # needs pyarrow
"""

import base64
from pathlib import Path

import pyarrow as pa

TEXT = pa.dictionary(pa.int32(), pa.string())
UNITS = {"specific_force": "m/s2", "angular_velocity": "rad/s"}


def schema() -> pa.Schema:
    fields = [pa.field(name, TEXT, nullable=False) for name in ("recording", "person", "placement")]
    fields.append(pa.field("draw", pa.int32(), nullable=False))
    fields.append(pa.field("stamp_ns", pa.int64(), nullable=False, metadata={"unit": "ns"}))
    for quantity, unit in UNITS.items():
        for axis in "xyz":
            metadata = {"unit": unit, "axes": "sensor"}
            fields.append(pa.field(f"{quantity}_{axis}", pa.float32(), nullable=False, metadata=metadata))
    fields.append(pa.field("activity", TEXT, nullable=True))
    return pa.schema(fields)


if __name__ == "__main__":
    place = Path(__file__).parent.parent / "src/columns/arrow_schema.txt"
    place.write_bytes(base64.b64encode(schema().serialize().to_pybytes()))
