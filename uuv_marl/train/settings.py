"""What a training is trained on, and how: its settings, which ``config.json`` and the card of its policy repeat."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Literal, cast

from uuv_marl.baselines.learned.checkpoint import PERIODS_S
from uuv_marl.baselines.safety.barrier import Barrier
from uuv_marl.baselines.scout.gains import ScoutGains
from uuv_marl.baselines.scout.trims import ALL_TRIMS, Trim
from uuv_marl.envs.reward import RewardFunction
from uuv_marl.errors import RewardError, ScenarioError
from uuv_marl.modules import named_object
from uuv_marl.scenario import Scenario, load_scenario
from uuv_marl.train.acting import ACTING, Sees
from uuv_marl.train.group import Conditions
from uuv_marl.train.mappo import Hyperparameters
from uuv_marl.train.shaping import OVERRIDES, Weights, in_si_units

if TYPE_CHECKING:
    from uuv_marl.train import ppo

Sizes = tuple[tuple[int, int], ...]

MIXED: Sizes = ((10, 20), (25, 9), (54, 5), (100, 3))
"""Vehicles and worlds of each swarm: about as many vehicles of each size."""
MIXED_VALIDATION: Sizes = ((10, 4), (54, 8), (100, 2))
"""Vehicles and episodes of each size."""


def swarms_of(sizes: Sequence[int]) -> Sizes:
    """Swarms of these sizes: about as many vehicles of each, and in all as many as ``MIXED`` has."""
    share = sum(n * worlds for n, worlds in MIXED) / len(sizes)
    return tuple((n, max(1, round(share / n))) for n in sizes)


def _usual_size() -> int:
    return load_scenario(Settings.scenario).swarm.num_vehicles


@dataclass(frozen=True, kw_only=True)
class Settings:
    """What is trained, and how."""

    scenario: str = "random_field"
    """Name or TOML file."""
    overrides: Mapping[str, object] = field(default_factory=lambda: dict(OVERRIDES))
    """Fields of the scenario that differ from its file."""
    sizes: Sizes = ()
    """Vehicles and worlds of each swarm. If empty: 10 to 100 vehicles at once (``MIXED``), or only swarms of the
    scenario's own size where ``overrides`` name it, or it is another than the shipped ones'."""
    steps: int = 30_000_000
    """Agent-steps: one is one decision of one vehicle. Annealing ends here."""
    seed: int = 0
    start: str | None = None
    """A folder with a learner to start from: ``best`` or a checkpoint of another training."""
    weights: Weights = field(default_factory=Weights)
    """Weights of the training's reward."""
    reward: str | None = None
    """A reward of one's own in its place, ``module:function``: from the swarm after a decision to an array (world,
    vehicle)."""
    sees: Sees = "percept"
    """What the actor sees: features of one percept, its output being a force; or ``memory``, what is remembered, its
    output trimming the gains of ``law``, inside the safety filter."""
    change_cost: float = 0.0
    """With memory: paid for each 0.5 s in which the filter changed a vehicle's action."""
    chosen: Literal["best", "last"] = "best"
    """Which policy ``best`` holds: that of the best validation, or the last one."""
    law: ScoutGains = field(default_factory=ScoutGains)
    """With memory: of the hand-made law that the actor trims."""
    safety: Barrier = field(default_factory=Barrier)
    """With memory: margins and rates of the safety filter; with a horizon of 0 m it changes nothing."""
    trims: tuple[Trim] = ALL_TRIMS
    """With memory: what the actor changes."""
    held_s: float = 0.0
    """An output of the actor is held for so long, rounded to whole decisions; 0: for one decision."""
    conditions: Conditions = ()
    """Fields of the scenario for one episode: every world goes through these, an episode each, in this order."""
    algorithm: "Hyperparameters | ppo.Hyperparameters" = field(default_factory=Hyperparameters)
    checkpoint_every: int = 20
    """Iterations."""
    validate_every: int = 20
    """Iterations; a multiple of ``checkpoint_every`` wastes least where a training is cut off."""
    validation: Sizes = ()
    """Vehicles and episodes of each size. If empty: those of ``MIXED_VALIDATION``, or four of each size trained on."""
    validation_conditions: Conditions = ()
    """Fields of the scenario of further validation episodes."""

    def __post_init__(self) -> None:
        scenario = self.load()
        self._check_periods(scenario)
        n = scenario.swarm.num_vehicles
        usual = "swarm.num_vehicles" not in self.overrides and n == _usual_size()
        sizes = self.sizes or (MIXED if usual else swarms_of([n]))
        validation = self.validation or (MIXED_VALIDATION if sizes == MIXED else tuple((n, 4) for n, _ in sizes))
        first = self.algorithm.first_outputs if isinstance(self.algorithm, Hyperparameters) else ()
        outputs = ACTING[self.sees].num_outputs(self.trims)
        if len(first) not in (0, outputs):
            raise ValueError(f"first_outputs must have a number for each of {outputs} outputs, got {len(first)}")
        object.__setattr__(self, "sizes", sizes)
        object.__setattr__(self, "validation", validation)

    def _check_periods(self, scenario: Scenario) -> None:
        """Raise ScenarioError where a policy would be trained or validated at a period that it can't be run with."""
        field, validated = "timing.decision_period_s", self.load_for_validation()
        drawn = [float(str(c[field])) for c in (*self.conditions, *self.validation_conditions) if field in c]
        of = f"{field} of scenario {scenario.name!r}"
        periods = [(scenario.timing.decision_period_s, of), *((period, f"{field} of an episode") for period in drawn)]
        periods.append((validated.timing.decision_period_s, f"{of}, with which policies are validated,"))
        for period, what in periods:
            if not PERIODS_S[0] - 1e-9 <= period <= PERIODS_S[1] + 1e-9:
                raise ScenarioError(
                    f"{what} is {period:g}, but trained policies decide every {PERIODS_S[0]:g} to {PERIODS_S[1]:g} s; "
                    "choose a period in this range"
                )

    def paid(self) -> RewardFunction:
        """What vehicles are paid for a decision. Raises RewardError where it can't be imported."""
        if self.reward is None:
            return self.weights
        try:
            function = named_object(self.reward)
        except ImportError as error:
            raise RewardError(f"reward {self.reward!r} {error}; give module:function") from None
        if not callable(function):
            raise RewardError(f"reward {self.reward!r} must be a function of the swarm, got {function!r}")
        return cast(RewardFunction, function)

    def load(self) -> Scenario:
        """The scenario that is trained on."""
        return in_si_units(load_scenario(self.scenario, overrides=self.overrides))

    def load_for_validation(self) -> Scenario:
        """The scenario that is validated on: that of the training, but with the benchmark's decision period."""
        kept = {name: value for name, value in self.overrides.items() if name != "timing.decision_period_s"}
        return load_scenario(self.scenario, overrides=kept)
