"""A torch Dataset whose sensors are worn, and err, differently in each epoch.

    dataset = DrawnWindows(["walk.bvh"])
    for epoch in range(100):
        dataset.draw(epoch)
        for windows in torch.utils.data.DataLoader(dataset, batch_size=64, shuffle=True):
            ...
"""

import sys

import numpy as np
import torch

import cromosim

SITES = ("left_watch", "right_watch")


class DrawnWindows(torch.utils.data.Dataset):
    """Windows (6, `window`) of one watch for each motion: specific force, angular velocity."""

    def __init__(self, files, rate_hz=50.0, window=100, seed=0):
        self.motions = [cromosim.read_motion(file) for file in files]
        self.rate_hz, self.window, self.seed = rate_hz, window, seed
        self.draw(0)

    def draw(self, epoch: int) -> None:
        """Draws site, wearing and device of each motion; the same epoch draws the same."""
        self.windows = []
        for number, motion in enumerate(self.motions):
            draws = np.random.default_rng((self.seed, epoch, number))
            watch = cromosim.Placement(
                site=str(draws.choice(SITES)),
                mount={"rotvec": draws.normal(scale=0.1, size=3)},
                skin_distance=draws.uniform(0, 0.01),
            )
            device = cromosim.Device(
                {
                    "accel_bias": {"bias": draws.normal(scale=0.1, size=3)},
                    "gyro_bias": {"bias": draws.normal(scale=0.01, size=3)},
                },
                accel_density=draws.uniform(0.001, 0.003),
                gyro_density=draws.uniform(0.0001, 0.0003),
            )
            imu = cromosim.simulate(
                motion,
                {"watch": watch},
                rate_hz=self.rate_hz,
                device=device,
                seed=int(draws.integers(2**32)),
            )["watch"]
            both = np.concatenate([imu.specific_force, imu.angular_velocity], axis=1)
            count = len(both) // self.window
            cut = both[: count * self.window].reshape(count, self.window, 6)
            self.windows += list(np.ascontiguousarray(cut.transpose(0, 2, 1), dtype=np.float32))

    def __len__(self) -> int:
        return len(self.windows)

    def __getitem__(self, index: int) -> torch.Tensor:
        return torch.from_numpy(self.windows[index])


if __name__ == "__main__":
    dataset = DrawnWindows(sys.argv[1:])
    for windows in torch.utils.data.DataLoader(dataset, batch_size=4):
        print(tuple(windows.shape), windows.std(dim=(0, 2)).numpy().round(2))
