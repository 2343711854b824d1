#!/usr/bin/env python3
"""Times PyTorch on the network of benches/training.rs, which starts this script: bench_torch.py THREADS REPETITIONS

Prints a line of JSON: the least and the median milliseconds of a training step (forward, backward, Adam) and of inference.
Needs: torch, safetensors.
"""
import json
import statistics
import sys
import time

import torch

from torch_exchange import Network

SHAPE = {"inputs": 27, "channels": 64, "kernel": 5, "convolutions": 3, "hidden": 128, "layers": 2, "direction": "both", "outputs": 3}
BATCH, STEPS = 64, 128


def times(work, repetitions):
    work()
    taken = []
    for _ in range(repetitions):
        start = time.perf_counter()
        work()
        taken.append(1000 * (time.perf_counter() - start))
    return {"least": min(taken), "median": statistics.median(taken)}


def main():
    threads, repetitions = int(sys.argv[1]), int(sys.argv[2])
    torch.set_num_threads(threads)
    torch.manual_seed(1)
    shape = SHAPE | ({"direction": sys.argv[3]} if len(sys.argv) > 3 else {})
    network = Network(shape)
    adam = torch.optim.Adam(network.parameters(), lr=1e-3)
    input, target = torch.randn(BATCH, STEPS, shape["inputs"]), torch.randn(BATCH, STEPS, shape["outputs"])

    def train():
        adam.zero_grad()
        torch.nn.functional.mse_loss(network(input), target).backward()
        torch.nn.utils.clip_grad_norm_(network.parameters(), 1.0)
        adam.step()

    def infer(batch):
        with torch.no_grad():
            network(input[:batch])

    found = {"training": times(train, repetitions)}
    found |= {f"inference {batch}": times(lambda: infer(batch), repetitions) for batch in (1, 16, 64)}
    print(json.dumps(found | {"torch": torch.__version__}))


if __name__ == "__main__":
    main()
