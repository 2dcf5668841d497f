"""Policies by name."""

import re

from uuv_marl.baselines.bug.controller import TangentBug
from uuv_marl.baselines.comparators.apf import Apf
from uuv_marl.baselines.comparators.leader_follower import LeaderFollower
from uuv_marl.baselines.comparators.olfati_saber import OlfatiSaber, OlfatiSaberInformed
from uuv_marl.baselines.comparators.oracle import Oracle
from uuv_marl.baselines.comparators.orca import OrcaInformed
from uuv_marl.baselines.comparators.proportional import ProportionalTracking
from uuv_marl.baselines.learned.checkpoint import is_checkpoint
from uuv_marl.baselines.learned.trained import Trained
from uuv_marl.baselines.names import parse_name
from uuv_marl.baselines.paper.bio_inspired import BioInspired, BioInspiredPlus
from uuv_marl.baselines.paper.sdc import Sdc
from uuv_marl.baselines.paper.sff import Sff
from uuv_marl.baselines.policy import Policy, PolicyError
from uuv_marl.baselines.random_idle import Idle, Random
from uuv_marl.baselines.scout.carrot import Carrot, CarrotInformed
from uuv_marl.baselines.scout.controller import Scout
from uuv_marl.baselines.scout.seeker import NearestTarget
from uuv_marl.errors import hint
from uuv_marl.modules import named_object

PolicyType = type[Policy] | Trained  # called with a scenario, it returns a policy; ``requirements`` are the policy's

_NETWORKS = {
    "mappo": "Trained by MAPPO on random_field, end to end.",
    "mappo_hard_water": "Trained by MAPPO on hard_water and its hard tier, end to end.",
    "mappo_two_swarms": "Trained by MAPPO on two_swarms, end to end.",
    "mappo_few_informed": "Imitation of leader_follower, then MAPPO on few_informed.",
    "mappo_silent_targets": "Trained by MAPPO on silent_targets, end to end.",
    "mappo_all": "One network, trained by MAPPO on random_field, hard_water and two_swarms.",
    "ppo": "Trained by Stable-Baselines3's PPO on short random fields, end to end.",
}
"""Docstrings of the networks in ``uuv_marl/baselines/weights``."""

POLICIES: dict[str, PolicyType] = {
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
    "proportional_tracking": ProportionalTracking,
    "oracle": Oracle,
    "tangent_bug": TangentBug,
    **{name: Trained(name, name, doc) for name, doc in _NETWORKS.items()},
    "random": Random,
    "idle": Idle,
}
"""Every policy that ships with the package."""


def policy_class(name: str) -> PolicyType:
    """The type of a policy by its name (``uuv_marl.baselines.names``). Raises PolicyError if the name is unknown."""
    plain = parse_name(name).plain
    if plain not in POLICIES and is_checkpoint(plain):
        trained = Trained(plain, plain)
        trained.checkpoint  # noqa: B018 - raises now, not in the middle of a benchmark
        return trained
    if ":" in plain:
        return _imported(plain)
    if plain not in POLICIES:
        raise PolicyError(
            f"policy {plain!r} is unknown; {hint(plain, POLICIES)}there are {', '.join(POLICIES)}, module:Class for "
            "your own, and paths of checkpoints"
        )
    return POLICIES[plain]


def _imported(name: str) -> type[Policy]:
    try:
        policy_type = named_object(name)
    except ImportError as error:
        raise PolicyError(f"policy {name!r} {error}") from None
    if not (isinstance(policy_type, type) and issubclass(policy_type, Policy)):
        raise PolicyError(f"policy {name!r} must be a subclass of uuv_marl.baselines.Policy, got {policy_type!r}")
    return policy_type


def is_trained(name: str) -> bool:
    """Whether a name is a trained policy's: one that ships, or the path of a checkpoint, which need not exist."""
    plain = parse_name(name).plain
    return isinstance(POLICIES[plain], Trained) if plain in POLICIES else not re.fullmatch(r"[\w.]+:\w+", plain)
