"""``uuv-marl replay``: an episode as a page for the browser, or as a film."""

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from uuv_marl.cli.console import (
    changes_of,
    explained,
    find_modules,
    overrides_option,
    path_option,
    progress_line,
    say,
    working,
)  # fmt: skip
from uuv_marl.replay import FILMS, MOST_EPISODES

if TYPE_CHECKING:
    from rich.progress import Progress

    from uuv_marl.replay.recording import Recording


def replay(
    scenario: Annotated[str, typer.Option(help="Name or TOML file.")] = "single_obstacle",
    policy: Annotated[
        list[str] | None,
        typer.Option(
            help="Name, checkpoint (runs/starter/best) or module:Class. Repeat it for up to four side by side. "
            "Default: bio_inspired."
        ),
    ] = None,
    seed: Annotated[int, typer.Option(min=0, help="Seed of the episode, for all policies.")] = 0,
    inspect: Annotated[
        list[int] | None,
        typer.Option(min=0, metavar="VEHICLE", help="Show this vehicle's sonar too. Repeat it for up to eight."),
    ] = None,
    overrides: Annotated[list[str] | None, overrides_option("`swarm.num_vehicles=200`")] = None,
    output: Annotated[
        Path | None,
        path_option("A page (.html), a film (.mp4, .gif) or a picture (.png). Default: a page in results/replay."),
    ] = None,
) -> None:
    """Show an episode: as one HTML file that works offline in any browser, or as a film.

    The page has a time line with collisions and near misses, trails, zoom and plots.

    Example: uuv-marl replay --policy bio_inspired --policy sff --seed 3 --inspect 7

    Example: uuv-marl replay --policy sff --output sff.mp4
    """
    with explained():
        from uuv_marl.atomic import writing
        from uuv_marl.errors import ReplayError

        is_film = _is_film(output, inspect or [])
        policies = list(dict.fromkeys(policy or ["bio_inspired"]))
        if len(policies) > MOST_EPISODES:
            raise ReplayError(f"at most {MOST_EPISODES} policies can be shown side by side, got {len(policies)}")
        with working("Nothing was written") as bar:
            recordings = _simulated(scenario, policies, seed, inspect or [], overrides or [], bar)
            path = output or _default(recordings, overrides or [])
            with writing(path):
                path.parent.mkdir(parents=True, exist_ok=True)
            report = progress_line(bar, "writing")
            if is_film:
                from uuv_marl.replay.film import write_film

                write_film(recordings, path, sonar_of=inspect[0] if inspect else None, progress=report)
            else:
                from uuv_marl.replay.page import write_page

                write_page(recordings, path)
            report(1.0)
        say(f"Replay: {path} ({path.stat().st_size / 1000:,.0f} kB)")


def _is_film(output: Path | None, inspect: Sequence[int]) -> bool:
    """Whether a file of this suffix is a film. Raises ReplayError before anything is simulated."""
    from uuv_marl.errors import ReplayError

    suffix = ".html" if output is None else output.suffix.lower()
    if suffix not in (".html", *FILMS):
        raise ReplayError(f"--output {output} must end in {', '.join(('.html', *FILMS[:-1]))} or {FILMS[-1]}")
    if suffix == ".html":
        return False
    if len(inspect) > 1:
        raise ReplayError(f"a film shows the sonar of one vehicle, got {len(inspect)}; give one --inspect, or .html")
    from uuv_marl.replay.film import check_format

    check_format(Path(f"film{suffix}"))
    return True


def _default(recordings: "Sequence[Recording]", overrides: Sequence[str]) -> Path:
    from uuv_marl.benchmark.results import file_name

    first, policies = recordings[0], "-".join(recording.policy for recording in recordings)
    return Path("results/replay") / f"{file_name(f'{first.scenario.name}.{policies}.{first.seed}', overrides)}.html"


def _simulated(
    name: str, policies: Sequence[str], seed: int, inspect: Sequence[int], overrides: Sequence[str], bar: "Progress"
) -> "list[Recording]":  # fmt: skip
    """An episode of each policy on the same seed; errors of all are raised before the first is simulated."""
    from uuv_marl.baselines import make_policy, with_policy_requirements
    from uuv_marl.replay.record import checked, record
    from uuv_marl.scenario import load_scenario

    find_modules([name, *policies, *overrides])
    scenario = load_scenario(name, overrides=changes_of(overrides))
    checked(inspect, scenario)
    for policy in policies:
        make_policy(policy, with_policy_requirements(policy, scenario))
    recordings: list[Recording] = []
    for policy in policies:
        report = progress_line(bar, f"{scenario.name}: {policy}")
        recordings.append(record(scenario, policy, seed, inspect, report))
        report(1.0)
    return recordings
