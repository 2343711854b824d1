"""Motions."""

from __future__ import annotations

import json
from collections.abc import Sequence
from os import PathLike, fspath
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from . import _native
from ._placement import plain


class Motion:
    """A person's motion: poses of SMPL's 24 joints at a constant rate, in a world with z up.

    Parameters
    ----------
    rotations : array_like, shape (N, 24, 3)
        Rotation vectors of the joints against their parents, rad; the first is world_from_pelvis.
    root_positions : array_like, shape (N, 3)
        Positions of the pelvis joint in the world, m.
    rate_hz : float
        Frames per second, Hz.
    betas : sequence of float, optional
        Shape coefficients of the body, standard deviations; default: the mean body.
    body : path, optional
        Body model (npz or pickle) rather than the embedded one.
    name : str, optional
        What errors call it.

    See Also
    --------
    read_motion : from a file.
    """

    def __init__(
        self,
        rotations: ArrayLike,
        root_positions: ArrayLike,
        rate_hz: float,
        betas: Sequence[float] = (),
        body: str | PathLike[str] | None = None,
        name: str = "motion",
    ) -> None:
        self._native = _native.Motion(
            np.asarray(rotations, dtype=np.float64),
            np.asarray(root_positions, dtype=np.float64),
            float(rate_hz),
            [float(beta) for beta in betas],
            body,
            name,
        )

    @classmethod
    def _of(cls, native: _native.Motion) -> Motion:
        motion = cls.__new__(cls)
        motion._native = native
        return motion

    @classmethod
    def _of_state(cls, *state: Any) -> Motion:
        return cls._of(_native.Motion.of_state(*state))

    def __reduce__(self) -> tuple[Any, ...]:
        """For other processes, with the values to the last bit; they read a file of `body` anew."""
        return Motion._of_state, self._native.state()

    @property
    def name(self) -> str:
        """The file's name, or what was given."""
        return self._native.name

    @property
    def rate_hz(self) -> float:
        """Frames per second, Hz."""
        return self._native.rate_hz

    @property
    def duration_s(self) -> float:
        """Time from the first to the last frame, s."""
        return self._native.duration_s

    @property
    def betas(self) -> NDArray[np.float64]:
        """Shape coefficients, shape (B,), standard deviations."""
        return self._native.betas

    @property
    def rotations(self) -> NDArray[np.float64]:
        """Rotation vectors of the joints, shape (N, 24, 3), rad."""
        return self._native.rotations

    @property
    def root_positions(self) -> NDArray[np.float64]:
        """Positions of the pelvis joint in the world, shape (N, 3), m."""
        return self._native.root_positions

    @property
    def confidence(self) -> NDArray[np.float64] | None:
        """How sure the source is of each frame, shape (N,), from 0 to 1; None where it does not say."""
        return self._native.confidence

    @property
    def how_read(self) -> str | None:
        """How the source was understood, in a line."""
        return self._native.how_read

    @property
    def oddities(self) -> list[str]:
        """What is unlikely of the motion, a line each."""
        return self._native.oddities

    def __len__(self) -> int:
        return len(self._native)

    def __repr__(self) -> str:
        return f"<Motion {self.name!r}: {len(self)} frames at {self.rate_hz:g} Hz>"


def read_motion(
    path: str | PathLike[str], *, body: str | PathLike[str] | None = None, **options: Any
) -> Motion:
    """Read a motion file: BVH, ASF/AMC, MVNX, C3D, TRC, or SMPL parameters as AMASS and video estimators write.

    What the file is, is told by its content.

    Parameters
    ----------
    path : path
        The file.
    body : path, optional
        Body model (npz or pickle) rather than the embedded one.
    **options
        As the command line's: `start_s`, `duration_s` (s), `person`, `rate_hz`, `unit_scale_m`,
        `skeleton_map`, `skeleton`, `marker_set`, `subject`, `keep_lead_in`, `source_body` and others.
        With `start_s` or `duration_s` the whole motion is kept, since the derivatives at the ends of
        a part need what lies beside it; `simulate` plays the part.

    Returns
    -------
    Motion

    Raises
    ------
    CromosimError
        One line that names the file and the place in it.
    """
    return Motion._of(_native.read_motion(fspath(path), body, json.dumps(plain(options))))


def walk() -> Motion:
    """The embedded ten-second walk."""
    return Motion._of(_native.walk())
