"""Why real and simulated IMUs differ."""

from __future__ import annotations

import json
from collections.abc import Sequence
from dataclasses import dataclass
from os import PathLike, fspath
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from . import _native
from ._readings import Poses, Readings

if TYPE_CHECKING:
    import pandas

FILES = ("diagnosis.json", "effects.yaml", "report.html")


class Recording:
    """One placement's reference poses and what its real IMU read.

    Parameters
    ----------
    reference : Poses
        Where the sensor (or the segment that it is worn on) was, by motion capture.
    readings : Readings
        What the IMU read, in its own units.
    noise : tuple of 2 floats or None, optional
        Declared standard deviations of the white noise per sample, m/s2 and rad/s; None where the
        data sheet does not say.
    """

    def __init__(
        self,
        reference: Poses,
        readings: Readings,
        noise: tuple[float | None, float | None] = (None, None),
    ) -> None:
        arrays = (
            reference.stamps_s,
            reference.positions,
            reference.orientations,
            readings.stamps_s,
            readings.specific_force,
            readings.angular_velocity,
        )
        floats = (np.asarray(array, dtype=np.float64) for array in arrays)
        self._native = _native.Record(readings.name, *floats, noise)

    @property
    def name(self) -> str:
        """The placement's name."""
        return self._native.name


def read_recording(
    path: str | PathLike[str], *, body: str | PathLike[str] | None = None
) -> list[Recording]:
    """Read the placements of a bag that have both a reference and a real IMU.

    Parameters
    ----------
    path : path
        An MCAP file or a rosbag2 folder with ``/reference/NAME`` and ``/imu/NAME/data_raw``.
    body : path, optional
        Body model of a recording of SMPL states, rather than the embedded one.
    """
    recordings = []
    for native in _native.read_records(fspath(path), body):
        recording = Recording.__new__(Recording)
        recording._native = native
        recordings.append(recording)
    return recordings


@dataclass(frozen=True)
class Cause:
    """An effect that separates the real IMU from its simulation."""

    effect: str
    """Its name; ``unknown`` for what no effect explains."""
    probability: float
    """That it is there."""
    gap_share: float
    """Of the gap, 0 to 1."""
    parameters: dict[str, Any]
    """Values by name, in the units of `effects`."""
    standard_errors: dict[str, Any]
    """Of the parameters."""


@dataclass(frozen=True)
class PlacementDiagnosis:
    """What was found at one placement."""

    name: str
    """The placement's name."""
    verdict: str
    """In a sentence."""
    causes: tuple[Cause, ...]
    """By their share."""
    document: dict[str, Any]
    """All of it, as diagnosis.json has it: gap, location, calibration, unidentifiable, unexplained."""

    @property
    def rmse_before(self) -> tuple[float, float]:
        """Gap of the nominal simulation, m/s2 and rad/s."""
        before = self.document["gap"]["before"]
        return before["accel_rmse"], before["gyro_rmse"]

    @property
    def rmse_after(self) -> tuple[float, float]:
        """Gap of the simulation with the causes, m/s2 and rad/s."""
        after = self.document["gap"]["after"]
        return after["accel_rmse"], after["gyro_rmse"]


@dataclass(frozen=True)
class Diagnosis:
    """Placements with their causes, and the files that ``cromosim diagnose`` writes."""

    placements: dict[str, PlacementDiagnosis]
    """By name."""
    json: str
    """The text of diagnosis.json."""
    effects_yaml: str
    """The text of effects.yaml, for ``cromosim simulate --effects``."""
    report_html: str
    """The page."""

    def rows(self) -> list[dict[str, Any]]:
        """A row for each placement's cause."""
        return [
            {
                "placement": name,
                "effect": cause.effect,
                "probability": cause.probability,
                "gap_share": cause.gap_share,
                "parameters": cause.parameters,
                "standard_errors": cause.standard_errors,
            }
            for name, placement in self.placements.items()
            for cause in placement.causes
        ]

    def to_pandas(self) -> pandas.DataFrame:
        """The rows as a DataFrame; needs pandas."""
        import pandas

        return pandas.DataFrame(self.rows())

    def write(self, folder: str | PathLike[str]) -> None:
        """Write diagnosis.json, effects.yaml and report.html into a folder, which is made.

        Raises
        ------
        FileExistsError
            Where one of them exists already; nothing is written then.
        """
        folder = Path(folder)
        for name in FILES:
            if (folder / name).exists():
                raise FileExistsError(f"{folder / name}: exists already; give another folder")
        folder.mkdir(parents=True, exist_ok=True)
        texts = (self.json, self.effects_yaml, self.report_html)
        for name, text in zip(FILES, texts, strict=True):
            (folder / name).write_text(text, encoding="utf-8")


def diagnose(
    recordings: Recording | Sequence[Recording],
    *,
    without: Sequence[str] = (),
    seed: int = 0,
    title: str = "Gap diagnosis",
) -> Diagnosis:
    """Say which effects separate real IMUs from their simulation, as ``cromosim diagnose`` does.

    Parameters
    ----------
    recordings : Recording or sequence of Recording
        One for each placement, of different names.
    without : sequence of str, optional
        Effects taken out of the library.
    seed : int, optional
        Seed of the noise in comparisons with the noisy simulation.
    title : str, optional
        Of the report.

    Returns
    -------
    Diagnosis
    """
    recordings = [recordings] if isinstance(recordings, Recording) else list(recordings)
    names = [recording.name for recording in recordings]
    if len(set(names)) < len(names) or not names:
        raise _native.CromosimError(
            f"recordings: expected one or more of different names, found {names}"
        )
    natives = [recording._native for recording in recordings]
    text, effects, page = _native.diagnose(natives, list(without), seed, title)
    found = {
        name: PlacementDiagnosis(
            name, document["verdict"], tuple(map(cause, document["causes"])), document
        )
        for name, document in json.loads(text)["placements"].items()
    }
    return Diagnosis(found, text, effects, page)


def cause(document: dict[str, Any]) -> Cause:
    """A cause of diagnosis.json."""
    return Cause(**{name: document[name] for name in Cause.__dataclass_fields__})
