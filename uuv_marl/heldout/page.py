"""``report.md``: targets, a table for every set, algorithms over training seeds. Written from the episodes alone."""

from collections.abc import Callable, Sequence
from importlib import resources
from pathlib import Path

import numpy as np

from uuv_marl.baselines import POLICIES
from uuv_marl.benchmark.tables import Estimate, estimate
from uuv_marl.heldout.across import SCORES, stratified
from uuv_marl.heldout.episodes import Episode, read_episodes, write_episodes
from uuv_marl.heldout.figures import draw_efficiency, draw_fields
from uuv_marl.heldout.marl_eval import write_marl_eval
from uuv_marl.heldout.sets import ACROSS, SETS, HeldOut
from uuv_marl.heldout.targets import RIVAL, of, paired, targets
from uuv_marl.heldout.trainings import Trained

_NOTHING = "–"
_HEADERS = (
    "policy", "arrived", "collided", "task time [s]", "worst", f"beyond {RIVAL} [s]", "obstacle distance [m]", "worst",
    "spacing [m]", "worst", "within Eq. 7", "centre error [m]", "effort",
)  # fmt: skip


def write_page(folder: Path, episodes: Sequence[Episode], trained: Sequence[Trained]) -> list[Path]:
    """``report.md`` with its pictures, ``episodes.csv`` and ``marl_eval.json``; the paths."""
    folder.mkdir(parents=True, exist_ok=True)
    page, table, raw = folder / "report.md", folder / "episodes.csv", folder / "marl_eval.json"
    pictures = [folder / "figures" / name for name in ("random_field.png", "training.png")]
    write_episodes(episodes, table)
    episodes = read_episodes(table)  # rounded: the same page from the file
    written = [page, table]
    if any(e.set == "random_field" for e in episodes):
        draw_fields(episodes, "random_field", pictures[0])
        written.append(pictures[0])
    if trained:
        write_marl_eval(episodes, trained, raw)
        draw_efficiency(trained, pictures[1])
        written += [raw, pictures[1]]
    page.write_text(report(episodes, trained), encoding="utf-8")
    return written


def report(episodes: Sequence[Episode], trained: Sequence[Trained]) -> str:
    """The page's text."""
    story = resources.files("uuv_marl.heldout").joinpath("story.md").read_text(encoding="utf-8")
    marks: dict[str, Callable[[], str]] = {
        "targets": lambda: _targets(episodes),
        "sets": lambda: "\n".join(_set(held, episodes) for held in SETS if any(e.set == held.name for e in episodes)),
        "across": lambda: _across(episodes),
        "trainings": lambda: _trainings(trained),
    }
    for name, text in marks.items():
        story = story.replace("{" + name + "}", text())
    return story


def _table(headers: Sequence[str], rows: Sequence[Sequence[str]]) -> str:
    lines = ["| " + " | ".join(headers) + " |", "|" + " --- |" * len(headers)]
    return "\n".join([*lines, *("| " + " | ".join(row) + " |" for row in rows)]) + "\n"


def _targets(episodes: Sequence[Episode]) -> str:
    found = targets(episodes, "mappo")
    rows = [(t.set, t.demand, t.measured, "met" if t.met else "**missed**") for t in found]
    met = sum(t.met for t in found)
    return f"{met} of {len(found)} are met by `mappo`.\n\n" + _table(("set", "demand", "measured", ""), rows)


def _set(held: HeldOut, episodes: Sequence[Episode]) -> str:
    rival = of(episodes, held.name, RIVAL)
    here = {e.policy for e in episodes if e.set == held.name and e.training_seed is None}
    order = [name for name in POLICIES if name in here]
    rows = [(name, *_cells(of(episodes, held.name, name), None if name == RIVAL else rival)) for name in order]
    note = f", {held.note}" if held.note else ""
    count = max(len(of(episodes, held.name, name)) for name in order)
    return f"### {held.name}\n\n`{held.scenario}`{note}, seeds from 0, at most {count}.\n\n" + _table(_HEADERS, rows)


