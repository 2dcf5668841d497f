"""Learned policies from their checkpoints."""

import functools

from uuv_marl.baselines.learned.actor import Actor, Recurrent
from uuv_marl.baselines.learned.checkpoint import Checkpoint, load_checkpoint
from uuv_marl.paths import UserPath
from uuv_marl.scenario import Scenario


class Trained:
    """A learned policy before it is made for a scenario: call it with a scenario.

    Args:
        name: of the policy in messages.
        path: of the checkpoint, as ``load_checkpoint`` takes it; read on first use.
        doc: the policy's docstring.
    """

    def __init__(self, name: str, path: UserPath, doc: str = "A network from a training.") -> None:
        self.name, self._path, self.__doc__ = name, path, doc

    @functools.cached_property
    def checkpoint(self) -> Checkpoint:
        """The content of the file. Raises PolicyError if it holds no policy."""
        return load_checkpoint(self._path)

    @property
    def channels(self) -> tuple[str, ...]:
        """Channels needed beyond the percept."""
        return self.checkpoint.card.channels

    @property
    def yaw_damping_nms(self) -> float:
        """Yaw damping of the training [N m s]."""
        return self.checkpoint.card.yaw_damping_nms

    @property
    def decision_period_s(self) -> float:
        """Period between decisions in the training [s]."""
        return self.checkpoint.card.decision_period_s

    @property
    def full_torque_nm(self) -> float:
        """Full torque of the training's vehicle [N m]."""
        return self.checkpoint.card.full_torque_nm

    def __call__(self, scenario: Scenario, num_worlds: int = 1, *, any_vehicle: bool = False) -> Actor:
        """The network for a scenario, without filter or law. Raises PolicyError as ``Actor`` does."""
        kind = Recurrent if self.checkpoint.card.network.memory else Actor
        return kind(scenario, num_worlds, name=self.name, checkpoint=self.checkpoint, any_vehicle=any_vehicle)


def shipped(name: str, doc: str) -> Trained:
    """The policy of a checkpoint in ``uuv_marl/baselines/weights``."""
    return Trained(name, name, doc)
