"""IMUs on rigid bodies: robots, props, or a sensor whose poses are known."""

from __future__ import annotations

from os import PathLike

import numpy as np
from numpy.typing import ArrayLike

from . import _native
from ._device import Device, name_and_text
from ._readings import Readings, readings_of
from ._simulate import options_text


def simulate_rigid(
    stamps_s: ArrayLike,
    positions: ArrayLike,
    orientations: ArrayLike,
    *,
    rate_hz: float,
    name: str = "body",
    device: str | PathLike[str] | Device | None = None,
    seed: int = 0,
    noise: bool = True,
    scheme: str | None = None,
    bandwidth_hz: float | None = None,
    trim_s: float | None = None,
    texture: str | None = None,
    learned: str | PathLike[str] | None = None,
    mapping: str | PathLike[str] | None = None,
) -> Readings:
    """Simulate the IMU of a rigid body along a trajectory, as ``cromosim simulate --rigid`` does.

    Parameters
    ----------
    stamps_s : array_like, shape (N,)
        When the poses are, s; they increase and may be uneven.
    positions : array_like, shape (N, 3)
        Of the sensor in the world, m; z up.
    orientations : array_like, shape (N, 4)
        world_from_sensor, quaternions x, y, z, w.
    rate_hz : float
        Samples per second, Hz.
    name : str, optional
        The IMU's name, on which its noise depends.
    device, seed, noise, scheme, bandwidth_hz, trim_s, texture, learned, mapping
        As of `simulate`; ``texture="own"`` counts as held.

    Returns
    -------
    Readings
        Without orientation.
    """
    options = options_text(
        seed=seed,
        noise=noise,
        scheme=scheme,
        bandwidth_hz=bandwidth_hz,
        trim_s=trim_s,
        texture=texture,
        learned=learned,
        mapping=mapping,
    )
    poses = (np.asarray(array, dtype=np.float64) for array in (stamps_s, positions, orientations))
    arrays = _native.simulate_rigid(
        name, *poses, float(rate_hz), *name_and_text(device), options
    )
    return readings_of(name, arrays)


class StreamingImu:
    """A live IMU: one pose a call goes in, readings come out after a constant delay.

    Parameters
    ----------
    input_rate_hz : float
        Nominal rate of the poses, Hz; it sets the delay.
    rate_hz : float
        Samples per second, Hz, on a grid that starts at the first pose.
    name : str, optional
        The IMU's name, on which its noise depends.
    scheme : str, optional
        Derivative scheme, default ``"adaptive_spline"``.
    device, seed, noise
        As of `simulate`.
    """

    def __init__(
        self,
        input_rate_hz: float,
        rate_hz: float,
        *,
        name: str = "body",
        scheme: str | None = None,
        device: str | PathLike[str] | Device | None = None,
        seed: int = 0,
        noise: bool = True,
    ) -> None:
        self.name = name
        self._native = _native.Stream(
            name, float(input_rate_hz), float(rate_hz), scheme, *name_and_text(device), seed, noise
        )

    @property
    def delay_s(self) -> float:
        """Time between a sample's stamp and the pose that releases it, s."""
        return self._native.delay_s

    def push(self, stamp_s: float, position: ArrayLike, orientation: ArrayLike) -> Readings:
        """Take a pose; return the readings that it releases, often none.

        Parameters
        ----------
        stamp_s : float
            Later than the one before, s. A pause of more than 0.5 s begins a new series.
        position : array_like, shape (3,)
            Of the sensor in the world, m; z up.
        orientation : array_like, shape (4,)
            world_from_sensor, quaternion x, y, z, w.
        """
        arrays = self._native.push(
            float(stamp_s), [float(x) for x in position], [float(x) for x in orientation]
        )
        return readings_of(self.name, arrays)

    def finish(self) -> Readings:
        """End the series: the readings up to the last pose."""
        return readings_of(self.name, self._native.finish())
