"""``uuv-marl export``: a network for other runtimes."""

from pathlib import Path
from typing import Annotated

import typer

from uuv_marl.cli.console import console, explained, extra, path_argument


def export(
    policy: Annotated[
        str, typer.Argument(help="Checkpoint of a training without memory (file or folder), or a name: mappo, ppo.")
    ],
    output: Annotated[Path, path_argument("ONNX file.")],
    scenario: Annotated[
        str, typer.Option(help="Name or TOML file; the model keeps its sonar suite and vehicle.")
    ] = "random_field",
) -> None:
    """Write a network as an ONNX model, from an agent's observation to its action. Needs the extra "onnx".

    Laws, guarded: and networks around a law are not exported: they remember.

    Example: uuv-marl export runs/mappo/best policy.onnx
    """
    with explained():
        with extra("onnx", "export to ONNX"):
            from uuv_marl.baselines.learned.export import write_onnx

        from uuv_marl.scenario import load_scenario

        write_onnx(policy, load_scenario(scenario), output)
        console.print(f"Model: {output}")
