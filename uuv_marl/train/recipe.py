"""Recipes: files that say all of a training, so that one command gives a policy's like again."""

import tomllib
from collections.abc import Iterator, Mapping, Sequence
from importlib import resources
from typing import Any, Literal, get_args

import numpy as np
import pydantic

from uuv_marl.baselines.safety.barrier import Barrier
from uuv_marl.baselines.scout.gains import ScoutGains
from uuv_marl.baselines.scout.trims import ALL_TRIMS, Trim
from uuv_marl.errors import ResultsError
from uuv_marl.paths import user_path
from uuv_marl.scenario import load_scenario
from uuv_marl.studies.robustness.axes import AXES, known
from uuv_marl.train import ppo
from uuv_marl.train.acting import Sees
from uuv_marl.train.group import Conditions
from uuv_marl.train.mappo import Hyperparameters
from uuv_marl.train.settings import Settings
from uuv_marl.train.shaping import Weights, overrides_for

Algorithm = Literal["mappo", "ppo"]
_VALIDATION_DRAW = 2**31
"""Seed of what is drawn for validation."""


class Episodes(pydantic.BaseModel, frozen=True, extra="forbid"):
    """What differs from one episode to the next: echoes, decision period, disturbance."""

    changes: dict[str, Any] = {}
    """Fields of the scenario that all have, but validation has not."""
    calm: float = pydantic.Field(1.0, ge=0.0, le=1.0)
    """Share of episodes without a disturbance."""
    surface: float = pydantic.Field(0.0, ge=0.0, le=1.0)
    """Share of episodes in which echoes report surfaces instead of centres."""
    periods_s: tuple[float, ...] = (0.1,)
    """Decision periods, as often as they are to come."""
    axes: tuple[str, ...] = ()
    """Disturbances: axes of the robustness suite. Its groups come equally often."""
    levels: tuple[int, ...] = (1, 2, 3, 4, 5)
    """Levels of these axes."""
    at_once: int = pydantic.Field(1, ge=1)
    """Number of disturbances in a disturbed episode, each of another group."""
    number: int = pydantic.Field(1, ge=1)
    """Number of different episodes that are drawn; then they come again."""
    validated: int = pydantic.Field(0, ge=0)
    """Number of other episodes that are drawn for validation, the same for every seed of a training."""

    @pydantic.model_validator(mode="after")
    def _levels_there(self) -> "Episodes":
        for axis in known(self.axes):
            if not {*AXES[axis].levels} & {*self.levels}:
                raise ValueError(f"axis {axis} has the levels {[*AXES[axis].levels]}; add one of them to levels")
        return self

    def draw(self, scenario: str, seed: int) -> Conditions:
        """Fields of the scenario for each of ``number`` episodes."""
        return tuple(self._drawn(scenario, self.number, self.changes, seed))

    def draw_validated(self, scenario: str) -> Conditions:
        """Fields of the scenario for each of ``validated`` episodes of validation, without ``changes``."""
        return tuple(self._drawn(scenario, self.validated, {}, _VALIDATION_DRAW))

    def _drawn(self, scenario: str, number: int, base: dict[str, Any], seed: int) -> Iterator[Mapping[str, object]]:
        rng = np.random.default_rng(seed)
        speed = load_scenario(scenario).trajectory.speed_mps
        groups: dict[str, list[str]] = {}
        for axis in known(self.axes):
            groups.setdefault(AXES[axis].group, []).append(axis)
        for _ in range(number):
            echo, disturbed = rng.random(2) < (self.surface, 1.0 - self.calm)
            changes = {**base, "timing.decision_period_s": float(rng.choice(self.periods_s))}
            if echo:
                changes["sonar.echo_reports"] = "surface"
            left = dict(groups) if disturbed else {}
            for _ in range(min(self.at_once, len(left))):
                axis = AXES[str(rng.choice(left.pop(str(rng.choice(list(left))))))]
                changes |= axis.overrides(int(rng.choice([k for k in axis.levels if k in self.levels])), speed)
            yield changes


