"""The identified parameters beside the defaults, on the scenarios they were searched on and on the one they predict."""

import numpy as np
from matplotlib.figure import Figure

from uuv_marl.reproduce import identify
from uuv_marl.reproduce.cases import MULTI, SINGLE, TRACKING, Case, Report, Study
from uuv_marl.reproduce.columns import Columns, stack
from uuv_marl.reproduce.parts import Part, Tables

METRICS = ("min_spacing_m", "mean_min_spacing_m", "min_obstacle_distance_m", "task_time_s", "collisions")


def _identified(case: Case) -> Case:
    chosen = identify.identified().setting
    return Case(f"identified {case.name}", case.scenario, overrides=chosen.overrides, parameters=chosen.policy)


PAIRS = tuple((case, _identified(case)) for case in (TRACKING, SINGLE, MULTI))
"""Defaults and identified parameters; the last is predicted, since section 5.2.2 was never looked at."""


def tables(study: Study, _report: Report) -> Tables:
    """Every trial of the search, and every seed of both parameter sets."""
    rows: list[Columns] = []
    for pair in PAIRS:
        for name, case in zip(("default", "identified"), pair, strict=True):
            seeds = len(study.seeds)
            rows.append(
                {
                    "parameters": np.full(seeds, name),
                    "scenario": np.full(seeds, case.scenario),
                    "seed": np.arange(seeds),
                    **{metric: study.metric(case, metric) for metric in METRICS},
                }
            )
    return {"identification-trials": identify.trials(), "identification": stack(rows)}


def draw(made: Tables) -> Figure:
    """The trials."""
    return identify.draw(made["identification-trials"])


PART = Part(
    name="identification",
    title="Trials of the identification, and the paper's numbers",
    cases=tuple(case for pair in PAIRS for case in pair),
    tables=tables,
    draw=draw,
    caption="tracking and single_obstacle, n = 54, bio_inspired, tuning seeds; see the page for the prediction",
)
