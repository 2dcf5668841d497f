"""``Squashed``: a policy whose layers end in tanh, as those of SAC do, from a file of its weights."""

from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np
import safetensors.numpy

from uuv_marl.baselines import Policy
from uuv_marl.baselines.requirements import PolicyRequirements
from uuv_marl.errors import PolicyError
from uuv_marl.paths import user_path
from uuv_marl.percept import Percept
from uuv_marl.scenario import Scenario
from uuv_marl.sim.observation import observation_layout, observer
from uuv_marl.types import Float32


def squashed(path: Path, channels: Sequence[str]) -> str:
    """Name of the policy with the weights of a file, which was trained with these channels."""
    return f"{__name__}:Squashed,path={path.resolve()}" + "".join(f",{channel}=true" for channel in channels)


class Squashed(Policy):
    """Layers of tanh units; the first half of the last one's outputs, through tanh, is the action.

    Args:
        path: of the weights ``0.weight`` (in, out), ``0.bias`` and so on.
        identity: whether they read this channel, too.
    """

    requirements = PolicyRequirements(
        yaw_damping_nms=600.0, decision_period_s=0.5, outputs_force=True, channels_if={"identity": ("identity",)}
    )

    def __init__(
        self,
        scenario: Scenario,
        num_worlds: int = 1,
        *,
        path: str,
        identity: bool = False,  # noqa: ARG002
    ) -> None:
        super().__init__(scenario, num_worlds)
        self._tensors: dict[str, Any] = safetensors.numpy.load(user_path(path).read_bytes())
        self._seeing = observation_layout(scenario, "closeness")
        if len(self._tensors["0.weight"]) != self._seeing.size:
            raise PolicyError(f"{path} reads {len(self._tensors['0.weight'])} entries, got {self._seeing.size}")

    def decide(self, percept: Percept) -> Float32:
        """Actions of shape (world, vehicle, 2)."""
        x, fill = observer(percept, self._seeing)
        fill(0, len(x))
        for k in range(len(self._tensors) // 2):
            x = np.tanh(x) if k else x
            x = x @ self._tensors[f"{k}.weight"] + self._tensors[f"{k}.bias"]
        return np.tanh(x[..., :2]).astype(np.float32)
