"""``report.md``: targets, a table for every set, algorithms over training seeds. Written from the episodes alone."""

from collections.abc import Sequence
from pathlib import Path

import numpy as np

from research.data import read_text
from research.heldout.across import SCORES, improvement, overall, runs, tasks
from research.heldout.episodes import ByPolicy, Episode, measured, read_episodes, write_episodes
from research.heldout.figures import draw_fields, draw_trainings
from research.heldout.marl_eval import write_marl_eval
from research.heldout.sets import FIRST, LEADING, SETS, HeldOut
from research.heldout.targets import later, targets
from research.heldout.trainings import Trained
from uuv_marl.baselines import POLICIES
from uuv_marl.benchmark.robustness.scores import scored
from uuv_marl.benchmark.style import house_style
from uuv_marl.benchmark.tables import markdown_table, shown

_NOTHING = "–"
_NO_TRAININGS = "No trainings were given.\n"
_HEADERS = (
    "policy", "arrived", "collided", "task time [s]", "worst", "after l(t) [s]", "obstacle distance [m]", "worst",
    "spacing [m]", "worst", "within Eq. 7", "centre error [m]", "effort",
)  # fmt: skip
_GUARDED = "guarded:"
_BESIDE = "scout", "scout_plus", "mappo"
"""Policies that ship, beside the trainings."""
_ORDER = (*dict.fromkeys((*POLICIES, *LEADING)), *(f"{_GUARDED}{name}" for name in POLICIES))
"""Policies in the order of tables; those of the shipped episodes that do not ship any more are among ``LEADING``."""


def write_page(folder: Path, episodes: Sequence[Episode], trained: Sequence[Trained]) -> list[Path]:
    """``report.md`` with its pictures, ``episodes.csv`` and ``marl_eval.json``; the paths."""
    folder.mkdir(parents=True, exist_ok=True)
    page, table, raw = folder / "report.md", folder / "episodes.csv", folder / "marl_eval.json"
    write_episodes(episodes, table)
    episodes = read_episodes(table)  # rounded: the same page from the file
    written = [page, table]
    with house_style():
        if any(e.set == "random_field" for e in episodes):
            written.append(draw_fields(episodes, "random_field", folder / "figures" / "random_field.png"))
        if trained:
            written.append(draw_trainings(episodes, trained, folder / "figures" / "training.png"))
    page.write_text(report(episodes, trained), encoding="utf-8")
    if tasks(episodes) and not all(one.ablation for one in trained):
        write_marl_eval(episodes, trained, raw)
        written.append(raw)
    return written


def report(episodes: Sequence[Episode], trained: Sequence[Trained]) -> str:
    """The page's text."""
    names, by_policy = {e.set for e in episodes if e.training_seed is None}, ByPolicy(episodes)
    sets = [held for held in SETS if held.name in names]
    return read_text("heldout", "story.md").format(
        first=FIRST,
        targets=_targets(episodes),
        glance=_glance(by_policy, sets),
        guarded=_guarded(by_policy),
        sets="\n".join(_set(held, by_policy) for held in sets),
        across=_across(episodes, trained),
        trainings=_trainings(trained),
    )


def _targets(episodes: Sequence[Episode]) -> str:
    found = targets(episodes)
    policies = dict.fromkeys(t.policy for t in found)
    words = [
        f"`{policy}` meets {sum(t.met for t in mine)} of {len(mine)}"
        for policy in policies
        for mine in [[t for t in found if t.policy == policy]]
    ]
    cells = {(t.set, t.demand, t.policy): t.measured if t.met else f"**{t.measured}**" for t in found}
    demands = dict.fromkeys((t.set, t.demand) for t in found)
    rows = [(*of, *(cells.get((*of, policy), _NOTHING) for policy in policies)) for of in demands]
    return f"{'; '.join(words)}.\n\n" + markdown_table(("set", "demand", *policies), rows)


def _glance(episodes: ByPolicy, sets: Sequence[HeldOut]) -> str:
    """How many episodes arrive untouched: a row for each policy, a column for each set."""
    rows = [
        (policy, *(f"{sum(e.succeeded for e in mine)}/{len(mine)}" if mine else _NOTHING for mine in found))
        for policy in _ORDER
        for found in [[episodes.select(held.name, policy) for held in sets]]
        if any(found)
    ]
    return markdown_table(("policy", *(held.name for held in sets)), rows)


def _guarded(episodes: ByPolicy) -> str:
    """What the filter does: policies alone and guarded, on the seeds of a set that both have."""
    rows: list[tuple[str, ...]] = []
    for name in (name for name in _ORDER if name.startswith(_GUARDED)):
        for held in SETS:
            guarded = episodes.select(held.name, name)
            alone = episodes.select(held.name, name.removeprefix(_GUARDED))[: len(guarded)]
            if guarded and alone:
                both = alone, guarded
                rows.append((
                    name, held.name, f"{len(guarded)}",
                    ", ".join(f"{sum(e.arrived for e in es)}" for es in both),
                    ", ".join(f"{sum(e.collisions > 0 for e in es)}" for es in both),
                    ", ".join(f"{sum(e.succeeded for e in es)}" for es in both),
                    ", ".join(f"{np.mean([e.time_s for e in es]):.1f} s" for es in both),
                    f"{later(guarded, alone):+.1f} s",
                ))  # fmt: skip
    headers = (
        "policy", "set", "episodes", "arrived: alone, guarded", "collided: alone, guarded",
        "arrived without a collision: alone, guarded", "mean time, or limit: alone, guarded", "later by",
    )  # fmt: skip
    return markdown_table(headers, rows) if rows else "No guarded policy was run.\n"


