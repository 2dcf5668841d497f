"""Arguments that every environment API takes, and the scenario that they make."""

import math
from collections.abc import Mapping
from typing import Literal, TypedDict, Unpack, cast

from uuv_marl.errors import ScenarioError, hint
from uuv_marl.paths import UserPath
from uuv_marl.scenario import Scenario, load_scenario
from uuv_marl.scenario.overrides import override_of
from uuv_marl.sim.observation import Observe
from uuv_marl.tasks.reward import RewardFunction

ScenarioLike = UserPath | Scenario | Mapping[str, object]
Reward = Literal["dense", "sparse", "team", "first_arrival", "geodesic", "leader"] | RewardFunction


class Changes(TypedDict, total=False):
    """Arguments that change fields of the scenario, explained by ``uuv_marl.parallel_env``."""

    num_vehicles: int | None
    decision_period: float | None
    task: str | Mapping[str, object] | None
    overrides: Mapping[str, object] | None


class EnvOptions(Changes, total=False):
    """Arguments of every environment API beyond the scenario, explained by ``uuv_marl.parallel_env``."""

    for_policy: str | Mapping[str, str] | None
    max_cycles: int | None
    reward: Reward
    observe: Observe


_CHANNELS, _YAW_DAMPING, _PERIOD = "sonar.channels", "actuators.yaw_damping_nms", "timing.decision_period_s"
_ENTRIES, _VECTORS = "modem.message_entries", "modem.message_vectors"
_FIELDS = {"num_vehicles": "swarm.num_vehicles", "decision_period": _PERIOD, "task": "task"}
"""Fields that arguments stand for."""


def changed(
    scenario: ScenarioLike, for_policy: str | Mapping[str, str] | None = None, **changes: Unpack[Changes]
) -> Scenario:
    """The scenario, changed by the arguments of an environment.

    Args:
        scenario: a name, a TOML file or a ``Scenario``.
        for_policy: a policy or a team; the scenario gets its requirements after the other changes.
        changes: ``num_vehicles`` replaces the scenario's number of vehicles, ``decision_period`` the time between
            decisions [s], ``task`` the task (``mine:Rendezvous``), and ``overrides`` any field, as in
            ``{"sonar.echo_reports": "surface"}``.

    Raises:
        TypeError: there is no such argument.
        ScenarioError: an argument contradicts the override of its field, or a requirement of the policy.
    """
    for name in changes.keys() - Changes.__annotations__.keys():
        usual = {"max_episode_steps": "max_cycles"}.get(name, name)  # Gymnasium's name
        near = hint(usual, EnvOptions.__annotations__, 0.6)
        raise TypeError(f"there is no argument {name!r}; {near}Fields of the scenario go into overrides")
    overrides = changes.get("overrides") or {}
    if not isinstance(cast(object, overrides), Mapping):
        return load_scenario(scenario, overrides=overrides)  # which says what overrides must be
    for name, field in _FIELDS.items():
        own, other = changes.get(name), override_of(overrides, field)
        if own is not None and other is not None and own != other:
            raise ScenarioError(f"{name} = {own} and the override {field} = {other} differ; leave one out")
    given = {**overrides, **{field: changes[name] for name, field in _FIELDS.items() if changes.get(name) is not None}}
    asked = load_scenario(scenario, overrides=given)
    return asked if for_policy is None else _with_requirements(for_policy, load_scenario(scenario), asked, given)


def _with_requirements(
    policy: str | Mapping[str, str], base: Scenario, asked: Scenario, given: Mapping[str, object]
) -> Scenario:
    """The scenario ``asked`` for with what the policy requires.

    Raises:
        ScenarioError: this would drop fields that ``given`` changed in ``base``.
    """
    from uuv_marl.baselines import with_policy_requirements  # noqa: PLC0415 - takes longer than all else here

    required = with_policy_requirements(policy, asked)
    remedy = "leave it out, or choose another policy"
    channels = required.sonar.channels
    dropped = {*asked.sonar.channels} - {*channels} - ({"link"} if "modem" in channels else set())
    if dropped and (override_of(given, _CHANNELS) is not None or asked.sonar.channels != base.sonar.channels):
        raise ScenarioError(
            f"{_CHANNELS} can't hold {', '.join(sorted(dropped))}: policy {policy!r} requires "
            f"{', '.join(channels) or 'no channels'}; {remedy}"
        )
    for name in (_YAW_DAMPING, _PERIOD, _ENTRIES, _VECTORS):
        section, field = name.split(".")
        wanted, needed = (getattr(getattr(each, section), field) for each in (asked, required))
        if override_of(given, name) is not None and not math.isclose(wanted, needed, rel_tol=1e-9):
            raise ScenarioError(f"{name} can't be {wanted:g}: policy {policy!r} requires {needed:g}; {remedy}")
    return required