class Recipe(pydantic.BaseModel, frozen=True, extra="forbid"):
    """A file's content; what it leaves out is as in ``Settings``."""

    title: str
    scenario: str = "random_field"
    overrides: dict[str, Any] = {}
    sees: Sees = "percept"
    sizes: tuple[tuple[int, int], ...] = ()
    validation: tuple[tuple[int, int], ...] = ()
    steps: int = pydantic.Field(Settings.steps, ge=1)
    held_s: float = pydantic.Field(0.0, ge=0.0, le=10.0)
    change_cost: float = pydantic.Field(0.0, ge=0.0)
    chosen: Literal["best", "last"] = "best"
    validate_every: int = pydantic.Field(Settings.validate_every, ge=1)
    law: dict[str, float] = {}
    safety: dict[str, float] = {}
    trims: tuple[Trim] = ALL_TRIMS
    weights: dict[str, float] = {}
    mappo: dict[str, Any] = {}
    ppo: dict[str, Any] = {}
    episodes: Episodes | None = None

    def settings(self, seed: int, algorithm: Algorithm = "mappo") -> Settings:
        """The settings of a training, whose seed draws the episodes' conditions too."""
        taken = {name: getattr(self, name) for name in _TAKEN}
        told, kind = (self.mappo, Hyperparameters) if algorithm == "mappo" else (self.ppo, ppo.Hyperparameters)
        numbers: dict[str, Any] = {k: tuple(value) if isinstance(value, list) else value for k, value in told.items()}
        return Settings(
            **taken,
            seed=seed,
            overrides=overrides_for(self.scenario, self.overrides),
            law=ScoutGains(**self.law),
            safety=Barrier(**self.safety),
            weights=Weights(**self.weights),
            algorithm=pydantic.TypeAdapter(kind).validate_python(vars(kind(**numbers))),
            conditions=self.episodes.draw(self.scenario, seed) if self.episodes else (),
            validation_conditions=self.episodes.draw_validated(self.scenario) if self.episodes else (),
        )


_TAKEN = (
    "scenario", "sees", "trims", "sizes", "validation", "steps", "held_s", "change_cost", "chosen", "validate_every",
)  # fmt: skip


def recipes() -> Sequence[str]:
    """Names of the recipes that come with the package."""
    return sorted(path.name.removesuffix(".toml") for path in _folder().iterdir() if path.name.endswith(".toml"))


def _folder() -> Any:
    return resources.files("uuv_marl.train") / "recipes"


def load_recipe(name: str) -> Recipe:
    """A recipe by name, or from a TOML file. With ``like = "another"`` a file says only what differs from another.

    Raises:
        ResultsError: it can't be read or used; the message names what is wrong in it.
    """
    try:
        recipe = Recipe(**_told(name))
        for algorithm in get_args(Algorithm):
            recipe.settings(0, algorithm)
    except (pydantic.ValidationError, tomllib.TOMLDecodeError, TypeError, ValueError) as error:
        raise ResultsError(f"recipe {name!r} can't be used: {error}") from None
    return recipe


def _told(name: str) -> dict[str, Any]:
    path = user_path(name) if name.endswith(".toml") else _folder() / f"{name}.toml"
    try:
        told = tomllib.loads(path.read_text(encoding="utf-8"))
    except OSError as error:
        there = ", ".join(recipes())
        raise ResultsError(
            f"recipe {name!r} can't be read ({error.strerror}); give one of {there}, or a TOML file"
        ) from None
    like = told.pop("like", None)
    if like is None:
        return told
    if like not in recipes() or like == name:
        raise ValueError(f"like = {like!r} must name another recipe of the package: {', '.join(recipes())}")
    return _merged(_told(like), told)


def _merged(table: dict[str, Any], changes: Mapping[str, Any]) -> dict[str, Any]:
    for key, value in changes.items():
        table[key] = _merged(table.get(key, {}), value) if isinstance(value, dict) else value
    return table
