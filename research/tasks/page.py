"""The page of a task, written from the rows of its episodes alone."""

from collections.abc import Mapping, Sequence
from string import Template

import numpy as np

from research.data import read_text
from research.episodes import Row, measured
from research.tasks.studies import STUDIES, set_name
from uuv_marl.benchmark.tables import markdown_table
from uuv_marl.scenario import load_scenario
from uuv_marl.types import Float64

Found = Mapping[tuple[str, str], Sequence[Row]]
"""Rows by policy and set."""
Columns = Mapping[str, Sequence[str]]
"""Sets by the head of their column."""
_RESAMPLES = 2000
_NO_LAWS = ("oracle", "carrot_informed", "random", "idle")
_LEARNERS = {
    "sighted": "PPO", "zeroed": "PPO, its echoes zeroed in these episodes", "blind": "PPO, trained with echoes zeroed",
}  # fmt: skip


def report(task: str, rows: Sequence[Row], episodes: Sequence[Row]) -> str:
    """The page's text.

    Args:
        task: a name of ``STUDIES``.
        rows: episodes of policies, as ``TASK.csv.gz`` holds them.
        episodes: episodes of learners, as ``learned_TASK.csv.gz`` holds them.
    """
    found: dict[tuple[str, str], list[Row]] = {}
    for row in rows:
        found.setdefault((row["policy"], row["set"]), []).append(row)
    policies = list(dict.fromkeys(policy for policy, _ in found))
    kinds = [name.split("-")[1] for name in STUDIES[task].judged if "-" in name]
    return Template(read_text("tasks", "stories", f"{task}.md")).substitute(
        episodes=f"{len(rows):,}",
        tiers=_shares(found, policies, _tiers(task)),
        kinds=_whole(found, policies, {kind: [set_name(task, kind)] for kind in kinds}),
        many=_whole(found, policies, {kind: [set_name(task, kind, 54)] for kind in kinds}),
        learners=_learners(found, policies, episodes, task),
    )


def _tiers(task: str) -> Columns:
    """The sets of each scenario: those of the kinds of map that it draws by itself."""
    return {
        name: [set_name(name, kind) for kind in getattr(load_scenario(name).task_numbers, "kinds", [""])]
        for name in (f"{task}_easy", task, f"{task}_hard")
    }


def _shares(found: Found, policies: Sequence[str], columns: Columns) -> str:
    """Share of the vehicles with its interval, and of whole swarms: a row for each policy that ran on all sets."""
    table = [
        (policy, *(f"{_with_interval(_values(mine, 'untouched_share'))}, {_mean(mine, 'whole')}" for mine in cells))
        for policy in policies
        if (cells := _cells(found, policy, columns))
    ]
    return markdown_table(("policy", *columns), table)


def _whole(found: Found, policies: Sequence[str], columns: Columns) -> str:
    """Share of the vehicles and of whole swarms; contacts of a vehicle; time of those that are there."""
    table: list[tuple[str, ...]] = []
    for policy in policies:
        if cells := _cells(found, policy, columns):
            every = [rows for mine in cells for rows in mine]
            n = load_scenario(every[0][0]["set"].split("-")[0]).swarm.num_vehicles
            n = int(every[0][0]["set"].split("-")[2]) if every[0][0]["set"].count("-") == 2 else n
            contacts = np.mean([value for rows in every for value in measured(rows, "collisions")]) / n
            ratio = [value for rows in every for value in measured(rows, "time_ratio")]
            shares = (f"{_mean(mine, 'untouched_share')}, {_mean(mine, 'whole')}" for mine in cells)
            table.append((policy, *shares, f"{contacts:.2f}", f"{np.mean(ratio):.2f}" if ratio else "–"))
    return markdown_table(("policy", *columns, "contacts", "time"), table)


def _cells(found: Found, policy: str, columns: Columns) -> list[list[Sequence[Row]]]:
    """The rows of a policy in each set of each column; nothing if some are missing."""
    cells = [[found.get((policy, name), ()) for name in names] for names in columns.values()]
    return cells if all(rows for mine in cells for rows in mine) else []


def _values(mine: Sequence[Sequence[Row]], name: str) -> list[Float64]:
    return [np.array(measured(rows, name)) for rows in mine]


def _mean(mine: Sequence[Sequence[Row]], name: str) -> str:
    return _short(float(np.mean([values.mean() for values in _values(mine, name)])))


def _learners(found: Found, policies: Sequence[str], episodes: Sequence[Row], task: str) -> str:
    """Share of the vehicles: all trainings of a kind together, on each set, and the best law beside."""
    judged, mixed = STUDIES[task].judged, _tiers(task)[STUDIES[task].learns]
    columns = {name.removeprefix(f"{task}-"): [name] for name in judged}
    laws = {
        policy: {name: np.array([measured(found[policy, name], "untouched_share")]) for name in judged}
        for policy in policies
        if not policy.startswith(_NO_LAWS) and "_informed" not in policy and _cells(found, policy, columns)
    }
    best = max(laws, key=lambda policy: float(np.mean([laws[policy][name].mean() for name in mixed])))
    learned = {words: _learned(episodes, name, judged) for name, words in _LEARNERS.items()}
    rows = {words: shares for words, shares in learned.items() if shares} | {f"the best law: {best}": laws[best]}
    table = [
        (words, *(_short(float(shares[name].mean())) for name in judged),
         _with_interval([shares[name] for name in mixed]))
        for words, shares in rows.items()
    ]  # fmt: skip
    gain = [learned["PPO"][name] - laws[best][name] for name in mixed]
    table.append(("PPO above the best law", *[""] * len(judged), _with_interval(gain)))
    return markdown_table(("", *columns, f"mean of {STUDIES[task].learns}"), table)


def _learned(episodes: Sequence[Row], name: str, judged: Sequence[str]) -> dict[str, Float64]:
    """Shares by set, shape (training, episode); nothing where there was no such training."""
    learners = dict.fromkeys(row["learner"] for row in episodes if row["learner"].startswith(name))
    by_set = {
        each: [
            measured([r for r in episodes if r["learner"] == learner and r["set"] == each], "untouched_share")
            for learner in learners
        ]
        for each in judged
    }
    return {each: np.array(values) for each, values in by_set.items()} if learners else {}


def _with_interval(sets: Sequence[Float64]) -> str:
    """The mean over sets, and its 95 % interval over episodes and trainings.

    ``sets``: values of each set, shape (episode,) or (training, episode); both are drawn anew, trainings for all sets
    alike.
    """
    rng, values = np.random.default_rng(0), [np.atleast_2d(each) for each in sets]
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
