"""Devices and their effects."""

from __future__ import annotations

import json
from collections.abc import Iterable, Mapping
from os import PathLike, fspath
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from . import _native
from ._placement import plain
from ._readings import Readings, readings_of

SCHEMA = "cromosim/device/1"


class Device:
    """A sensor's white noise and further effects, with values as a data sheet has them.

    Parameters
    ----------
    effects : mapping or iterable of pairs, optional
        Parameters of each effect by its name, such as ``{"accel_bias": {"bias": [0.05, 0, 0.1]},
        "low_pass": {...}}``. `effects` lists names, parameters, units and bounds.
    accel_density : float, optional
        One-sided density of the accelerometer's white noise, (m/s2)/sqrt(Hz).
    gyro_density : float, optional
        One-sided density of the gyroscope's white noise, (rad/s)/sqrt(Hz).
    orientation_stddev : float, optional
        Standard deviation of the reported orientation about each axis, rad.

    Raises
    ------
    CromosimError
        For an effect or a value that does not exist.
    """

    def __init__(
        self,
        effects: Mapping[str, Mapping[str, Any]] | Iterable[tuple[str, Mapping[str, Any]]] = (),
        *,
        accel_density: float = 0.0,
        gyro_density: float = 0.0,
        orientation_stddev: float = 0.0,
    ) -> None:
        pairs = effects.items() if isinstance(effects, Mapping) else effects
        noise = {
            "accel_density": accel_density,
            "gyro_density": gyro_density,
            "orientation_stddev": orientation_stddev,
        }
        entries = [{"effect": name, **plain(parameters)} for name, parameters in pairs]
        self._text = json.dumps(
            {"schema": SCHEMA, "declared_noise": plain(noise), "effects": entries}
        )
        _native.check_device("device", self._text)

    def __repr__(self) -> str:
        return f"<Device {self._text}>"


def name_and_text(device: str | PathLike[str] | Device | None) -> tuple[str | None, str | None]:
    """What the compiled half takes a device by."""
    if isinstance(device, Device):
        return "device", device._text
    return (None if device is None else fspath(device)), None


def effects() -> list[dict[str, Any]]:
    """All effects that a device or a diagnosis can name.

    Returns
    -------
    list of dict
        For each its `name`, `summary`, `remedy`, `stage` (in the order of a measurement: reference,
        segment, tissue, sensor, timing, linear, digital; a device has none of the first) and
        `parameters`: `name`, `unit`, `shape`, `neutral`, `lower`, `upper`, `is_optional`.
    """
    return json.loads(_native.effects())


def apply_device(
    device: str | PathLike[str] | Device | None,
    stamps_s: ArrayLike,
    specific_force: ArrayLike,
    angular_velocity: ArrayLike,
    *,
    orientation: ArrayLike | None = None,
    rate_hz: float | None = None,
    seed: int = 0,
    noise: bool = True,
    name: str = "imu",
    mapping: str | PathLike[str] | None = None,
) -> Readings:
    """Add a real device's effects and noise to the readings of an ideal IMU, from whatever simulator.

    Parameters
    ----------
    device : str, path or Device
        ``"consumer_mems"``, ``"precision_mems"``, a YAML file, or a Device.
    stamps_s : array_like, shape (N,)
        When the ideal IMU reads; they increase, s.
    specific_force : array_like, shape (N, 3)
        Acceleration minus gravity in the sensor's axes, as an accelerometer has it, m/s2. A simulator
        that gives accelerations without gravity needs it subtracted first.
    angular_velocity : array_like, shape (N, 3)
        In the sensor's axes, rad/s.
    orientation : array_like, shape (N, 4), optional
        world_from_sensor, quaternions x, y, z, w, world z up. Only the effect ``gravity_convention``
        needs it; the readings then have an orientation too.
    rate_hz : float, optional
        Samples per second, which the noise of a sample depends on, Hz; else the stamps' mean rate.
    seed : int, optional
        Seed of noise and losses.
    noise : bool, optional
        Whether the random part is there; biases and all other effects stay.
    name : str, optional
        Which IMU of several: each name draws its own noise.
    mapping : path, optional
        A distribution mapping that ``cromosim map`` wrote, applied last if it knows the name.

    Returns
    -------
    Readings
        By the device's own clock; fewer than N where it loses samples. Effects see the samples as
        they come, as on a live sensor.

    Notes
    -----
    Angular acceleration, which ``lever_arm`` and ``soft_tissue`` need, is the difference of the
    angular velocities. What changes nothing changes at most the last bits of the specific force.
    """
    floats = [
        np.asarray(array, dtype=np.float64) for array in (stamps_s, specific_force, angular_velocity)
    ]
    turned = None if orientation is None else np.asarray(orientation, dtype=np.float64)
    arrays = _native.apply_device(
        *name_and_text(device),
        *floats,
        turned,
        rate_hz=rate_hz,
        seed=seed,
        noise=noise,
        name=name,
        mapping=None if mapping is None else fspath(mapping),
    )
    return readings_of(name, arrays)
