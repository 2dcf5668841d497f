"""The identified parameters beside the defaults, on the scenarios they were searched on and on the one they predict.

Beside both stands a hypothesis that was found with all numbers in view.
"""

import numpy as np
from matplotlib.figure import Figure

from uuv_marl.reproduce import identify
from uuv_marl.reproduce.cases import MULTI, SINGLE, TRACKING, Case, Report, Study
from uuv_marl.reproduce.columns import Columns, stack
from uuv_marl.reproduce.parts import Part, Tables

METRICS = ("min_spacing_m", "mean_min_spacing_m", "min_obstacle_distance_m", "task_time_s", "collisions")


HYPOTHESIS: dict[str, object] = {"sonar.arrays.bow.range_m": 190.0}
"""Found afterwards, with all numbers in view and against Table 1's D_i = 100 m: what would reconcile them."""
FEWER = {"swarm.num_vehicles": 45}
"""The same for section 5.1, which names no number of vehicles."""


def _sets(case: Case) -> dict[str, Case]:
    """A case under each set of parameters."""
    chosen = identify.identified().setting
    posthoc = HYPOTHESIS | FEWER if case is TRACKING else HYPOTHESIS
    return {
        "default": case,
        "identified": Case(f"identified {case.name}", case.scenario, "bio_inspired", chosen.overrides, chosen.policy),
        "post hoc": Case(f"posthoc {case.name}", case.scenario, "bio_inspired", posthoc),
    }


SETS = tuple(_sets(case) for case in (TRACKING, SINGLE, MULTI))
"""By scenario; of the identified ones the last is predicted, since section 5.2.2 was never looked at."""


def tables(study: Study, _report: Report) -> Tables:
    """Every trial of the search, and every seed of all parameter sets."""
    seeds = len(study.seeds)
    rows: list[Columns] = [
        {
            "parameters": np.full(seeds, name),
            "scenario": np.full(seeds, case.scenario),
            "seed": np.arange(seeds),
            **{metric: study.metric(case, metric) for metric in METRICS},
        }
        for sets in SETS
        for name, case in sets.items()
    ]
    return {"identification-trials": identify.trials(), "identification": stack(rows)}


def draw(made: Tables) -> Figure:
    """The trials."""
    return identify.draw(made["identification-trials"])


PART = Part(
    name="identification",
    title="Trials of the identification, and the paper's numbers",
    cases=tuple(case for sets in SETS for case in sets.values()),
    tables=tables,
    draw=draw,
    caption="tracking and single_obstacle, n = 54, bio_inspired, tuning seeds; see the page for the prediction",
)
