"""What IMUs read."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

if TYPE_CHECKING:
    import pandas
    import pyarrow

AXES = ("x", "y", "z")


@dataclass(frozen=True, eq=False)
class Poses:
    """Poses of a sensor in the world."""

    stamps_ns: NDArray[np.int64]
    """Stamps, shape (M,), ns."""
    positions: NDArray[np.float64]
    """Positions in the world, shape (M, 3), m."""
    orientations: NDArray[np.float64]
    """world_from_sensor, shape (M, 4), quaternions x, y, z, w."""

    @property
    def stamps_s(self) -> NDArray[np.float64]:
        """Stamps, shape (M,), s."""
        return self.stamps_ns * 1e-9

    def __len__(self) -> int:
        return len(self.stamps_ns)


@dataclass(frozen=True, eq=False)
class Readings:
    """A series of one IMU's readings, in the sensor's axes."""

    name: str
    """The placement's name."""
    stamps_ns: NDArray[np.int64]
    """Stamps, shape (N,), ns. The first frame of a simulated motion is at 1 s."""
    specific_force: NDArray[np.float64]
    """Acceleration minus gravity, shape (N, 3), m/s2."""
    angular_velocity: NDArray[np.float64]
    """Shape (N, 3), rad/s."""
    specific_force_covariance: NDArray[np.float64] | None = None
    """Rows of the 3x3 covariances, shape (N, 9), (m/s2)^2."""
    angular_velocity_covariance: NDArray[np.float64] | None = None
    """Rows of the 3x3 covariances, shape (N, 9), (rad/s)^2."""
    orientation: NDArray[np.float64] | None = None
    """world_from_sensor, shape (N, 4), quaternions x, y, z, w; None where it is not known."""
    magnetic_field: NDArray[np.float64] | None = None
    """Shape (N, 3), T; None without a magnetometer or a known field."""
    reference: Poses | None = None
    """The sensor's true poses at the motion's frames."""
    bandwidth_hz: float | None = None
    """Up to which frequency the acceleration resolves the motion, median, Hz."""
    trimmed_s: tuple[float, float] = (0.0, 0.0)
    """What was left out at the beginning and the end, s."""

    @property
    def stamps_s(self) -> NDArray[np.float64]:
        """Stamps, shape (N,), s."""
        return self.stamps_ns * 1e-9

    def __len__(self) -> int:
        return len(self.stamps_ns)

    def columns(self) -> dict[str, NDArray[Any]]:
        """Columns by name: `stamp_ns`, `specific_force_x` ... `angular_velocity_z`, and the
        orientation's and the magnetometer's where they are known. They are views."""
        columns: dict[str, NDArray[Any]] = {"stamp_ns": self.stamps_ns}
        for quantity in ("specific_force", "angular_velocity"):
            values = getattr(self, quantity)
            columns |= {f"{quantity}_{axis}": values[:, k] for k, axis in enumerate(AXES)}
        if self.orientation is not None:
            columns |= {
                f"orientation_{part}": self.orientation[:, k] for k, part in enumerate("xyzw")
            }
        if self.magnetic_field is not None:
            columns |= {f"magnetic_field_{axis}": self.magnetic_field[:, k] for k, axis in enumerate(AXES)}
        return columns

    def to_pandas(self) -> pandas.DataFrame:
        """The columns as a DataFrame; needs pandas."""
        import pandas

        return pandas.DataFrame(self.columns())

    def to_arrow(self) -> pyarrow.Table:
        """The columns as a Table; needs pyarrow."""
        import pyarrow

        columns = {name: np.ascontiguousarray(values) for name, values in self.columns().items()}
        return pyarrow.table(columns)


def readings_of(name: str, arrays: dict[str, Any]) -> Readings:
    """Readings of what the compiled half hands over."""
    reference = arrays.pop("reference", None)
    if reference is not None:
        arrays["reference"] = Poses(**reference)
    if "trimmed_s" in arrays:
        arrays["trimmed_s"] = tuple(arrays["trimmed_s"])
    return Readings(name=name, **arrays)
