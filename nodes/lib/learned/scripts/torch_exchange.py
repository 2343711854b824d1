#!/usr/bin/env python3
"""Networks to and from PyTorch, to show that both compute the same.

    torch_exchange.py golden DIR               writes the golden files of tests/data: weights, and what PyTorch makes of them
    torch_exchange.py compare WEIGHTS PASSES   reads weights and passes that Rust wrote, prints the greatest difference, fails above 1e-5

A weights file is safetensors with the tensors of the modules `conv`, `lstm` and `linear`, and in its metadata under `cromosim` the network's
shape. A passes file holds `input`, `output` and, for the golden ones, `target`, `weight`, `loss`, `gradient.NAME` of every tensor, and
`trained.NAME` after ADAM_STEPS steps of Adam on that one batch.
Needs: torch, safetensors.
"""
import json
import sys
from pathlib import Path

import torch
from safetensors import safe_open
from safetensors.torch import save_file

ADAM_STEPS = 5
LEARNING_RATE = 1e-2
HUBER_DELTA = 0.5
TOLERANCE = 1e-5


class Network(torch.nn.Module):
    def __init__(self, shape):
        super().__init__()
        self.kernel, self.causal = shape["kernel"], shape["direction"] == "forward"
        sizes = [shape["inputs"]] + [shape["channels"]] * shape["convolutions"]
        self.conv = torch.nn.ModuleList(torch.nn.Conv1d(a, b, self.kernel) for a, b in zip(sizes, sizes[1:]))
        self.lstm = torch.nn.LSTM(sizes[-1], shape["hidden"], shape["layers"], batch_first=True, bidirectional=not self.causal)
        self.linear = torch.nn.Linear(shape["hidden"] * (1 if self.causal else 2), shape["outputs"])

    def forward(self, x):
        """(batch, steps, inputs) -> (batch, steps, outputs)"""
        x = x.transpose(1, 2)
        before = self.kernel - 1 if self.causal else (self.kernel - 1) // 2
        for conv in self.conv:
            x = torch.relu(conv(torch.nn.functional.pad(x, (before, self.kernel - 1 - before))))
        return self.linear(self.lstm(x.transpose(1, 2))[0])


def masked_huber(output, target, weight):
    losses = torch.nn.functional.huber_loss(output, target, reduction="none", delta=HUBER_DELTA).mean(-1)
    return (losses * weight).sum() / weight.sum()


def passes(network, input, target, weight):
    """What the golden test compares: output, loss, gradients, weights after a few steps of Adam."""
    output = network(input)
    loss = masked_huber(output, target, weight)
    loss.backward()
    found = {"input": input, "target": target, "weight": weight, "output": output, "loss": loss}
    found |= {f"gradient.{name}": tensor.grad.clone() for name, tensor in network.named_parameters()}
    adam = torch.optim.Adam(network.parameters(), lr=LEARNING_RATE)
    for _ in range(ADAM_STEPS):
        adam.zero_grad()
        masked_huber(network(input), target, weight).backward()
        adam.step()
    found |= {f"trained.{name}": tensor for name, tensor in network.named_parameters()}
    return {name: tensor.detach().contiguous() for name, tensor in found.items()}


def golden(folder):
    for direction, kernel in (("both", 5), ("forward", 4)):
        torch.manual_seed(1)
        shape = {"inputs": 4, "channels": 5, "kernel": kernel, "convolutions": 2, "hidden": 6, "layers": 2, "direction": direction, "outputs": 3}
        network = Network(shape)
        weights = {name: tensor.detach().clone() for name, tensor in network.named_parameters()}
        note = {"shape": shape, "notes": {"made_by": "scripts/torch_exchange.py golden"}}
        save_file(weights, folder / f"torch_{direction}.safetensors", {"cromosim": json.dumps(note)})
        input, target, weight = torch.randn(3, 11, 4), torch.randn(3, 11, 3), torch.rand(3, 11)
        weight[:, ::4] = 0
        save_file(passes(network, input, target, weight), folder / f"torch_{direction}_passes.safetensors")


def compare(weights, passes):
    with safe_open(weights, "pt") as file:
        shape = json.loads(file.metadata()["cromosim"])["shape"]
        network = Network(shape)
        network.load_state_dict({name: file.get_tensor(name) for name in file.keys()}, strict=True)
    with safe_open(passes, "pt") as file, torch.no_grad():
        difference = (network(file.get_tensor("input")) - file.get_tensor("output")).abs().max().item()
    print(json.dumps({"greatest_difference": difference, "torch": torch.__version__}))
    return difference <= TOLERANCE


if __name__ == "__main__":
    if len(sys.argv) == 3 and sys.argv[1] == "golden":
        golden(Path(sys.argv[2]))
    elif len(sys.argv) == 4 and sys.argv[1] == "compare":
        sys.exit(not compare(sys.argv[2], sys.argv[3]))
    else:
        sys.exit(__doc__)
