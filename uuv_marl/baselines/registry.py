"""Policies by name, for a swarm or for an environment."""

import difflib
import inspect
import math
import re
from collections.abc import Sequence
from typing import Any, NamedTuple, overload

from uuv_marl.baselines.bug.controller import TangentBug
from uuv_marl.baselines.comparators.apf import Apf
from uuv_marl.baselines.comparators.leader_follower import LeaderFollower
from uuv_marl.baselines.comparators.olfati_saber import OlfatiSaber, OlfatiSaberInformed
from uuv_marl.baselines.comparators.oracle import Oracle
from uuv_marl.baselines.comparators.orca import OrcaInformed
from uuv_marl.baselines.comparators.proportional import ProportionalTracking
from uuv_marl.baselines.env_policy import EnvPolicy, HasSwarm, environment
from uuv_marl.baselines.requirements import resolved_channels, inner_loop_nms
from uuv_marl.baselines.learned.residual import ResidualPolicy
from uuv_marl.baselines.learned.checkpoint import Card, is_checkpoint
from uuv_marl.baselines.learned.trained import Trained, shipped
from uuv_marl.baselines.paper.bio_inspired import BioInspired, BioInspiredPlus
from uuv_marl.baselines.paper.sdc import Sdc
from uuv_marl.baselines.paper.sff import Sff
from uuv_marl.baselines.policy import Policy, PolicyError
from uuv_marl.baselines.random_idle import Idle, Random
from uuv_marl.baselines.safety.barrier import GUARD, Barrier
from uuv_marl.baselines.safety.guarded import Guarded
from uuv_marl.baselines.scout.carrot import Carrot, CarrotInformed
from uuv_marl.baselines.scout.controller import Scout
from uuv_marl.baselines.scout.seeker import NearestTarget
from uuv_marl.errors import ScenarioError
from uuv_marl.modules import named_object
from uuv_marl.paths import user_path
from uuv_marl.scenario import Scenario, load_scenario
from uuv_marl.scenario.overrides import plain

Kind = type[Policy] | Trained
"""A class of policies: a call with a scenario makes a policy. It has what a policy declares."""

POLICIES: dict[str, Kind] = {
    "bio_inspired": BioInspired,
    "bio_inspired_plus": BioInspiredPlus,
    "scout": Scout,
    "carrot": Carrot,
    "carrot_informed": CarrotInformed,
    "nearest_target": NearestTarget,
    "sff": Sff,
    "sdc": Sdc,
    "apf": Apf,
    "olfati_saber": OlfatiSaber,
    "olfati_saber_informed": OlfatiSaberInformed,
    "orca_informed": OrcaInformed,
    "leader_follower": LeaderFollower,
    "pull": ProportionalTracking,
    "oracle": Oracle,
    "tangent_bug": TangentBug,
    "mappo": shipped("mappo", "Trained by MAPPO on random_field, end to end."),
    "mappo_hard_water": shipped("mappo_hard_water", "Trained by MAPPO on hard_water and its hard tier, end to end."),
    "mappo_two_swarms": shipped("mappo_two_swarms", "Trained by MAPPO on two_swarms, end to end."),
    "mappo_few_informed": shipped("mappo_few_informed", "Taught by leader_follower, then MAPPO on few_informed."),
    "mappo_silent_targets": shipped("mappo_silent_targets", "Trained by MAPPO on silent_targets, end to end."),
    "mappo_all": shipped("mappo_all", "One network, trained by MAPPO on random_field, hard_water and two_swarms."),
    "ppo": shipped("ppo", "Trained by Stable-Baselines3's PPO on short random fields, end to end."),
    "random": Random,
    "idle": Idle,
}
"""Every policy that ships with the package."""


GUARDED = "guarded:"
"""Prefix of a policy's name that puts it inside the safety filter."""
OWN = "own_clock:"
"""Prefix of a policy's name, before all others, that runs it with the clock and the inner loop that it declares where
the scenario fixes others for all (``timing.fixed``); made for any clock, it decides at every control hold."""


class ParsedPolicy(NamedTuple):
    """What the name of a policy says."""

    kind: Kind
    parameters: dict[str, str]
    """Values by parameter, as the user wrote them."""


def parse_policy(name: str) -> ParsedPolicy:
    """A policy from its name: ``[own_clock:][guarded:]NAME[,key=value ...]``.

    Args:
        name: NAME is one of ``POLICIES``, the path of a checkpoint, or ``module:Class``; each key is one of the
            policy's parameters or gains. ``guarded:`` puts the policy inside the safety filter; ``own_clock:`` changes
            the scenario alone (``granted``).

    Raises:
        PolicyError: no policy has that name; the message gives the most similar name.
    """
    name = name.removeprefix(OWN).removeprefix(GUARDED)
    if name.startswith((GUARDED, OWN)):
        raise PolicyError(f"policy {name!r} has a prefix too many; write it as {OWN}{GUARDED}NAME, each at most once")
    plain, *pairs = [name] if user_path(name).exists() else name.split(",")
    wrong = next((pair for pair in pairs if not all(pair.partition("="))), None)
    if wrong is not None:
        raise PolicyError(f"policy {name!r}: {wrong!r} must be key=value, such as bio_inspired,zeta_n=0.5")
    parts = [pair.partition("=") for pair in pairs]
    return ParsedPolicy(_kind(plain), {key.strip(): value.strip() for key, _, value in parts})


