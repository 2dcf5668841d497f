"""The networks of ``uuv_marl.baselines.learned.layers`` in torch, trained through time. Needs ``train``."""

import math
from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from uuv_marl.baselines.learned.layers import Architecture, Network, Sizes, shapes
from uuv_marl.extras import extra

with extra("train", "training"):
    import torch
    from torch import Tensor, nn


class TorchOps:
    """Operations of ``layers.Network`` on tensors."""

    tanh, sigmoid, relu = staticmethod(torch.tanh), staticmethod(torch.sigmoid), staticmethod(torch.relu)
    shaped = staticmethod(torch.reshape)

    @staticmethod
    def dense(x: Tensor, weight: Tensor, bias: Tensor | None = None) -> Tensor:
        """A layer without its activation: (row, out) for (row, in)."""
        return x @ weight if bias is None else torch.addmm(bias, x, weight)

    @staticmethod
    def take(x: Tensor, columns: NDArray[np.int64]) -> Tensor:
        """Selected columns (row, column)."""
        return x.index_select(1, torch.from_numpy(columns))

    @staticmethod
    def joined(parts: Sequence[Tensor]) -> Tensor:
        """Concatenation of the columns."""
        return torch.cat(list(parts), 1)

    @staticmethod
    def parts(x: Tensor) -> tuple[Tensor, ...]:
        """Thirds of the columns."""
        return x.chunk(3, 1)

    @staticmethod
    def total(x: Tensor) -> Tensor:
        """Sum over the middle axis."""
        return x.sum(1)


class TorchActor:
    """The policy's network with its recurrent state."""

    def __init__(self, architecture: Architecture, sizes: Sizes, rng: np.random.Generator, outputs: int = 2) -> None:
        last = f"{len(architecture.hidden)}.weight"
        self.tensors = {
            name: started(shape, rng, 0.01 if name == last else 1.0 if name.startswith("gru") else math.sqrt(2.0))
            for name, shape in shapes(architecture, sizes, outputs).items()
        }
        if architecture.memory:  # each gate separately
            own = self.tensors["gru.state_weight"]
            gates = [started((len(own), len(own)), rng, 1.0) for _ in range(3)]
            self.tensors["gru.state_weight"] = torch.cat(gates, 1).detach().requires_grad_()
        self.units = architecture.hidden[-1] if architecture.memory else 0
        self.network = Network(architecture, sizes, self.tensors, TorchOps)

    def act(self, x: Tensor, state: Tensor) -> tuple[Tensor, Tensor]:
        """Actions (row, 2) and the next state (row, unit), from observations (row, entry) and the state."""
        z = self.network.features(x)
        if not self.units:
            return self.network.output(z), state
        state = self.network.step(self.network.gates(z), state)
        return self.network.output(z, state), state

    def through(self, x: Tensor, state: Tensor, continues: Tensor) -> tuple[Tensor, Tensor]:
        """``act`` over a horizon: actions (time x row, 2), and the states after each decision (time x row, unit)."""
        flat = x.reshape(-1, x.shape[2])
        z = self.network.features(flat)
        if not self.units:
            return self.network.output(z), z[:, :0]
        states: list[Tensor] = []
        for gates, carried in zip(self.network.gates(z).split(x.shape[1]), continues[:, :, None], strict=True):
            state = self.network.step(gates, state * carried)
            states.append(state)
        after = torch.cat(states)
        return self.network.output(z, after), after


def started(shape: tuple[int, ...], rng: np.random.Generator, gain: float) -> Tensor:
    """An initial orthogonal weight or zero bias, without torch's global random generator."""
    tensor = torch.zeros(shape)
    if len(shape) > 1:
        generator = torch.Generator().manual_seed(int(rng.integers(2**62)))
        nn.init.orthogonal_(tensor, gain, generator=generator)
    return tensor.requires_grad_()
