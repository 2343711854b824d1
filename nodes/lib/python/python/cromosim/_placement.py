"""Where a sensor sits."""

from __future__ import annotations

import json
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, fields
from os import PathLike, fspath
from typing import Any

SCHEMA = "cromosim/placements/1"


@dataclass(frozen=True, kw_only=True)
class Placement:
    """A sensor on a body, with the fields of a placements file.

    Give one of `site`, `point`, and `triangle` with `barycentrics`.

    Parameters
    ----------
    site : str, optional
        One of the body's named sites (`Body.site_names`), such as ``"left_watch"``.
    point : sequence of 3 floats, optional
        The skin nearest to this point of the mean body in T-pose, m; x left, y up, z forward.
    triangle : int, optional
        Index into the body's faces.
    barycentrics : sequence of 3 floats, optional
        Weights of the triangle's corners, sum 1.
    mount : mapping, optional
        ``site_from_sensor`` as one of ``{"rotvec": [..3]}`` (rad), ``{"quaternion_xyzw": [..4]}`` and
        ``{"matrix": [[..3], ..3]}``. The site's z axis points out of the skin, x along the bone.
    skin_distance : float, optional
        Distance from the skin along its normal, m.
    follow : {"skin", "segment"}, optional
        Whether the sensor moves with the skin (default) or rigidly with the bone's segment.
    rate_hz : float, optional
        Samples per second, Hz; else `simulate`'s.
    scheme : str, optional
        Derivative scheme; else `simulate`'s, else ``"adaptive_spline"``.
    device : str, optional
        A device's name or file; else `simulate`'s.
    """

    site: str | None = None
    point: Sequence[float] | None = None
    triangle: int | None = None
    barycentrics: Sequence[float] | None = None
    mount: Mapping[str, Any] | None = None
    skin_distance: float | None = None
    follow: str | None = None
    rate_hz: float | None = None
    scheme: str | None = None
    device: str | None = None

    def _entry(self) -> dict[str, Any]:
        values = ((field.name, getattr(self, field.name)) for field in fields(self))
        return {name: plain(value) for name, value in values if value is not None}


def plain(value: Any) -> Any:
    """What JSON can hold of NumPy's scalars and arrays, paths, mappings and sequences."""
    if isinstance(value, PathLike):
        return fspath(value)
    if hasattr(value, "tolist"):
        return value.tolist()
    if isinstance(value, Mapping):
        return {key: plain(item) for key, item in value.items()}
    if isinstance(value, (list, tuple)):
        return [plain(item) for item in value]
    return value


def placements_text(
    placements: Mapping[str, Placement | Mapping[str, Any]], **defaults: Any
) -> str:
    """The text of a placements file: JSON, which is YAML."""
    entries = {
        name: placement._entry() if isinstance(placement, Placement) else plain(placement)
        for name, placement in placements.items()
    }
    given = {name: plain(value) for name, value in defaults.items() if value is not None}
    return json.dumps({"schema": SCHEMA, "defaults": given, "placements": entries})