def policy_class(name: str) -> Kind:
    """The class of a policy by its name, see ``parse_policy``. Raises PolicyError with the most similar name."""
    return parse_policy(name).kind


def _kind(name: str) -> Kind:
    if name not in POLICIES and is_checkpoint(name):
        trained = Trained(name, name)
        trained.checkpoint  # noqa: B018 - refused now, not in the middle of a benchmark
        return trained
    if ":" in name:
        try:
            policy_type = named_object(name)
        except ImportError as error:
            raise PolicyError(f"policy {name!r} {error}") from None
        if not (isinstance(policy_type, type) and issubclass(policy_type, Policy)):
            raise PolicyError(f"policy {name!r} must be a subclass of uuv_marl.baselines.Policy, got {policy_type!r}")
        return policy_type
    if name not in POLICIES:
        near = difflib.get_close_matches(name, POLICIES, n=1, cutoff=0.4)
        hint = f"did you mean {near[0]!r}? " if near else ""
        raise PolicyError(
            f"policy {name!r} is unknown; {hint}There are {', '.join(POLICIES)}, module:Class for your own, "
            "and paths of checkpoints"
        )
    return POLICIES[name]


def is_trained(name: str) -> bool:
    """Whether a name is that of a trained policy: one that ships, or the path of a checkpoint, which may be gone."""
    plain = name.removeprefix(OWN).removeprefix(GUARDED).partition(",")[0]
    return isinstance(POLICIES[plain], Trained) if plain in POLICIES else not re.fullmatch(r"[\w.]+:\w+", plain)


def uses_identity(name: str) -> bool:
    """Whether the policy of that name acts by a vehicle's index, which no vehicle perceives."""
    kind, written = parse_policy(name)
    if isinstance(kind, Trained):
        base = kind.checkpoint.card.base_controller
        return bool(base) and uses_identity(base)
    by = kind.identity
    return bool(_value(written.get(by, "false"))) if isinstance(by, str) else by


def with_policy_requirements(name: str, scenario: Scenario) -> Scenario:
    """The scenario with exactly the channels, the inner loop (``inner_loop_nms``) and the clock that a policy declares.

    Where the scenario fixes inner loop and clock for all (``timing.fixed``), only the channels, unless the name begins
    with ``own_clock:``, which also gives a policy that is made for any clock a decision at every control hold.
    If the scenario has ``modem``, a policy that declares ``link`` gets ``modem`` instead. There are two exceptions: a
    policy that declares both, and a trained policy, which knows only the channels of its training.
    """
    return with_requirements(name, policy_class(name), scenario)


def with_requirements(name: str, declared: Any, scenario: Scenario) -> Scenario:
    """``granted`` for a policy of that name, by what it declared (``Declared``)."""
    timing, own = scenario.timing, name.startswith(OWN)
    changes: dict[str, object] = {
        "sonar.channels": list(declared.channels) if is_trained(name) else resolved_channels(scenario, declared.channels)
    }
    if own or not timing.fixed:
        loop = inner_loop_nms(declared.yaw_damping_nms, declared.full_torque_nm, scenario)
        usual = timing.control_step_s if timing.fixed else timing.decision_period_s
        changes["actuators.yaw_damping_nms"] = loop
        changes["timing.decision_period_s"] = declared.decision_period_s or usual
        changes["timing.fixed"] = False
    try:
        return load_scenario(scenario, overrides=changes)
    except ScenarioError as error:
        raise ScenarioError(f"{name} can't run on scenario {scenario.name!r} with what it declares: {error}") from None


