"""Virtual IMUs from body motion, device effects, and the diagnosis of the sim-to-real gap.

>>> import cromosim
>>> motion = cromosim.walk()
>>> imus = cromosim.simulate(motion, {"left_wrist": cromosim.Placement(site="left_watch")})
>>> imus["left_wrist"].specific_force.shape
(995, 3)

Everything is in SI units; the world is z up, with gravity (0, 0, -9.80665) m/s2. An IMU reads
specific force (acceleration minus gravity: +g upwards at rest) and angular velocity in its own axes.
Quaternions are x, y, z, w. Errors are `CromosimError`, a `ValueError` of one line.
"""

from ._native import CromosimError, __version__
from ._body import Body
from ._device import Device, apply_device, effects
from ._diagnosis import Cause, Diagnosis, PlacementDiagnosis, Recording, diagnose, read_recording
from ._motion import Motion, read_motion, walk
from ._placement import Placement
from ._readings import Poses, Readings
from ._rigid import StreamingImu, simulate_rigid
from ._simulate import simulate

__all__ = [
    "Body",
    "Cause",
    "CromosimError",
    "Device",
    "Diagnosis",
    "Motion",
    "Placement",
    "PlacementDiagnosis",
    "Poses",
    "Readings",
    "Recording",
    "StreamingImu",
    "__version__",
    "apply_device",
    "diagnose",
    "effects",
    "read_motion",
    "read_recording",
    "simulate",
    "simulate_rigid",
    "walk",
]
