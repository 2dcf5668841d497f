"""``uuv-marl export``: a network as an ONNX model, or the episodes of a policy as a data set."""

from pathlib import Path
from typing import Annotated, Any

import typer

from uuv_marl.cli.console import (
    changes_of,
    explained,
    extra,
    find_modules,
    overrides_option,
    path_argument,
    progress_line,
    say,
    working,
)  # fmt: skip


def export(
    policy: Annotated[str, typer.Argument(help="Name, checkpoint (runs/starter/best) or module:Class.")],
    output: Annotated[Path, path_argument("An ONNX file (.onnx), or a folder for data sets.")],
    scenario: Annotated[
        str | None, typer.Option(help="Name or TOML file. Default: the training's; for controllers starter.")
    ] = None,
    seeds: Annotated[
        int | None,
        typer.Option(
            min=1, max=800_000, help="Worlds of a data set: from seed 100000 on, which no table has. Default: 20."
        ),
    ] = None,
    overrides: Annotated[list[str] | None, overrides_option("`swarm.num_vehicles=10`, for a data set")] = None,
    max_gb: Annotated[
        float | None, typer.Option(min=0.001, help="Limit of a data set's size in GB. Default: 5.")
    ] = None,
) -> None:
    """Write a network as an ONNX model, or the episodes of any policy as a data set for Minari and as Parquet.

    The model (extra "onnx") maps an agent's observation as closeness, and a memory's state, to its action.
    Controllers, filters and residual policies can't be written as a model.

    A data set (extra "data") holds the observations, actions and rewards of every vehicle, an episode each. It goes to
    OUTPUT/uuv_marl/SCENARIO/POLICY-v0: data is Minari's (MINARI_DATASETS_PATH=OUTPUT), worlds has a Parquet file for
    each seed. Ctrl-C keeps the finished worlds, and the same command continues.

    Example: uuv-marl export runs/starter/best policy.onnx

    Example: uuv-marl export scout data --scenario hard_water --seeds 100
    """
    with explained():
        from uuv_marl.baselines.learned.trained import Trained
        from uuv_marl.baselines.registry import policy_class

        find_modules([policy, scenario or "", *(overrides or [])])
        kind = policy_class(policy)
        training = kind.checkpoint.card.training if isinstance(kind, Trained) else {}
        name = scenario or training.get("scenario", "starter")
        own = training.get("overrides", {}) if scenario is None else {}
        if output.suffix == ".onnx":
            given = {"--seeds": seeds, "--set": overrides, "--max-gb": max_gb}
            if unused := next((option for option, value in given.items() if value is not None), None):
                raise typer.BadParameter(
                    f"{unused} is for data sets; leave it out, or give a folder instead of {output}"
                )
            _write_model(policy, output, name, own)
        else:
            _write_data_set(policy, output, name, {**own, **changes_of(overrides or [])}, seeds or 20, max_gb or 5.0)


def _write_model(policy: str, output: Path, scenario: str, own: dict[str, Any]) -> None:
    with extra("onnx", "export to ONNX"):
        from uuv_marl.baselines.learned.export import write_onnx

    from uuv_marl.scenario import load_scenario
    from uuv_marl.train.training import overrides_for

    write_onnx(policy, load_scenario(scenario, overrides=overrides_for(scenario, own)), output)
    say(f"Model: {output}")


def _write_data_set(
    policy: str, output: Path, scenario: str, changes: dict[str, object], seeds: int, max_gb: float
) -> None:
    from uuv_marl.data.write import FIRST_SEED, write_data_set
    from uuv_marl.scenario import load_scenario

    loaded = load_scenario(scenario, overrides=changes)
    with working(f"The finished worlds are in {output}") as bar:
        report = progress_line(bar, f"{loaded.name}: {policy}")
        wanted = range(FIRST_SEED, FIRST_SEED + seeds)
        done = write_data_set(output, policy, loaded, wanted, max_gb=max_gb, report=report)
    say(f"Data set: {done.folder}   decisions: {done.decisions:,}   about {done.size / 1e6:,.0f} MB")
    say(f'In Python, with MINARI_DATASETS_PATH={output}: minari.load_dataset("{done.name}")')