def _set(held: HeldOut, episodes: ByPolicy) -> str:
    found = {name: mine for name in _ORDER if (mine := episodes.select(held.name, name))}
    rows = [(name, *_cells(mine)) for name, mine in found.items()]
    note, count = f", {held.note}" if held.note else "", max(map(len, found.values()))
    head = f"### {held.name}\n\n`{held.scenario}`{note}, seeds from {FIRST:,}, at most {count}.\n\n"
    return head + markdown_table(_HEADERS, rows)


def _cells(mine: Sequence[Episode]) -> tuple[str, ...]:
    times, late = measured(mine, "task_time_s"), scored(np.array([e.time_s - e.duration_s for e in mine]))
    obstacle, spacing = measured(mine, "min_obstacle_distance_m"), measured(mine, "min_spacing_m")
    return (
        f"{len(times)}/{len(mine)}",
        f"{sum(e.collisions > 0 for e in mine)}",
        shown(times, ".1f"),
        f"{max(times):.1f}" if times else _NOTHING,
        f"{late:.1f}",
        shown(obstacle, ".2f"),
        f"{min(obstacle):.2f}" if obstacle else _NOTHING,
        shown(spacing, ".2f"),
        f"{min(spacing):.2f}" if spacing else _NOTHING,
        f"{np.mean([e.within_eq7 for e in mine]):.0%}",
        f"{np.mean(measured(mine, 'centre_error_m')):.1f}",
        f"{np.mean([e.effort for e in mine]):.2f}",
    )


def _across(episodes: Sequence[Episode], trained: Sequence[Trained]) -> str:
    compared = tasks(episodes)
    if not compared:
        return _NO_TRAININGS
    evaluated = {e.policy for e in episodes if e.training_seed is not None}
    labels = {one.algorithm: f"{one.algorithm}*" if one.ablation else one.algorithm for one in trained}
    algorithms = [name for name in labels if name in evaluated]
    shipped = [p for p in _BESIDE if any(e.policy == p for e in episodes)]
    headers = ["policy", "trainings", *(f"{name}, {held.name}" for name in SCORES for held in compared)]
    rows: list[list[str]] = []
    pair: list[list[list[list[float]]]] = []
    for policy, learned in [*((name, True) for name in algorithms), *((name, False) for name in shipped)]:
        by_task = [runs(episodes, held, policy, trained=learned) for held in compared]
        scores = [[[score(run) for run in task] for task in by_task] for score in SCORES.values()]
        each = [shown(task, ".2f") for tasks_of_score in scores for task in tasks_of_score]
        mean = [f"{overall(every):.2f}" if all(every) else _NOTHING for every in scores]
        label, count = (labels[policy], f"{len(by_task[0])}") if learned else (f"`{policy}`", _NOTHING)
        rows.append([label, count, *each, *mean])
        if learned and policy in ("mappo", "ppo"):
            pair.append(scores)
    return markdown_table([*headers, *(f"{name}, all" for name in SCORES)], rows) + _improvement(pair, compared)


def _improvement(pair: Sequence[list[list[list[float]]]], compared: Sequence[HeldOut]) -> str:
    """Probability that the first algorithm is better than the second, by score and task."""
    if len(pair) < 2:
        return ""
    rows = [
        (name, *(f"{improvement([x], [y]):.2f}" for x, y in zip(mine, other, strict=True)),
         f"{improvement(mine, other):.2f}")
        for name, mine, other in zip(SCORES, *pair, strict=True)
    ]  # fmt: skip
    headers = ("probability that mappo is better than ppo", *(held.name for held in compared), "all")
    return "\n" + markdown_table(headers, rows)


def _trainings(trained: Sequence[Trained]) -> str:
    rows = [
        (
            one.algorithm, f"{one.seed}", f"{last.agent_steps / 1e6:.1f}", f"{last.seconds / 60:.0f}",
            f"{one.policy_at.agent_steps / 1e6:.1f}", f"{one.policy_at.score:.2f}", f"{one.policy_at.arrived:.0%}",
            f"{max(one.validations, key=lambda v: v.score).score:.2f}",
        )
        for one in trained
        for last in one.validations[-1:]
    ]  # fmt: skip
    headers = (
        "algorithm", "seed", "million agent-steps", "minutes", "policy of [million]", "its score", "arrived",
        "best score",
    )  # fmt: skip
    return markdown_table(headers, rows) if rows else _NO_TRAININGS
