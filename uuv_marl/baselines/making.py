"""``make_policy``: policies with parameters, base controller and safety filter, for a scenario or an environment."""

import inspect
import math
from collections.abc import Mapping, Sequence
from typing import Any, overload

from uuv_marl.baselines.env_policy import EnvPolicy, HasSwarm, environment
from uuv_marl.baselines.learned.checkpoint import Card, is_checkpoint
from uuv_marl.baselines.learned.residual import ResidualPolicy
from uuv_marl.baselines.learned.trained import Trained
from uuv_marl.baselines.names import SAFETY_FILTER, parse_name
from uuv_marl.baselines.policy import Policy, PolicyError
from uuv_marl.baselines.registry import POLICIES, PolicyType, is_trained, policy_class
from uuv_marl.baselines.requirements import PolicyRequirements, inner_loop_nms, resolved_channels, with_parameters
from uuv_marl.baselines.safety.barrier import GUARD, Barrier
from uuv_marl.baselines.safety.guarded import Guarded
from uuv_marl.baselines.team import Team, member_scenario, shared_scenario
from uuv_marl.baselines.team_names import PolicyLike, TeamName, members_of, parse_team, policy_name
from uuv_marl.errors import ScenarioError, hint
from uuv_marl.scenario import Scenario, load_scenario
from uuv_marl.scenario.overrides import plain


def policy_requirements(name: str) -> PolicyRequirements:
    """Requirements of a policy by name and parameters; of a team all channels, and the first of each other kind."""
    if parse_team(name):
        return _of_team([policy_requirements(member) for member in members_of(name)])
    given = parse_name(name).parameters
    return with_parameters(policy_class(name).requirements, [key for key in given if _value(given[key]) is True])


def _of_team(each: Sequence[PolicyRequirements]) -> PolicyRequirements:
    """Requirements of a team from those of its members."""
    sender = next((required for required in each if required.message_entries), each[0])
    return each[0]._replace(
        channels=[*dict.fromkeys(channel for required in each for channel in required.channels)],
        decision_period_s=next((period for required in each if (period := required.decision_period_s)), None),
        message_entries=sender.message_entries, message_vectors=sender.message_vectors, outputs_force=False,
    )  # fmt: skip


def with_policy_requirements(name: PolicyLike | type[Policy], scenario: Scenario) -> Scenario:
    """The scenario with exactly the channels, messages, yaw damping and decision period that a policy requires.

    A class of your own can stand in place of a policy's name.

    With ``timing.fixed``, the scenario's damping and period stay, unless the name has ``own_clock=true``. If the
    scenario has ``modem``, it replaces the channel ``link``, except for policies that require both and for trained
    policies, which use the channels of their training.

    A team's scenario has the channels and messages of all members. Members without a decision period have that of the
    others. Raises PolicyError if members require different periods, dampings or messages.
    """
    if isinstance(name, type):
        return with_requirements(name.__name__, with_parameters(name.requirements, ()), scenario)
    name = policy_name(name)
    required = {member: policy_requirements(member) for member in members_of(name)}
    if name in required:
        return with_requirements(name, required[name], scenario)
    period = _of_team([*required.values()]).decision_period_s
    if period and not scenario.timing.fixed:
        scenario = load_scenario(scenario, overrides={"timing.decision_period_s": period})
    return shared_scenario(name, {member: with_requirements(member, required[member], scenario) for member in required})


def with_requirements(name: str, required: PolicyRequirements, scenario: Scenario) -> Scenario:
    """``with_policy_requirements`` for a policy with known requirements."""
    timing, channels = scenario.timing, required.channels
    changes: dict[str, object] = {
        "sonar.channels": list(channels) if is_trained(name) else resolved_channels(scenario, channels),
        "modem.message_entries": required.message_entries,
        "modem.message_vectors": required.message_vectors,
    }
    if parse_name(name).own_clock or not timing.fixed:
        usual = timing.control_step_s if timing.fixed else timing.decision_period_s
        loop = inner_loop_nms(required.yaw_damping_nms, required.full_torque_nm, scenario)
        changes["actuators.yaw_damping_nms"] = loop
        changes["timing.decision_period_s"] = required.decision_period_s or usual
        changes["timing.fixed"] = False
    try:
        return load_scenario(scenario, overrides=changes)
    except ScenarioError as error:
        raise ScenarioError(f"{name} can't run on scenario {scenario.name!r} with what it requires: {error}") from None


@overload
def make_policy(name: PolicyLike, target: Scenario, num_worlds: int = 1, **parameters: object) -> Policy: ...
@overload
def make_policy(name: PolicyLike, target: HasSwarm, num_worlds: int = 1, **parameters: object) -> EnvPolicy: ...
def make_policy(
    name: PolicyLike, target: Scenario | HasSwarm, num_worlds: int = 1, **parameters: object
) -> Policy | EnvPolicy:
    """Make a policy by name.

    Args:
        name: one of ``POLICIES``, the path of a checkpoint (``runs/starter/best``), or ``module:Class``; parameters and
            gains may follow, as in ``bio_inspired,zeta_n=0.5,obstacle_term=per_obstacle``; ``safety_filter=true``
            adds the safety filter. Or a team, as in ``scout@uuv_0+mappo``, ``{"uuv_0": "scout", "*": "mappo"}``, or
            ``scout@30%+mappo`` for shares of the vehicles, drawn by the seed of the episode.
        target: a scenario, for a policy that maps ``Percept`` to actions (``Policy``); or an environment of this
            package, wrapped or not, for a policy that maps its observations to its actions (``EnvPolicy``).
        num_worlds: number of parallel worlds; an environment has its own.
        parameters: keyword arguments of the policy, such as ``gains``, or single gains by name.

    Raises:
        PolicyError: the name or a parameter is unknown, or the target lacks what the policy requires
            (``with_policy_requirements``).
    """
    name = policy_name(name)
    if isinstance(target, Scenario):
        return _made(name, target, num_worlds, parameters)
    env = environment(target, name)
    return EnvPolicy(_made(name, env.scenario, env.swarm.num_worlds, parameters), env)


