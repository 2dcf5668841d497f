"""``uuv-marl export``: a policy for other runtimes."""

from pathlib import Path
from typing import Annotated

import typer

from uuv_marl.cli.console import console, explained, extra, path_argument


def export(
    policy: Annotated[
        str, typer.Argument(help="Checkpoint of a training (file or folder), or a name: mappo, scout, guarded:mappo.")
    ],
    output: Annotated[Path, path_argument("ONNX file.")],
    scenario: Annotated[
        str, typer.Option(help="Name or TOML file; the model keeps its sonar suite, vehicle and decision period.")
    ] = "random_field",
    num_vehicles: Annotated[
        int | None,
        typer.Option(
            min=1,
            help="Vehicles of the swarm, on which the gains of policies with memory depend. Default: those of the "
            "scenario.",
        ),
    ] = None,
) -> None:
    """Write a policy as an ONNX model, from an agent's observation to its action. Needs the extra "onnx".

    The memory of a policy is inputs and outputs of the model: kept_... before a decision, next_... after it.

    Example: uuv-marl export runs/mappo/best policy.onnx
    """
    with explained():
        with extra("onnx", "export to ONNX"):
            from uuv_marl.baselines.export import write_onnx

        from uuv_marl.scenario import load_scenario

        write_onnx(policy, load_scenario(scenario, num_vehicles=num_vehicles), output)
        console.print(f"Model: {output}")
