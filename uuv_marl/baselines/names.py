"""Grammar of policy names: ``NAME[,key=value ...]``."""

from typing import NamedTuple

from uuv_marl.baselines.team_names import members_of
from uuv_marl.errors import PolicyError
from uuv_marl.paths import user_path

SAFETY_FILTER, OWN_CLOCK = "safety_filter", "own_clock"  # options of every policy, each ``true`` or ``false``


class PolicyName(NamedTuple):
    """Parts of a policy's name."""

    plain: str
    """One of ``POLICIES``, the path of a checkpoint, or ``module:Class``; the whole name of a team."""
    parameters: dict[str, str]
    """Values by parameter or gain, as text."""
    safety_filter: bool
    """Whether the policy acts inside the safety filter."""
    own_clock: bool
    """Whether it runs with its own decision period and yaw damping on a scenario that fixes them (``timing.fixed``); a
    policy without a required period then decides at every control step."""


def parse_name(name: str) -> PolicyName:
    """Parts of a name such as ``bio_inspired,zeta_n=0.5,safety_filter=true``.

    A team (``uuv_marl.baselines.team_names``) has its own clock if all members have theirs; the parameters are theirs.

    Raises PolicyError if a part is not ``key=value`` or an option is neither true nor false.
    """
    if (members := members_of(name)) != (name,):
        return PolicyName(name, {}, False, all(parse_name(member).own_clock for member in members))
    plain, *pairs = [name] if user_path(name).exists() else name.split(",")
    if (wrong := next((pair for pair in pairs if not all(pair.partition("="))), None)) is not None:
        raise PolicyError(f"policy {name!r}: {wrong!r} must be key=value, such as bio_inspired,zeta_n=0.5")
    values = {key.strip(): value.strip() for key, _, value in (pair.partition("=") for pair in pairs)}
    options = {key: values.pop(key, "false") for key in (SAFETY_FILTER, OWN_CLOCK)}
    for key, value in options.items():
        if value not in ("true", "false"):
            raise PolicyError(f"policy {name!r}: {key} must be true or false, got {value!r}")
    return PolicyName(plain, values, *(value == "true" for value in options.values()))
