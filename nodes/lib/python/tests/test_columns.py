"""The Parquet files of the command line, as pandas, polars and DuckDB read them."""

import numpy as np
import pytest

import cromosim
from cromosim import Placement

CHANNELS = [
    f"{quantity}_{axis}" for quantity in ("specific_force", "angular_velocity") for axis in "xyz"
]
PLACEMENTS = {"left_wrist": "left_watch", "ankle": "right_ankle_lateral"}


@pytest.fixture
def written(command_line, tmp_path):
    """walk.parquet, and what the package says of the same placements."""
    given = [f"--placement={name}={site}" for name, site in PLACEMENTS.items()]
    path = tmp_path / "walk.parquet"
    given += ["--seed", 3, "--device", "consumer_mems"]
    command_line("simulate", "--walk", *given, "--out", path)
    placements = {name: Placement(site=site) for name, site in PLACEMENTS.items()}
    return path, cromosim.simulate(cromosim.walk(), placements, device="consumer_mems", seed=3)


def assert_equal(readings, stamps, channels):
    assert (np.asarray(stamps) == readings.stamps_ns).all()
    values = np.hstack([readings.specific_force, readings.angular_velocity])
    assert np.asarray(channels, dtype=np.float32).tobytes() == values.astype(np.float32).tobytes()


def test_pandas_and_pyarrow_read_them(written):
    path, imus = written
    pandas, parquet = pytest.importorskip("pandas"), pytest.importorskip("pyarrow.parquet")
    table = pandas.read_parquet(path)
    assert isinstance(table["placement"].dtype, pandas.CategoricalDtype)
    assert list(table["recording"].unique()) == ["walk"]
    assert table["activity"].isna().all()
    for name, readings in imus.items():
        rows = table[table["placement"] == name]
        assert_equal(readings, rows["stamp_ns"], rows[CHANNELS])
    file = parquet.ParquetFile(path)
    assert file.num_row_groups == len(imus), "a group a placement"
    assert file.schema_arrow.field("specific_force_x").metadata[b"unit"] == b"m/s2"
    assert file.schema_arrow.field("angular_velocity_z").metadata[b"unit"] == b"rad/s"
    metadata = file.metadata.metadata
    assert metadata[b"seed"] == b"3"
    assert b"declared_noise" in metadata[b"device.consumer_mems"]


def test_polars_reads_them(written):
    path, imus = written
    polars = pytest.importorskip("polars")
    for name, readings in imus.items():
        rows = polars.scan_parquet(path).filter(polars.col("placement") == name).collect()
        assert_equal(readings, rows["stamp_ns"].to_numpy(), rows.select(CHANNELS).to_numpy())


def test_duckdb_reads_them(written):
    path, imus = written
    duckdb = pytest.importorskip("duckdb")
    for name, readings in imus.items():
        select = f"SELECT * FROM '{path}' WHERE placement = ? ORDER BY stamp_ns"
        rows = duckdb.execute(select, [name]).fetchnumpy()
        assert_equal(readings, rows["stamp_ns"], np.column_stack([rows[it] for it in CHANNELS]))
