"""Policies by name."""

import re

from uuv_marl.baselines import random_idle
from uuv_marl.baselines.bug.controller import TangentBug
from uuv_marl.baselines.comparators import (
    apf,
    leader_broadcast,
    leader_follower,
    olfati_saber,
    oracle,
    orca,
    proportional,
    velocity_broadcast,
)
from uuv_marl.baselines.learned.checkpoint import is_checkpoint
from uuv_marl.baselines.learned.trained import Trained
from uuv_marl.baselines.names import parse_name
from uuv_marl.baselines.paper import bio_inspired, sdc, sff
from uuv_marl.baselines.policy import Policy, PolicyError
from uuv_marl.baselines.scout import carrot, seeker
from uuv_marl.baselines.scout.controller import Scout
from uuv_marl.baselines.team_names import parse_team
from uuv_marl.errors import hint
from uuv_marl.modules import named_object

PolicyType = type[Policy] | Trained  # called with a scenario, it returns a policy; ``requirements`` are the policy's

_NETWORKS = {
    "mappo": "Trained by MAPPO on random_field, end to end.",
    "mappo_hard_water": "Trained by MAPPO on hard_water and its hard tier, end to end.",
    "mappo_two_swarms": "Trained by MAPPO on two_swarms, end to end.",
    "mappo_few_informed": "Imitation of leader_follower, then MAPPO on few_informed.",
    "mappo_few_informed_messages": "Imitation of velocity_broadcast, then MAPPO on few_informed with messages.",
    "mappo_silent_targets": "Trained by MAPPO on silent_targets, end to end.",
    "mappo_all": "One network, trained by MAPPO on random_field, hard_water and two_swarms.",
    "ppo": "Trained by Stable-Baselines3's PPO on short random fields, end to end.",
}
"""Docstrings of the networks in ``uuv_marl/baselines/weights``."""

POLICIES: dict[str, PolicyType] = {
    "bio_inspired": bio_inspired.BioInspired,
    "bio_inspired_plus": bio_inspired.BioInspiredPlus,
    "scout": Scout,
    "carrot": carrot.Carrot,
    "carrot_informed": carrot.CarrotInformed,
    "nearest_target": seeker.NearestTarget,
    "sff": sff.Sff,
    "sdc": sdc.Sdc,
    "apf": apf.Apf,
    "olfati_saber": olfati_saber.OlfatiSaber,
    "olfati_saber_informed": olfati_saber.OlfatiSaberInformed,
    "orca_informed": orca.OrcaInformed,
    "leader_follower": leader_follower.LeaderFollower,
    "leader_broadcast": leader_broadcast.LeaderBroadcast,
    "velocity_broadcast": velocity_broadcast.VelocityBroadcast,
    "proportional_tracking": proportional.ProportionalTracking,
    "oracle": oracle.Oracle,
    "tangent_bug": TangentBug,
    **{name: Trained(name, name, doc) for name, doc in _NETWORKS.items()},
    "random": random_idle.Random,
    "idle": random_idle.Idle,
}
"""Every policy that ships with the package."""


def policy_class(name: str) -> PolicyType:
    """The type of a policy by its name (``uuv_marl.baselines.names``). Raises PolicyError for others and for teams."""
    if team := parse_team(name):
        raise PolicyError(f"policy {name!r} is a team of {', '.join(team.members)}; name one of these")
    plain = parse_name(name).plain
    if plain not in POLICIES and is_checkpoint(plain):
        trained = Trained(plain, plain)
        trained.checkpoint  # noqa: B018 - raises now, not in the middle of a benchmark
        return trained
    if ":" in plain:
        try:
            policy_type = named_object(plain)
        except ImportError as error:
            team = "; a team has the form scout@uuv_0+mappo" if "+" in plain else ""
            raise PolicyError(f"policy {plain!r} {error}{team}") from None
        if not (isinstance(policy_type, type) and issubclass(policy_type, Policy)):
            raise PolicyError(f"policy {plain!r} must be a subclass of uuv_marl.baselines.Policy, got {policy_type!r}")
        return policy_type
    if plain not in POLICIES:
        raise PolicyError(
            f"policy {plain!r} is unknown; {hint(plain, POLICIES)}there are {', '.join(POLICIES)}, module:Class for "
            "your own, and paths of checkpoints"
        )
    return POLICIES[plain]


def is_trained(name: str) -> bool:
    """Whether a name is a trained policy's: one that ships, or the path of a checkpoint, which need not exist."""
    if parse_team(name):
        return False
    plain = parse_name(name).plain
    return isinstance(POLICIES[plain], Trained) if plain in POLICIES else not re.fullmatch(r"[\w.]+:\w+", plain)
