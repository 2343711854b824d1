#!/usr/bin/env python3
"""Networks to and from PyTorch, to show that both compute the same.

    torch_exchange.py golden DIR               writes the golden files of tests/data: weights, and what PyTorch makes of them
    torch_exchange.py compare WEIGHTS PASSES   reads weights and passes that Rust wrote, prints the greatest difference, fails above 1e-5

A weights file is safetensors with the tensors of the modules `conv`, `lstm` and `linear`, and in its metadata under `cromosim` the network's
shape. A passes file holds `input`, `output` and, for the golden ones, `target`, `weight`, `loss`, `gradient.NAME` of every tensor, and
`trained.NAME` after ADAM_STEPS steps of Adam on that one batch; a classifier's `target` holds classes, and `weight` one number a window.
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


class DeepConvLSTM(torch.nn.Module):
    """Ordonez and Roggen 2016; without dropout, which draws differently in each implementation."""

    def __init__(self, shape):
        super().__init__()
        self.inputs, self.maps = shape["inputs"], shape["maps"]
        sizes = [1] + [self.maps] * shape["convolutions"]
        self.conv = torch.nn.ModuleList(torch.nn.Conv1d(a, b, shape["kernel"]) for a, b in zip(sizes, sizes[1:]))
        self.lstm = torch.nn.LSTM(self.inputs * self.maps, shape["hidden"], shape["layers"], batch_first=True)
        self.linear = torch.nn.Linear(shape["hidden"], shape["classes"])

    def forward(self, x):
        """(batch, steps, inputs) -> (batch, classes)"""
        batch = len(x)
        x = x.transpose(1, 2).reshape(batch * self.inputs, 1, -1)
        for conv in self.conv:
            x = torch.relu(conv(x))
        x = x.reshape(batch, self.inputs * self.maps, -1).transpose(1, 2)
        return self.linear(self.lstm(x)[0][:, -1])


def network_of(shape):
    return DeepConvLSTM(shape) if "classes" in shape else Network(shape)


def cross_entropy(output, target, weight):
    losses = torch.nn.functional.cross_entropy(output, target.long(), reduction="none")
    return (losses * weight).sum() / weight.sum()


def masked_huber(output, target, weight):
    losses = torch.nn.functional.huber_loss(output, target, reduction="none", delta=HUBER_DELTA).mean(-1)
    return (losses * weight).sum() / weight.sum()


def passes(network, loss_of, input, target, weight):
    """What the golden test compares: output, loss, gradients, weights after a few steps of Adam."""
    output = network(input)
    loss = loss_of(output, target, weight)
    loss.backward()
    found = {"input": input, "target": target, "weight": weight, "output": output, "loss": loss}
    found |= {f"gradient.{name}": tensor.grad.clone() for name, tensor in network.named_parameters()}
    adam = torch.optim.Adam(network.parameters(), lr=LEARNING_RATE)
    for _ in range(ADAM_STEPS):
        adam.zero_grad()
        loss_of(network(input), target, weight).backward()
        adam.step()
    found |= {f"trained.{name}": tensor for name, tensor in network.named_parameters()}
    return {name: tensor.detach().contiguous() for name, tensor in found.items()}


def write_weights(shape, path):
    """A network with PyTorch's own initial weights, which are in the file."""
    network = network_of(shape)
    weights = {name: tensor.detach().clone() for name, tensor in network.named_parameters()}
    note = {"shape": shape, "notes": {"made_by": "scripts/torch_exchange.py golden"}}
    save_file(weights, path, {"cromosim": json.dumps(note)})
    return network


def golden(folder):
    for direction, kernel in (("both", 5), ("forward", 4)):
        torch.manual_seed(1)
        shape = {"inputs": 4, "channels": 5, "kernel": kernel, "convolutions": 2, "hidden": 6, "layers": 2, "direction": direction, "outputs": 3}
        network = write_weights(shape, folder / f"torch_{direction}.safetensors")
        input, target, weight = torch.randn(3, 11, 4), torch.randn(3, 11, 3), torch.rand(3, 11)
        weight[:, ::4] = 0
        save_file(passes(network, masked_huber, input, target, weight), folder / f"torch_{direction}_passes.safetensors")
    torch.manual_seed(2)
    shape = {"inputs": 4, "maps": 5, "kernel": 3, "convolutions": 3, "hidden": 6, "layers": 2, "classes": 3}
    network = write_weights(shape, folder / "torch_classifier.safetensors")
    input, target, weight = torch.randn(5, 11, 4), torch.tensor([0.0, 2, 1, 2, 0]), torch.rand(5)
    save_file(passes(network, cross_entropy, input, target, weight), folder / "torch_classifier_passes.safetensors")


def compare(weights, passes):
    with safe_open(weights, "pt") as file:
        shape = json.loads(file.metadata()["cromosim"])["shape"]
        network = network_of(shape)
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