def _made(name: str, scenario: Scenario, num_worlds: int, parameters: Mapping[str, object]) -> Policy:
    """A team, or a policy with these parameters, its card's base controller, and the safety filter if named."""
    if team := parse_team(name):
        if parameters:
            raise PolicyError(
                f"team {name!r}: write {min(parameters)} into the name of a member, as in scout,preset=plus"
            )
        return make_team(team, scenario, num_worlds)
    parsed, policy_type = parse_name(name), policy_class(name)
    values = {**parsed.parameters, **parameters}
    barrier = values.pop("barrier", GUARD) if parsed.safety_filter else GUARD
    if not isinstance(barrier, Barrier):
        raise PolicyError(
            f"policy {name!r}: barrier must be a uuv_marl.baselines.safety.Barrier, got {barrier!r}; "
            "give it to make_policy(name, scenario, barrier=Barrier(obstacle_m=8.0)), not in the name"
        )
    policy = _with_parameters(name, policy_type, scenario, num_worlds, values)
    if isinstance(policy_type, Trained):
        policy = compose(policy, policy_type.checkpoint.card)
    policy.name = name
    return Guarded(scenario, num_worlds, inner=policy, barrier=barrier) if parsed.safety_filter else policy


def make_team(team: TeamName, scenario: Scenario, num_worlds: int, given: Mapping[str, Policy] = {}) -> Team:
    """A team; ``given`` are members that are not made from their names, for ``member_scenario``."""
    members = [
        given.get(member) or _made(member, member_scenario(policy_requirements(member), scenario), num_worlds, {})
        for member in team.members
    ]
    return Team(scenario, num_worlds, team=team, members=members)


def compose(network: Policy, card: Card) -> Policy:
    """A network with the base controller and the safety filter of its card.

    Args:
        network: the network's policy, or its substitute in training.
        card: the training's card.

    Raises:
        PolicyError: the base controller is unknown, or the scenario lacks its requirements.
    """
    scenario, num_worlds = network.scenario, network.num_worlds
    if card.base_controller:
        check_base_controller(card.base_controller)
        base = _made(card.base_controller, scenario, num_worlds, {})
        network = ResidualPolicy(scenario, num_worlds, base=base, inner=network)
    return Guarded(scenario, num_worlds, inner=network) if card.filter else network


def check_base_controller(name: str) -> None:
    """Raise PolicyError unless the name is a shipped controller's, since checkpoints must not run other code.

    Nor may it have a safety filter of its own, which the network's part of an action would bypass.
    """
    plain = name.partition(",")[0]
    if isinstance(POLICIES.get(plain), Trained) or ":" in plain or "@" in name or is_checkpoint(plain):
        controllers = ", ".join(known for known, type_ in POLICIES.items() if not isinstance(type_, Trained))
        raise PolicyError(f"base_controller must be one of {controllers}, got {name!r}")
    if parse_name(name).safety_filter:
        raise PolicyError(
            f"base_controller must not have {SAFETY_FILTER}=true, got {name!r}; set filter=true, which filters the sum "
            "of its action and the network's"
        )


def _with_parameters(
    name: str, policy_type: PolicyType, scenario: Scenario, num_worlds: int, parameters: Mapping[str, object]
) -> Policy:
    """An instance of a policy type with keyword arguments and single gains."""
    constructor: Any = policy_type
    known = [key for key in inspect.signature(constructor).parameters if key not in ("scenario", "num_worlds")]
    if isinstance(parameters.get("gains"), str):
        raise PolicyError(f"policy {name!r}: gains are written one by one, such as bio_inspired,zeta_n=0.5")
    values = {key: _value(value) for key, value in parameters.items()}
    own = {key: values.pop(key) for key in known if key in values}
    if isinstance(policy_type, Trained):
        policy: Any = constructor(scenario, num_worlds, **own)
    else:
        policy = object.__new__(policy_type)
        policy.name = name  # for the constructor's messages
        policy.__init__(scenario, num_worlds, **own)
    if values:
        gains: Any = getattr(policy, "gains", None)
        replaced = {key: _gain(name, key, value, gains, known) for key, value in values.items()}
        policy.gains = gains._replace(**replaced)
    return policy


def _gain(name: str, key: str, value: object, gains: Any, known: Sequence[str]) -> object:
    """The value of a gain. Raises PolicyError if the policy has no such gain or the value is not a finite number."""
    fields: tuple[str, ...] = getattr(gains, "_fields", ())
    if key not in fields:
        names = [*known, *fields]
        raise PolicyError(
            f"policy {name!r} has no parameter {key!r}; {hint(key, names, 0.6)}it has {', '.join(names) or 'none'}"
        )
    value = plain(value)
    if not (isinstance(value, float | int) and math.isfinite(value)):
        raise PolicyError(f"policy {name!r}: the gain {key} must be a finite number, got {value!r}")
    return value


def _value(written: object) -> object:
    """The number or truth value that a text stands for; other texts and values stay as they are."""
    if not isinstance(written, str):
        return written
    if written in ("true", "false"):
        return written == "true"
    try:
        return float(written)
    except ValueError:
        return written
