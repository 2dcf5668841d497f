"""``Trained``: learned policies from their checkpoints."""

import functools

from uuv_marl.baselines.learned.actor import Actor
from uuv_marl.baselines.learned.checkpoint import Checkpoint, load_checkpoint
from uuv_marl.baselines.requirements import PolicyRequirements
from uuv_marl.paths import UserPath
from uuv_marl.scenario import Scenario


class Trained:
    """Type of a learned policy: call it with a scenario, as a subclass of ``Policy``.

    ``path`` is a checkpoint's path, or the name of one that ships (``load_checkpoint``), read on first use.
    """

    def __init__(self, name: str, path: UserPath, doc: str = "A network from a training.") -> None:
        self.name, self._path, self.__doc__ = name, path, doc

    @functools.cached_property
    def checkpoint(self) -> Checkpoint:
        """The content of the file. Raises PolicyError if it is not a checkpoint."""
        return load_checkpoint(self._path)

    @property
    def requirements(self) -> PolicyRequirements:
        """Channels, inner loop and decision period of the training."""
        return self.checkpoint.card.requirements

    def __call__(self, scenario: Scenario, num_worlds: int = 1, *, any_vehicle: bool = False) -> Actor:
        """The network for a scenario, without safety filter or base controller. Raises PolicyError as ``Actor``."""
        return Actor(scenario, num_worlds, name=self.name, checkpoint=self.checkpoint, any_vehicle=any_vehicle)
