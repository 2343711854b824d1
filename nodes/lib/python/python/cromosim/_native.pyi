from collections.abc import Sequence
from os import PathLike
from typing import Any

import numpy as np
from numpy.typing import NDArray

__version__: str

class CromosimError(ValueError): ...

class Motion:
    def __init__(
        self,
        rotations: NDArray[np.float64],
        root_positions: NDArray[np.float64],
        rate_hz: float,
        betas: list[float],
        body: str | PathLike[str] | None,
        name: str,
    ) -> None: ...
    name: str
    rate_hz: float
    duration_s: float
    betas: NDArray[np.float64]
    rotations: NDArray[np.float64]
    root_positions: NDArray[np.float64]
    confidence: NDArray[np.float64] | None
    how_read: str | None
    oddities: list[str]
    def __len__(self) -> int: ...
    def state(self) -> tuple[Any, ...]: ...
    @staticmethod
    def of_state(
        description: str,
        betas: NDArray[np.float64],
        root_positions: NDArray[np.float64],
        quaternions: NDArray[np.float64],
        confidence: NDArray[np.float64] | None,
    ) -> Motion: ...

def read_motion(path: str, body: str | PathLike[str] | None, options: str) -> Motion: ...
def walk() -> Motion: ...

_Poses = Motion | tuple[NDArray[np.float64], ...]

class Body:
    def __init__(self, betas: list[float], path: str | PathLike[str] | None) -> None: ...
    id: str
    betas: NDArray[np.float64]
    faces: NDArray[np.uint32]
    site_names: list[str]
    rest_vertices: NDArray[np.float64]
    def vertices(self, poses: _Poses) -> NDArray[np.float32]: ...
    def joints(self, poses: _Poses) -> NDArray[np.float64]: ...

def simulate(
    motion: Motion,
    placements: str,
    folder: str,
    device: tuple[list[str], str] | None,
    options: str,
) -> dict[str, dict[str, Any]]: ...
def simulate_rigid(
    name: str,
    stamps_s: NDArray[np.float64],
    positions: NDArray[np.float64],
    orientations: NDArray[np.float64],
    rate_hz: float,
    device_name: str | None,
    device_text: str | None,
    options: str,
) -> dict[str, Any]: ...

class Stream:
    def __init__(
        self,
        name: str,
        input_rate_hz: float,
        rate_hz: float,
        scheme: str | None,
        device_name: str | None,
        device_text: str | None,
        seed: int,
        noise: bool,
    ) -> None: ...
    delay_s: float
    def push(
        self, stamp_s: float, position: Sequence[float], orientation: Sequence[float]
    ) -> dict[str, Any]: ...
    def finish(self) -> dict[str, Any]: ...

def check_device(name: str | None, text: str | None) -> None: ...
def effects() -> str: ...
def apply_device(
    device_name: str | None,
    device_text: str | None,
    stamps_s: NDArray[np.float64],
    specific_force: NDArray[np.float64],
    angular_velocity: NDArray[np.float64],
    orientation: NDArray[np.float64] | None,
    *,
    rate_hz: float | None,
    seed: int,
    noise: bool,
    name: str,
    mapping: str | None,
) -> dict[str, Any]: ...

class Record:
    def __init__(
        self,
        name: str,
        pose_stamps_s: NDArray[np.float64],
        positions: NDArray[np.float64],
        orientations: NDArray[np.float64],
        stamps_s: NDArray[np.float64],
        specific_force: NDArray[np.float64],
        angular_velocity: NDArray[np.float64],
        noise: tuple[float | None, float | None],
    ) -> None: ...
    name: str

def read_records(path: str, body: str | PathLike[str] | None) -> list[Record]: ...
def diagnose(
    records: list[Record], without: list[str], seed: int, title: str
) -> tuple[str, str, str]: ...
