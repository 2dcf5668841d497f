"""Run what is missing of a benchmark, and write its tables and pictures."""

import math
from collections.abc import Callable, Sequence
from itertools import product
from pathlib import Path

from uuv_marl.atomic import write_text, writing
from uuv_marl.baselines import with_policy_requirements
from uuv_marl.baselines.names import OWN_CLOCK
from uuv_marl.baselines.registry import is_trained
from uuv_marl.benchmark.evaluate import blaming, episodes
from uuv_marl.benchmark.figures import draw_all
from uuv_marl.benchmark.metrics import shares_of
from uuv_marl.benchmark.results import ResultRow, Results
from uuv_marl.benchmark.tables import Table, markdown_table, scenario_table
from uuv_marl.errors import ScenarioError
from uuv_marl.scenario import Scenario

DEFAULT_POLICIES = ("bio_inspired", "sff", "sdc", "scout", "mappo", "ppo")
"""The policies of the paper's Table 2, the safest controller, and learned policies."""


def default_policies(scenarios: Sequence[Scenario]) -> list[str]:
    """``DEFAULT_POLICIES``; where scenarios fix the clocks, also the controllers with their own clocks."""
    fixed = all(scenario.timing.fixed for scenario in scenarios)
    return [
        *DEFAULT_POLICIES,
        *(f"{name},{OWN_CLOCK}=true" for name in DEFAULT_POLICIES if fixed and not is_trained(name)),
    ]


Report = Callable[[str, str, float], None]
"""Called with scenario, policy and the share of that pair's work that is done."""


def run_missing(
    results: Results,
    scenarios: Sequence[Scenario],
    policies: Sequence[str],
    seeds: Sequence[int],
    report: Report,
    **parameters: object,
) -> None:
    """Run what ``results`` lacks of these scenarios, policies and seeds; each finished seed is saved at once.

    ``parameters`` are keyword arguments of the policies.
    """
    for scenario, policy in product(scenarios, policies):
        results.use(policy)
        missing = [seed for seed in seeds if not results.has(scenario.name, policy, seed)]

        def note(share: float, pair: tuple[str, str] = (scenario.name, policy), left: int = len(missing)) -> None:
            report(*pair, 1.0 - left / len(seeds) * (1.0 - share))

        note(0.0)
        with blaming(policy):
            loaded = with_policy_requirements(policy, scenario)
            for run in episodes(loaded, policy, missing, None, note, **parameters):
                results.add(scenario.name, policy, run)
        note(1.0)


def distinct_names(scenarios: Sequence[Scenario], what: str) -> list[str]:
    """Names of the scenarios of a table or report. Raises ScenarioError where two are equal."""
    names = [scenario.name for scenario in scenarios]
    if len(set(names)) < len(names):
        raise ScenarioError(f"scenarios of one {what} need different names, got {', '.join(names)}; rename a file")
    return names


def worst(results: Results, scenarios: Sequence[Scenario], policies: Sequence[str], seeds: Sequence[int]) -> ResultRow:
    """The worst run: the lowest main metric, then most collisions, no arrival, the smallest distance to anything.

    Of equal runs the first counts, in the given order of scenarios, policies and seeds.
    """
    headlines = {scenario.name: scenario.task_class.headline for scenario in scenarios}

    def badness(row: ResultRow) -> tuple[float, int, bool, float]:
        metrics = row.metrics
        share, _ = shares_of(metrics, headlines[row.scenario])
        away = [d for d in (metrics["min_spacing_m"], metrics["min_obstacle_distance_m"]) if d is not None]
        return -share, metrics["collisions"], metrics["task_time_s"] is None, -min(away, default=math.inf)

    return max((row for s in scenarios for p in policies for row in results.select(s.name, p, seeds)), key=badness)


def write_report(
    results: Results, scenarios: Sequence[Scenario], seeds: Sequence[int]
) -> tuple[list[Table], list[Path]]:
    """Write ``table.md`` and the pictures of every policy with runs on these scenarios and seeds.

    Returns:
        A table for each scenario, with the default policies in their order, then others by name; and the paths
        written, first the table's.

    Raises:
        ResultsError: a file can't be written.
    """
    held = [name for name in sorted(results.policies) if any(results.select(s.name, name, seeds) for s in scenarios)]
    policies = [name for name in dict.fromkeys([*DEFAULT_POLICIES, *held]) if name in held]
    tables = [scenario_table(results, scenario, policies, seeds) for scenario in scenarios]
    path = results.folder / "table.md"
    texts = [
        f"## {table.title}\n\n{markdown_table([*table.rows[0]], [[*row.values()] for row in table.rows])}"
        for table in tables
    ]
    captions = dict.fromkeys(table.caption() for table in tables)
    write_text(path, "\n".join([*texts, *(f"{caption}\n" for caption in captions)]))
    with writing(results.folder / "figures"):
        return tables, [path, *(figure for s in scenarios for figure in draw_all(results, s.name, policies, seeds))]