@overload
def make(name: str, target: Scenario, num_worlds: int = 1, **parameters: object) -> Policy: ...
@overload
def make(name: str, target: HasSwarm, num_worlds: int = 1, **parameters: object) -> EnvPolicy: ...
def make(name: str, target: Scenario | HasSwarm, num_worlds: int = 1, **parameters: object) -> Policy | EnvPolicy:
    """A policy by name.

    Args:
        name: one of ``POLICIES``, the path of a checkpoint (``runs/starter/best``), or ``module:Class``; parameters and
            gains may follow, as in ``bio_inspired,zeta_n=0.5,obstacle_term=per_obstacle``; ``guarded:`` before it
            puts the policy inside the safety filter.
        target: a scenario, for a policy that maps ``Percept`` to actions (``Policy``); or one of our environments,
            wrapped or not, for a policy that maps its observations to its actions (``EnvPolicy``).
        num_worlds: worlds stepped together; an environment has its own number.
        parameters: keyword arguments of the policy, such as ``gains``, or single gains by name.

    Raises:
        PolicyError: the name or a parameter is unknown, or the target lacks channels, the inner loop or the clock that
            the policy declares (see ``granted``).
    """
    kind, written = parse_policy(name)
    if isinstance(target, Scenario):
        return _with_filter(name, kind, target, num_worlds, {**written, **parameters})
    scenario, swarm, agents = environment(target, name)
    policy = _with_filter(name, kind, scenario, swarm.num_worlds, {**written, **parameters})
    return EnvPolicy(policy, swarm, agents)


def _with_filter(name: str, kind: Kind, scenario: Scenario, num_worlds: int, parameters: dict[str, object]) -> Policy:
    """The policy with these parameters, inside the safety filter where its name says so."""
    name = name.removeprefix(OWN)
    if not name.startswith(GUARDED):
        return _without_filter(name, kind, scenario, num_worlds, parameters)
    barrier = parameters.pop("barrier", GUARD)
    if not isinstance(barrier, Barrier):
        raise PolicyError(
            f"policy {name!r}: barrier must be a uuv_marl.baselines.safety.Barrier, got {barrier!r}; "
            "give it to make(name, scenario, barrier=Barrier(obstacle_m=8.0)), not in the name"
        )
    inner = _without_filter(name.removeprefix(GUARDED), kind, scenario, num_worlds, parameters)
    return Guarded(scenario, num_worlds, inner=inner, barrier=barrier)


def _without_filter(name: str, kind: Kind, scenario: Scenario, num_worlds: int, parameters: dict[str, object]) -> Policy:
    """The policy with these parameters: keyword arguments of its kind, and single gains."""
    constructor: Any = kind
    known = [key for key in inspect.signature(constructor).parameters if key not in ("scenario", "num_worlds")]
    if isinstance(parameters.get("gains"), str):
        raise PolicyError(f"policy {name!r}: gains are written one by one, such as bio_inspired,zeta_n=0.5")
    values = {key: _value(value) for key, value in parameters.items()}
    policy: Policy = constructor(scenario, num_worlds, **{key: values.pop(key) for key in known if key in values})
    if isinstance(kind, Trained):
        policy = compose(policy, kind.checkpoint.card)
    policy.name = name
    if values:
        gains: Any = getattr(policy, "gains", None)
        changed = {key: _gain(name, key, value, gains, known) for key, value in values.items()}
        policy.gains = gains._replace(**changed)  # pyright: ignore[reportAttributeAccessIssue] - it has gains
    return policy


def check_base_controller(name: str) -> None:
    """Refuse what no network can be around, as a checkpoint runs what it names. Raises PolicyError."""
    plain = name.partition(",")[0]
    if isinstance(POLICIES.get(plain), Trained) or ":" in plain or is_checkpoint(plain):
        controllers = ", ".join(known for known, kind in POLICIES.items() if not isinstance(kind, Trained))
        raise PolicyError(f"a network can be around one of the laws {controllers}, got {name!r}")


def compose(network: Policy, card: Card) -> Policy:
    """A network with what its card says decides beside it: a law, to whose actions its own are added; the filter.

    Args:
        network: or what stands in its place in training.
        card: says what.

    Raises:
        PolicyError: there is no such law, or it has not what it needs.
    """
    scenario, num_worlds = network.scenario, network.num_worlds
    if card.base_controller:
        check_base_controller(card.base_controller)
        network = ResidualPolicy(scenario, num_worlds, base=make(card.base_controller, scenario, num_worlds), inner=network)
    return Guarded(scenario, num_worlds, inner=network) if card.filter else network


def _gain(name: str, key: str, value: object, gains: Any, known: Sequence[str]) -> object:
    """A gain's value. Raises PolicyError unless the policy has that gain and the value is a finite number."""
    fields: tuple[str, ...] = getattr(gains, "_fields", ())
    if key not in fields:
        names = [*known, *fields]
        near = difflib.get_close_matches(key, names, n=1)
        hint = f"did you mean {near[0]!r}? " if near else ""
        raise PolicyError(f"policy {name!r} has no parameter {key!r}; {hint}It has {', '.join(names) or 'none'}")
    value = plain(value)
    if not (isinstance(value, float | int) and math.isfinite(value)):
        raise PolicyError(f"policy {name!r}: the gain {key} must be a finite number, got {value!r}")
    return value


def _value(written: object) -> object:
    """What a text stands for: a number, true or false, or itself. Other values stay as they are."""
    if not isinstance(written, str):
        return written
    if written in ("true", "false"):
        return written == "true"
    try:
        return float(written)
    except ValueError:
        return written
