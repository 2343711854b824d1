"""Bodies."""

from __future__ import annotations

from collections.abc import Sequence
from os import PathLike
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from . import _native
from ._motion import Motion


class Body:
    """An SMPL body of one shape.

    Parameters
    ----------
    betas : sequence of float, optional
        Shape coefficients, standard deviations; default: the mean body.
    path : path, optional
        Body model (npz or pickle) rather than the embedded one.
    """

    def __init__(
        self, betas: Sequence[float] = (), path: str | PathLike[str] | None = None
    ) -> None:
        self._native = _native.Body([float(beta) for beta in betas], path)
        self._path = None if path is None else Path(path).absolute()

    def __reduce__(self) -> tuple[Any, ...]:
        """For other processes; they read a file anew."""
        return Body, (self.betas.tolist(), self._path)

    @property
    def id(self) -> str:
        """The model's identifier."""
        return self._native.id

    @property
    def betas(self) -> NDArray[np.float64]:
        """Shape coefficients, shape (B,)."""
        return self._native.betas

    @property
    def faces(self) -> NDArray[np.uint32]:
        """Corners of the triangles, shape (F, 3)."""
        return self._native.faces

    @property
    def site_names(self) -> list[str]:
        """What a Placement's `site` can be."""
        return self._native.site_names

    @property
    def rest_vertices(self) -> NDArray[np.float64]:
        """The skin in T-pose, shape (V, 3), m; x left, y up, z forward."""
        return self._native.rest_vertices

    def vertices(
        self, motion: Motion | ArrayLike, root_positions: ArrayLike | None = None
    ) -> NDArray[np.float32]:
        """The skin in the world, shape (N, V, 3), m.

        Parameters
        ----------
        motion : Motion or array_like, shape (N, 24, 3)
            A motion, or rotation vectors of the joints, rad.
        root_positions : array_like, shape (N, 3), optional
            Positions of the pelvis joint, m; with rotation vectors.
        """
        return self._native.vertices(poses(motion, root_positions))

    def joints(
        self, motion: Motion | ArrayLike, root_positions: ArrayLike | None = None
    ) -> NDArray[np.float64]:
        """The joints in the world, shape (N, 24, 3), m; parameters as of `vertices`."""
        return self._native.joints(poses(motion, root_positions))


def poses(motion: Motion | ArrayLike, root_positions: ArrayLike | None):
    """What the compiled half takes poses by."""
    if isinstance(motion, Motion):
        return motion._native
    if root_positions is None:
        raise _native.CromosimError("root_positions: needed beside rotation vectors")
    return tuple(np.asarray(array, dtype=np.float64) for array in (motion, root_positions))
