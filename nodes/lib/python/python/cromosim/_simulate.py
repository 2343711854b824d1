"""Simulation of whole motions."""

from __future__ import annotations

import json
from collections.abc import Mapping, Sequence
from os import PathLike
from typing import Any

from . import _native
from ._device import Device
from ._motion import Motion
from ._placement import Placement, placements_text, plain
from ._readings import Readings, readings_of


def simulate(
    motion: Motion,
    placements: Mapping[str, Placement | Mapping[str, Any]],
    *,
    rate_hz: float | None = 100.0,
    device: str | PathLike[str] | Device | None = None,
    seed: int = 0,
    noise: bool = True,
    scheme: str | None = None,
    bandwidth_hz: float | None = None,
    trim_s: float | None = None,
    texture: str | None = None,
    pose_error_correlation_s: float = 0.0,
    learned: str | PathLike[str] | None = None,
    mapping: str | PathLike[str] | None = None,
    magnetic_field: str | PathLike[str] | Sequence[float] | None = None,
    orientation: str = "truth",
) -> dict[str, Readings]:
    """Simulate what IMUs on a moving person read, exactly as ``cromosim simulate`` does.

    The interpreter's lock is released meanwhile and all cores are used; the same arguments give the
    same bytes at any number of threads.

    Parameters
    ----------
    motion : Motion
        What the person does.
    placements : mapping of str to Placement
        The sensors by name; entries may also be mappings with a Placement's fields.
    rate_hz : float, optional
        Samples per second of the placements that name none, Hz.
    device : str, path or Device, optional
        Device of the placements that name none: ``"ideal"``, ``"consumer_mems"``,
        ``"precision_mems"`` or a YAML file; None: without error.
    seed : int, optional
        Seed of everything random.
    noise : bool, optional
        Whether the random part of the errors is there.
    scheme : str, optional
        Derivative scheme of all placements; else their own, else ``"adaptive_spline"``.
    bandwidth_hz : float, optional
        Pass what is below this frequency in place of a scheme, Hz.
    trim_s : float, optional
        What is left out at either end, s; None: as much as is far more uncertain than the middle.
    texture : str, optional
        Draw what real IMUs show above what the poses resolve: ``"own"`` by each placement's segment,
        or foot, shank, thigh, trunk, head, arm or held.
    pose_error_correlation_s : float, optional
        How long errors of the poses hold, for the covariances that follow from the confidence, s.
    learned : str or path, optional
        Networks that correct the kinematics: a shipped model's name or a trained folder.
    mapping : path, optional
        A distribution mapping that ``cromosim map`` wrote.
    magnetic_field : sequence of float, str or path, optional
        What devices with a magnetometer read: the field in world axes, T; a place and a day
        (``"52.52N,13.41E,2026-11-24"``) or a YAML file. None: no ``magnetic_field``.
    orientation : str, optional
        ``"truth"``; ``"vqf"``, ``"madgwick"`` or ``"mahony"``, fused from the device's own readings;
        ``"none"``.

    Returns
    -------
    dict of str to Readings

    Raises
    ------
    CromosimError
        One line that names the placement and the field, or what else cannot be.
    """
    own = device if isinstance(device, Device) else None
    text = placements_text(placements, rate_hz=rate_hz, device=None if own else device)
    given = None if own is None else (names_without_device(placements), own._text)
    options = options_text(
        scheme=scheme,
        bandwidth_hz=bandwidth_hz,
        trim_s=trim_s,
        texture=texture,
        seed=seed,
        noise=noise,
        pose_error_correlation_s=pose_error_correlation_s,
        learned=learned,
        mapping=mapping,
        magnetic_field=field_text(magnetic_field),
        orientation=orientation,
    )
    imus = _native.simulate(motion._native, text, ".", given, options)
    return {name: readings_of(name, arrays) for name, arrays in imus.items()}


def field_text(field: str | PathLike[str] | Sequence[float] | None) -> str | None:
    """As the command line takes it."""
    if field is None or isinstance(field, (str, PathLike)):
        return None if field is None else str(field)
    return ",".join(repr(float(value)) for value in field)


def names_without_device(placements: Mapping[str, Placement | Mapping[str, Any]]) -> list[str]:
    """Of the placements that name none of their own."""

    def named(placement: Placement | Mapping[str, Any]) -> Any:
        own = isinstance(placement, Placement)
        return placement.device if own else placement.get("device")

    return [name for name, placement in placements.items() if named(placement) is None]


def options_text(**options: Any) -> str:
    """What the compiled half takes options by; those that are None are left out."""
    return json.dumps({name: plain(value) for name, value in options.items() if value is not None})
