"""CPU time of WIMUSim's forward pass for 60 s of the walk and five IMUs, s: `python peer_wimusim.py MINUTE.npz`

For the Python of an environment of its own, with github.com/STRCWearlab/WIMUSim on its path (torch, scipy, matplotlib, pybullet,
wandb, and of pytorch3d the folder transforms; empty modules do for pybullet and wandb). Prints the forward pass alone (the median of five,
`simulate("generate")` on tensors that are there), the first one, and the whole process; poses as they are at 100 Hz, noise drawn.
"""

import resource
import statistics
import sys

import numpy as np
import torch
from scipy.spatial.transform import Rotation
from wimusim import WIMUSim

# Chains of WIMUSim's names, each with the joint of SMPL that turns it.
CHAIN = {
    ("BASE", "PELVIS"): 3,
    ("PELVIS", "L_CLAVICLE"): 13,
    ("L_CLAVICLE", "L_SHOULDER"): 16,
    ("L_SHOULDER", "L_ELBOW"): 18,
    ("PELVIS", "R_CLAVICLE"): 14,
    ("R_CLAVICLE", "R_SHOULDER"): 17,
    ("R_SHOULDER", "R_ELBOW"): 19,
    ("BASE", "L_HIP"): 1,
    ("L_HIP", "L_KNEE"): 4,
    ("BASE", "R_HIP"): 2,
    ("R_HIP", "R_KNEE"): 5,
}
IMUS = {"L_ELBOW": "left_wrist", "R_ELBOW": "right_wrist", "PELVIS": "sternum", "L_KNEE": "left_shin", "R_KNEE": "right_shin"}


def cpu() -> float:
    used = resource.getrusage(resource.RUSAGE_SELF)
    return used.ru_utime + used.ru_stime


def tensor(values) -> torch.Tensor:
    return torch.tensor(np.asarray(values), dtype=torch.float32)


def main() -> None:
    motion = np.load(sys.argv[1])
    rotations = Rotation.from_rotvec(motion["poses"].reshape(-1, 3)).as_quat()[:, [3, 0, 1, 2]]
    rotations = rotations.reshape(len(motion["poses"]), 24, 4)
    orientation = {"BASE": tensor(rotations[:, 0])} | {pair[1]: tensor(rotations[:, joint]) for pair, joint in CHAIN.items()}
    none, small = {name: np.zeros(3) for name in IMUS.values()}, {name: np.full(3, 0.01) for name in IMUS.values()}
    simulator = WIMUSim(
        B=WIMUSim.Body(rp={pair: tensor([0.0, 0.2, 0.0]) for pair in CHAIN}),
        D=WIMUSim.Dynamics(orientation=orientation, translation={"XYZ": tensor(motion["trans"])}, sample_rate=100.0, device="cpu"),
        P=WIMUSim.Placement(
            rp={(joint, name): tensor([0.0, 0.1, 0.0]) for joint, name in IMUS.items()},
            ro={(joint, name): tensor([0.0, 0.0, 0.0]) for joint, name in IMUS.items()},
        ),
        H=WIMUSim.Hardware(ba=none, bg=none, sa=small, sg=small, requires_grad=False),
        device="cpu",
    )
    turns = []
    with torch.no_grad():
        for _ in range(6):
            before = cpu()
            readings = simulator.simulate("generate")
            turns.append(cpu() - before)
    assert set(readings) == set(IMUS.values())
    assert all(part.shape == (len(rotations), 3) and torch.isfinite(part).all() for pair in readings.values() for part in pair)
    print(f"{statistics.median(turns[1:]):.4f} {turns[0]:.4f} {cpu():.2f}")


if __name__ == "__main__":
    main()
