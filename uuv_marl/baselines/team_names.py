"""Grammar of teams' names, ``POLICY@WHICH+...``: which vehicles of a swarm run which policy."""

import math
import re
from collections.abc import Mapping, Sequence
from typing import NamedTuple, cast

import numpy as np

from uuv_marl.errors import PolicyError
from uuv_marl.paths import user_path
from uuv_marl.types import Int64

PolicyLike = str | Mapping[str, str]
"""A policy's name, or a team as in ``{"uuv_0": "scout", "*": "mappo"}`` or ``{"30%": "scout", "*": "mappo"}``."""
_PART, _WHICH = re.compile(r"@([^@+,/]+)(?:\+|$)"), re.compile(r"uuv_(0|[1-9]\d*)|\d+(\.\d+)?%|\*")
_ROUNDING = 0.01  # percent by which shares may miss 100


class TeamName(NamedTuple):
    """Parts of a team's name."""

    name: str
    members: tuple[str, ...]
    """Names of the policies, each once."""
    vehicles: Mapping[int, int]
    """Index of the member that a vehicle runs, by the vehicle's index, where vehicles are named."""
    percents: Sequence[float]
    """Share of the vehicles that run each member [%], where shares are given; else empty."""
    rest: int | None
    """Index of the member that all other vehicles run, if any."""

    def assigned(self, num_vehicles: int, seed: int) -> Int64:
        """Index of the member that each vehicle runs in an episode with this seed, shape (vehicle,).

        Shares are rounded to whole vehicles, which the seed orders: the first member has more vehicles with a larger
        share, and keeps those of a smaller one.

        Raises:
            PolicyError: a vehicle does not exist, or has no policy.
        """
        if self.percents:
            ends = np.floor(np.cumsum(self.percents) * (num_vehicles / 100.0) + 0.5)[:-1]
            runs = np.empty(num_vehicles, np.int64)
            order = np.random.default_rng((seed, 2)).permutation(num_vehicles)
            runs[order] = np.searchsorted(ends, np.arange(num_vehicles), side="right")
            return runs
        runs = np.full(num_vehicles, -1 if self.rest is None else self.rest, np.int64)
        if beyond := [i for i in self.vehicles if i >= num_vehicles]:
            raise PolicyError(
                f"team {self.name!r}: there is no vehicle uuv_{beyond[0]}; name one of uuv_0 to uuv_{num_vehicles - 1}"
            )
        for i, member in self.vehicles.items():
            runs[i] = member
        if (runs < 0).any():
            raise PolicyError(
                f"team {self.name!r}: uuv_{runs.argmin()} has no policy; name one, or end with a policy for all "
                "others, as in scout@uuv_0+mappo"
            )
        return runs


def policy_name(policy: PolicyLike) -> str:
    """The name of a policy, or of a team that is given by a mapping.

    Args:
        policy: a name, which is returned; or names by vehicle (``uuv_0``), share (``30%``) and ``*``, all others.

    Raises:
        PolicyError: it is neither.
    """
    if isinstance(policy, str):
        return policy
    pairs = cast(Mapping[object, object], policy).items() if isinstance(cast(object, policy), Mapping) else ()
    if not pairs or not all(isinstance(text, str) for pair in pairs for text in pair):
        raise PolicyError(
            "a policy is given by its name, such as 'scout' or 'module:Class', and a team by names, as in "
            f"{{'uuv_0': 'scout', '*': 'mappo'}}, got {policy!r}"
        )
    last = sorted(policy.items(), key=lambda pair: pair[0] == "*")
    return "+".join(f"{name}@{which}" for which, name in last).removesuffix("@*")


def members_of(name: str) -> tuple[str, ...]:
    """Names of the policies of a team, or the name of a single policy alone."""
    team = parse_team(name)
    return team.members if team else (name,)


def parse_team(name: str) -> TeamName | None:
    """Parts of a team's name; None for the name of a single policy.

    Each part is a policy's name, which may have parameters, and ``@`` with a vehicle (``uuv_0``), a share (``30%``) or
    ``*``, all others. The last part may omit ``@*``.

    Raises:
        PolicyError: a part is for something else, vehicles and shares are mixed, two parts are for one vehicle, or the
            shares do not sum to 100 %.
    """
    if "@" not in name or user_path(name).exists():
        return None
    *named, last = _PART.split(name)
    if not named:
        return None
    parts = [*zip(named[1::2], named[::2], strict=True), *([("*", last)] if last else [])]
    chosen = [which for which, _ in parts]
    _check(name, chosen)
    members = tuple(dict.fromkeys(policy for _, policy in parts))
    vehicles, percents = dict[int, int](), [0.0] * len(members)
    for which, member in ((which, members.index(policy)) for which, policy in parts):
        if which.startswith("uuv_"):
            vehicles[int(which[4:])] = member
        elif which != "*":
            percents[member] += float(which[:-1])
    rest = members.index(dict(parts)["*"]) if "*" in chosen else None
    if not any("%" in which for which in chosen):
        return TeamName(name, members, vehicles, (), rest)
    total = math.fsum(percents)
    if total > 100.0 + _ROUNDING or (rest is None and total < 100.0 - _ROUNDING):
        raise PolicyError(
            f"team {name!r}: the shares must sum to 100 %, got {total:g} %; change one, or end with a policy without a "
            "share for all others"
        )
    if rest is not None:
        percents[rest] += 100.0 - total
    return TeamName(name, members, vehicles, percents, rest)


def _check(name: str, chosen: Sequence[str]) -> None:
    """Raise PolicyError unless the parts of a team are for vehicles, or for shares, each part for others."""
    for which in chosen:
        if not _WHICH.fullmatch(which):
            raise PolicyError(
                f"team {name!r}: {which!r} must be a vehicle such as uuv_3, a share such as 30%, or * for all others"
            )
        if "%" not in which and chosen.count(which) > 1:
            raise PolicyError(f"team {name!r} has two policies for {which}; leave one out")
    if any("%" in which for which in chosen) and any("uuv" in which for which in chosen):
        raise PolicyError(f"team {name!r} has vehicles and shares; give one kind")
