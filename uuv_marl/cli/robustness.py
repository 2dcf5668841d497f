"""``uuv-marl robustness``: the effect of currents, sonar errors, lags and faults on each policy."""

from pathlib import Path
from typing import Annotated

import typer

from uuv_marl.cli.console import MANY_POLICIES, Restart, explained, find_modules, path_option, say, working


def robustness(
    quick: Annotated[
        bool, typer.Option("--quick", help="Eight axes, two scenarios, 5 seeds: about ten minutes.")
    ] = False,
    axis: Annotated[
        list[str] | None, typer.Option(help="Only this axis, such as W1 or S7. Repeat it for several. Default: all.")
    ] = None,
    level: Annotated[
        list[int] | None,
        typer.Option(min=1, max=5, help="Only this level. Repeat it for several. Default: 1, 3 and 5."),
    ] = None,
    policy: Annotated[
        list[str] | None,
        typer.Option(
            help=MANY_POLICIES.format(
                "bio_inspired, bio_inspired_plus and mappo; without --quick the strongest of docs/robustness.md."
            )
        ),
    ] = None,
    scenario: Annotated[
        list[str] | None, typer.Option(help="Name or TOML file. Repeat it for several. Default: random_field.")
    ] = None,
    seeds: Annotated[int | None, typer.Option(min=1, max=10_000, help="Seeds 0 to SEEDS - 1. Default: 20.")] = None,
    restart: Restart = False,
    output: Annotated[Path, path_option("Folder for results, page and pictures.")] = Path("results/robustness"),
) -> None:
    """Measure the effect of each disturbance on success: currents, sonar errors, drift, lags, faults.

    Each axis is one disturbance in five levels (uuv_marl/benchmark/robustness/axes.toml, with sources). The command
    writes robustness.md (scores by group and axis), a picture of each scenario (in figures) and episodes.csv (a row for
    each episode) for the given options. Without --quick it runs what docs/robustness.md shows: 30 to 50 minutes of one
    core for each policy with memory. It needs the extra "analysis". Ctrl-C keeps the finished episodes, and the same
    command continues.

    Example: uuv-marl robustness --axis W1 --axis A1 --policy mappo --seeds 5
    """
    with explained():
        from uuv_marl.benchmark.frame import import_pandas
        from uuv_marl.benchmark.robustness import axes, job, page

        import_pandas("uuv-marl robustness")
        plan = job.QUICK if quick else job.SHIPPED
        plan = plan._replace(
            axes=axes.known(axis) if axis else plan.axes,
            levels=sorted(set(level)) if level else plan.levels,
            policies=list(dict.fromkeys(policy)) if policy else plan.policies,
            scenarios=list(dict.fromkeys(scenario)) if scenario else plan.scenarios,
            seeds=seeds or plan.seeds,
        )
        find_modules([*plan.policies, *plan.scenarios])
        with working(f"The finished episodes are in {output}", alone=output) as bar:
            task = bar.add_task("robustness", total=1.0)

            def report(what: str, share: float) -> None:
                bar.update(task, completed=share, description=what[-60:])

            episodes = job.run(output, plan, report, restart=restart)
            written = [*page.write_robustness_report(output), episodes]
            report("robustness", 1.0)
        for path in written:
            say(f"  {path}")
