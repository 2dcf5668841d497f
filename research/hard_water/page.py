"""The page of hard water, written from the rows of the episodes alone."""

from collections.abc import Mapping, Sequence
from string import Template

import numpy as np

from research.data import read_text
from research.episodes import Row, measured
from research.hard_water.sets import KINDS, TOLD, set_name
from uuv_marl.benchmark.tables import markdown_table
from uuv_marl.scenario import load_scenario
from uuv_marl.types import Float64

Found = Mapping[tuple[str, str], Sequence[Row]]
"""Rows by policy and set."""
_RESAMPLES = 2000
_TIERS: dict[str, str] = TOLD["tiers"]


def report(rows: Sequence[Row], episodes: Sequence[Row]) -> str:
    """The page's text.

    Args:
        rows: episodes of policies, as ``hard_water.csv.gz`` holds them.
        episodes: episodes of learners, as ``hard_water_learners.csv.gz`` holds them.
    """
    found: dict[tuple[str, str], list[Row]] = {}
    for row in rows:
        found.setdefault((row["policy"], row["set"]), []).append(row)
    policies = list(dict.fromkeys(policy for policy, _ in found))
    return Template(read_text("hard_water", "story.md")).substitute(
        episodes=f"{len(rows):,}", tiers=_tiers(found, policies), kinds=_kinds(found, policies, 10),
        many=_kinds(found, policies, 54), learners=_learners(found, policies, episodes),
    )  # fmt: skip


def _tiers(found: Found, policies: Sequence[str]) -> str:
    """Share and whole swarms in the mix of each tier, for ten vehicles."""
    table = []
    for policy in policies:
        cells = [_mixed(found, policy, tier) for tier in _TIERS]
        if "" not in cells:
            table.append((policy, *cells))
    return markdown_table(("policy", *(f"{tier}: share, whole" for tier in _TIERS)), table)


def _mixed(found: Found, policy: str, tier: str) -> str:
    kinds = load_scenario(_TIERS[tier]).task_numbers.kinds
    mine = [found.get((policy, set_name(tier, kind, 10)), ()) for kind in kinds]
    if not all(mine):
        return ""
    shares = [np.array(measured(rows, "untouched_share")) for rows in mine]
    whole = np.mean([np.mean(measured(rows, "whole")) for rows in mine])
    return f"{_with_interval(shares)}, {_short(float(whole))}"


def _kinds(found: Found, policies: Sequence[str], num_vehicles: int) -> str:
    """Share and whole swarms on each kind of map of the medium tier; contacts; time of those that are there."""
    table = []
    for policy in policies:
        mine = [found.get((policy, set_name("medium", kind, num_vehicles)), ()) for kind in KINDS]
        if all(mine):
            every = [row for rows in mine for row in rows]
            contacts = np.mean(measured(every, "collisions")) / num_vehicles
            ratio = measured(every, "time_ratio")
            table.append((policy, *map(_cell, mine), f"{contacts:.2f}", f"{np.mean(ratio):.2f}" if ratio else "–"))
    return markdown_table(("policy", *KINDS, "contacts", "time"), table)


def _cell(mine: Sequence[Row]) -> str:
    """Share and whole swarms."""
    return ", ".join(_short(float(np.mean(measured(mine, name)))) for name in ("untouched_share", "whole"))


def _learners(found: Found, policies: Sequence[str], episodes: Sequence[Row]) -> str:
    """Share of the vehicles: trainings of a kind together, on each kind of map, and the best law beside."""
    shares = {name: _shares(episodes, name) for name in ("sighted", "zeroed", "blind")}
    laws = {policy: _law(found, policy) for policy in policies if policy not in ("oracle", "random", "idle")}
    known = {policy: by_kind for policy, by_kind in laws.items() if by_kind}
    best = max(known, key=lambda policy: float(np.mean([known[policy][kind].mean() for kind in TOLD["trained"]])))
    words = {
        "sighted": "PPO", "zeroed": "PPO, its echoes zeroed on these maps", "blind": "PPO, trained with echoes zeroed",
    }  # fmt: skip
    rows = {words[name]: by_kind for name, by_kind in shares.items()} | {f"the best law: {best}": known[best]}
    table = [
        (name, *(_short(float(by_kind[kind].mean())) for kind in KINDS),
         _with_interval([by_kind[kind] for kind in TOLD["trained"]]))
        for name, by_kind in rows.items()
    ]  # fmt: skip
    gain = [shares["sighted"][kind] - known[best][kind] for kind in TOLD["trained"]]
    table.append(("PPO above the best law", *[""] * len(KINDS), _with_interval(gain)))
    return markdown_table(("", *KINDS, "kinds of the training"), table)


def _shares(episodes: Sequence[Row], name: str) -> dict[str, Float64]:
    """Shares by kind, shape (training, map)."""
    learners = dict.fromkeys(row["learner"] for row in episodes if row["learner"].startswith(name))
    return {
        kind: np.array([
            measured([r for r in episodes if r["learner"] == learner and r["kind"] == kind], "untouched_share")
            for learner in learners
        ])
        for kind in KINDS
    }  # fmt: skip


def _law(found: Found, policy: str) -> dict[str, Float64]:
    """Shares of a policy by kind, shape (1, map), for ten vehicles on the medium tier; empty where some are missing."""
    mine = {kind: found.get((policy, set_name("medium", kind, 10)), ()) for kind in KINDS}
    if not all(mine.values()):
        return {}
    return {kind: np.array([measured(rows, "untouched_share")]) for kind, rows in mine.items()}


def _with_interval(kinds: Sequence[Float64]) -> str:
    """The mean over kinds, and its 95 % interval over maps and trainings.

    ``kinds``: values of each kind, shape (map,) or (training, map); both are drawn anew, trainings for all kinds alike.
    """
    rng, values = np.random.default_rng(0), [np.atleast_2d(kind) for kind in kinds]
    means = np.empty(_RESAMPLES)
    for k in range(_RESAMPLES):
        trainings = rng.integers(len(values[0]), size=len(values[0]))
        means[k] = np.mean([v[trainings][:, rng.integers(v.shape[1], size=v.shape[1])].mean() for v in values])
    low, high = np.percentile(means, (2.5, 97.5))
    return f"{_short(float(np.mean([v.mean() for v in values])))} [{_short(low)}, {_short(high)}]"


def _short(share: float) -> str:
    """Two digits after the point, without a zero before it."""
    text = f"{share:.2f}"
    return text.replace("0.", ".", 1) if abs(share) < 0.995 else text