def _cells(mine: Sequence[Episode], rival: Sequence[Episode] | None) -> tuple[str, ...]:
    times = [e.task_time_s for e in mine if e.task_time_s is not None]
    extra = paired(mine, rival) if rival else []
    obstacle = [e.min_obstacle_distance_m for e in mine if e.min_obstacle_distance_m is not None]
    spacing = [e.min_spacing_m for e in mine if e.min_spacing_m is not None]
    return (
        f"{len(times)}/{len(mine)}",
        f"{sum(e.collisions > 0 for e in mine)}",
        _interval(times, 1),
        f"{max(times):.1f}" if times else _NOTHING,
        f"{np.mean(extra):+.1f} ({len(extra)})" if extra else _NOTHING,
        _interval(obstacle, 2),
        f"{min(obstacle):.2f}" if obstacle else _NOTHING,
        _interval(spacing, 2),
        f"{min(spacing):.2f}" if spacing else _NOTHING,
        f"{np.mean([e.within_eq7 for e in mine]):.0%}",
        f"{np.mean([e.centre_error_m for e in mine if e.centre_error_m is not None]):.1f}",
        f"{np.mean([e.effort for e in mine]):.2f}",
    )


def _interval(values: Sequence[float], digits: int) -> str:
    return _shown(estimate(values), digits) if values else _NOTHING


def _shown(e: Estimate, digits: int) -> str:
    return f"{e.iqm:.{digits}f} [{e.low:.{digits}f}, {e.high:.{digits}f}]"


def _across(episodes: Sequence[Episode]) -> str:
    tasks = [held for held in ACROSS if any(e.set == held.name and e.training_seed is not None for e in episodes)]
    algorithms = sorted({e.policy for e in episodes if e.training_seed is not None})
    hand_made = [p for p in ("bio_inspired", RIVAL) if any(e.policy == p for e in episodes)]
    headers = ["policy", *(f"{name}, {held.name}" for name in SCORES for held in tasks), *(f"{n}, all" for n in SCORES)]
    rows: list[list[str]] = []
    for policy in [*algorithms, *hand_made]:
        cells: list[str] = []
        whole: list[str] = []
        for score in SCORES.values():
            by_task = [
                [score(run) for run in _runs(episodes, held, policy, trained=policy in algorithms)] for held in tasks
            ]
            cells += [_shown(stratified([scores]), 2) for scores in by_task]
            whole.append(_shown(stratified(by_task), 2))
        rows.append([policy, *cells, *whole])
    return _table(headers, rows) if tasks else "No trainings were given.\n"


def _runs(episodes: Sequence[Episode], held: HeldOut, policy: str, trained: bool) -> list[list[Episode]]:
    """A policy's episodes of a task, a list for each training; a hand-made policy counts as one."""
    runs: dict[int | None, list[Episode]] = {}
    for e in episodes:
        if (e.set, e.policy, e.training_seed is not None) == (held.name, policy, trained) and e.seed < held.seeds:
            runs.setdefault(e.training_seed, []).append(e)
    return list(runs.values())


def _trainings(trained: Sequence[Trained]) -> str:
    rows: list[tuple[str, ...]] = []
    for one in trained:
        if one.validations:
            best, last = max(one.validations, key=lambda v: v.score), one.validations[-1]
            rows.append(
                (
                    one.algorithm, f"{one.seed}", f"{last.agent_steps / 1e6:.1f}", f"{last.seconds / 60:.0f}",
                    f"{best.agent_steps / 1e6:.1f}", f"{best.score:.2f}", f"{best.arrived:.0%}", f"{last.score:.2f}",
                )
            )  # fmt: skip
    headers = (
        "algorithm", "seed", "million agent-steps", "minutes", "best at [million]", "its score", "arrived",
        "last score",
    )  # fmt: skip
    return _table(headers, rows) if rows else "No trainings were given.\n"
