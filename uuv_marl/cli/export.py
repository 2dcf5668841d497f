"""``uuv-marl export``: a network as an ONNX model."""

from pathlib import Path
from typing import Annotated

import typer

from uuv_marl.cli.console import explained, extra, path_argument, say


def export(
    policy: Annotated[
        str, typer.Argument(help="Name of a network, or checkpoint without filter and base controller, file or folder.")
    ],
    output: Annotated[Path, path_argument("ONNX file.")],
    scenario: Annotated[
        str | None, typer.Option(help="Name or TOML file of a scenario with its observation. Default: the training's.")
    ] = None,
) -> None:
    """Write a network as an ONNX model, from an agent's observation as closeness to its action. Needs the extra "onnx".

    A network with a memory also has its state as input and output. Controllers, filters and residual policies are not
    exported.

    Example: uuv-marl export runs/starter/best policy.onnx
    """
    with explained():
        with extra("onnx", "export to ONNX"):
            from uuv_marl.baselines.learned.export import write_onnx

        from uuv_marl.baselines.learned.trained import Trained
        from uuv_marl.baselines.registry import policy_class
        from uuv_marl.scenario import load_scenario
        from uuv_marl.train.training import overrides_for

        kind = policy_class(policy)
        training = kind.checkpoint.card.training if isinstance(kind, Trained) else {}
        name = scenario or training.get("scenario", "starter")
        own = training.get("overrides", {}) if scenario is None else {}
        write_onnx(policy, load_scenario(name, overrides=overrides_for(name, own)), output)
        say(f"Model: {output}")
