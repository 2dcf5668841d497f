"""``SwarmTask``: the scenarios as BenchMARL tasks."""

from collections.abc import Callable
from typing import Any, cast

from uuv_marl.envs.core import make_batched_env, refuse_losses
from uuv_marl.extras import extra

with extra("benchmarl", "SwarmTask"):
    from benchmarl.environments import Task, TaskClass  # pyright: ignore[reportMissingImports]
    from torchrl.data import Composite
    from torchrl.envs import EnvBase

from uuv_marl.envs.torchrl import GROUP, SwarmEnv


class SwarmTaskClass(TaskClass):
    """Makes ``uuv_marl.envs.torchrl.SwarmEnv`` with the arguments in ``config``, such as ``for_policy``.

    A scenario in which a vehicle can be lost is an error: BenchMARL trains on the rows of all vehicles.
    """

    def get_env_fun(
        self,
        num_envs: int,
        continuous_actions: bool,  # noqa: ARG002 - BenchMARL's signature
        seed: int | None,
        device: Any,
    ) -> Callable[[], EnvBase]:
        """A function that makes the environment with ``num_envs`` worlds; world w starts from ``seed + w``."""
        refuse_losses(make_batched_env(**self._arguments).swarm.scenario, "BenchMARL")
        return lambda: SwarmEnv(num_envs, seed=seed, device=device, **self._arguments)

    @property
    def _arguments(self) -> dict[str, Any]:
        return {"scenario": self.name.lower(), **self.config}

    def supports_continuous_actions(self) -> bool:
        """True: forces are continuous."""
        return True

    def supports_discrete_actions(self) -> bool:
        """False: forces are continuous."""
        return False

    def max_steps(self, env: EnvBase) -> int:  # noqa: ARG002
        """Decisions of the longest episode."""
        return make_batched_env(**self._arguments).longest_episode

    def has_render(self, env: EnvBase) -> bool:  # noqa: ARG002
        """False: use ``uuv_marl.parallel_env`` for pictures."""
        return False

    def group_map(self, env: EnvBase) -> dict[str, list[str]]:
        """One group, ``uuv``."""
        return cast(dict[str, list[str]], env.group_map)

    def observation_spec(self, env: EnvBase) -> Composite:
        """``uuv``: ``observation``."""
        group = env.full_observation_spec_unbatched[GROUP]
        return Composite({GROUP: Composite({"observation": group["observation"].clone()}, shape=group.shape)})

    def info_spec(self, env: EnvBase) -> Composite | None:  # noqa: ARG002
        """None: no entries beyond rewards and endings."""
        return None

    def state_spec(self, env: EnvBase) -> Composite:
        """``state``, for centralised critics."""
        return Composite({"state": env.full_observation_spec_unbatched["state"].clone()})

    def action_spec(self, env: EnvBase) -> Composite:
        """``uuv``: ``action``."""
        return env.full_action_spec_unbatched

    def action_mask_spec(self, env: EnvBase) -> Composite | None:  # noqa: ARG002
        """None: every action is allowed."""
        return None

    @staticmethod
    def env_name() -> str:
        """Name of the environment in BenchMARL's reports."""
        return "uuv_marl"


class SwarmTask(Task):
    """The shipped scenarios in which no vehicle is lost: ``SwarmTask.RANDOM_FIELD.get_task()``.

    ``get_task(config={"num_vehicles": 10, "decision_period": 0.5})`` takes the arguments of ``parallel_env``.
    """

    STARTER = TRAINING_FIELD = TRACKING = SINGLE_OBSTACLE = MULTI_OBSTACLE = RANDOM_FIELD = None
    HARD_WATER_EASY = HARD_WATER = HARD_WATER_HARD = TWO_SWARMS_EASY = TWO_SWARMS = TWO_SWARMS_HARD = None
    SILENT_TARGETS_EASY = SILENT_TARGETS = SILENT_TARGETS_HARD = None
    FEW_INFORMED_EASY = FEW_INFORMED = FEW_INFORMED_HARD = None

    @staticmethod
    def associated_class() -> type[TaskClass]:
        """``SwarmTaskClass``."""
        return SwarmTaskClass

    def get_from_yaml(self, path: str | None = None) -> TaskClass:
        """The task with the arguments in a YAML file, by default none: BenchMARL has no file for it."""
        return self.get_task({}) if path is None else super().get_from_yaml(path)
