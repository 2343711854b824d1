"""CPU time of IMUSim for the IMUs of a BVH, s: `python peer_imusim.py MINUTE.bvh JOINT...`

For the Python of an environment of its own, with the fork of IMUSim that runs on Python 3
(github.com/hyeokhyen/imusim_py3: Python 3.9, numpy < 1.24, scipy < 1.11, cython < 3, setuptools < 58,
simpy < 3, its readme's steps; an empty module `mayavi` does). Prints what
IMUSim's splines through the motion took, the simulation after them, and the whole process; ideal
sensors, 100 Hz.
"""

import resource
import sys

from imusim.behaviours.imu import BasicIMUBehaviour
from imusim.io.bvh import loadBVHFile
from imusim.platforms.imus import IdealIMU
from imusim.simulation.base import Simulation
from imusim.trajectories.rigid_body import SplinedBodyModel


def cpu() -> float:
    used = resource.getrusage(resource.RUSAGE_SELF)
    return used.ru_utime + used.ru_stime


def main() -> None:
    path, joints = sys.argv[1], sys.argv[2:]
    read = loadBVHFile(path)
    before = cpu()
    model = SplinedBodyModel(read)
    splines = cpu() - before
    simulation = Simulation()
    simulation.time = model.startTime
    imus = []
    for joint in joints:
        imu = IdealIMU(simulation=simulation, trajectory=model.getJoint(joint))
        BasicIMUBehaviour(imu, 1 / 100)
        imus.append(imu)
    before = cpu()
    simulation.run(model.endTime, printProgress=False)
    alone = cpu() - before
    counts = [imu.accelerometer.rawMeasurements.timestamps.size for imu in imus]
    assert min(counts) > 5900, counts
    print(f"{splines:.2f} {alone:.2f} {cpu():.2f}")


if __name__ == "__main__":
    main()
