"""``uuv-marl train``: a command for each library."""

from dataclasses import replace
from pathlib import Path
from typing import Annotated, Any

import typer

from uuv_marl.cli.console import console, explained, extra, progress_bar

app = typer.Typer(help="Train a policy; each command is named after its library.", no_args_is_help=True)


Scenario = Annotated[str, typer.Option(help="Name or TOML file.")]
Steps = Annotated[
    int, typer.Option(min=1, help="Agent-steps in all: decisions times vehicles. Noise and rates anneal over them.")
]
Seed = Annotated[int, typer.Option(min=0, help="Of worlds, weights and noise: one seed, one training.")]
Start = Annotated[
    Path | None, typer.Option(help="Start from the weights of another training: its best, or a checkpoint.")
]
Output = Annotated[Path, typer.Option(help="Folder of settings, progress, checkpoint and best.")]
Resume = Annotated[bool, typer.Option("--resume", help="Go on from the folder's last checkpoint.")]


@app.command("mappo")
def train_mappo(
    scenario: Scenario = "random_field",
    steps: Steps = 30_000_000,
    seed: Seed = 0,
    start: Start = None,
    noise: Annotated[
        tuple[float, float] | None,
        typer.Option(min=1e-3, help="Of actions, at the start and at the end [full force]. Default: 0.4 0.08."),
    ] = None,
    rate: Annotated[
        tuple[float, float] | None,
        typer.Option(min=0.0, help="The actor's learning rate, at the start and at the end. Default: 0.0015 0.00015."),
    ] = None,
    output: Output = Path("results/mappo"),
    resume: Resume = False,
) -> None:
    """Train one policy for all vehicles with MAPPO, on swarms of 10 to 100 at once, on one core.

    Vehicles decide every 0.5 s, with yaw damping. Needs the extra "train". Writes config.json (settings, seeds,
    versions), progress.csv, checkpoints/, tensorboard/ and best/, the policy that did best on validation seeds: give it
    to uuv-marl benchmark as --policy. Ctrl-C or a kill keeps the last checkpoint; the same command with --resume goes
    on exactly.

    Example: uuv-marl train mappo --output runs/mappo
    """
    with explained():
        with extra("train", "training with MAPPO"):
            from uuv_marl.train.mappo import Hyperparameters

        by = Hyperparameters()
        algorithm = replace(by, noise=noise or by.noise, learning_rate=rate or by.learning_rate)
        _train(output, resume, scenario=scenario, steps=steps, seed=seed, start=start, algorithm=algorithm)


@app.command("ppo")
def train_ppo(
    scenario: Scenario = "random_field",
    steps: Steps = 30_000_000,
    seed: Seed = 0,
    start: Start = None,
    output: Output = Path("results/ppo"),
    resume: Resume = False,
) -> None:
    """Train one policy for all vehicles with Stable-Baselines3's PPO, on swarms of 10 to 100 at once, on one core.

    Problem, files and habits are those of uuv-marl train mappo: the critic sees what the actor sees, and noise is
    learned. Needs the extra "train".

    Example: uuv-marl train ppo --output runs/ppo
    """
    with explained():
        with extra("train", "training with Stable-Baselines3"):
            from uuv_marl.train.ppo import Hyperparameters

        algorithm = Hyperparameters()
        _train(output, resume, scenario=scenario, steps=steps, seed=seed, start=start, algorithm=algorithm)


def _train(output: Path, resume: bool, *, steps: int, start: Path | None, **settings: Any) -> None:
    """Train with these settings, and show how it goes."""
    from uuv_marl.train.training import Settings, train

    settings["start"] = None if start is None else str(start)
    records = train(output, Settings(steps=steps, **settings), resume=resume)
    last, validated = "no iteration was needed: --steps are done already", ""
    try:
        with progress_bar() as bar:
            task = bar.add_task("starting", total=steps)
            for record in records:
                rate = f"{record.agent_steps / record.seconds:,.0f} agent-steps/s"
                if record.score is not None:
                    validated = (
                        f", validation: score {record.score:.3f} (best {record.best:.3f}), arrived "
                        f"{record.arrived:.0%}, collisions {record.collisions}"
                    )
                last = f"{rate}, reward {record.reward:.3f}{validated}"
                bar.update(task, completed=record.agent_steps, description=last)
    except KeyboardInterrupt:
        console.print(f"Stopped. The last checkpoint is in {output}; the same command with --resume goes on.")
        raise typer.Exit(130) from None
    console.print(f"Done: {last}. Policy: {output}/best   progress: {output}/progress.csv")


@app.command("rllib")
def train_rllib(
    scenario: Annotated[str, typer.Option(help="Name or TOML file.")] = "single_obstacle",
    num_vehicles: Annotated[int | None, typer.Option(min=1, help="Replaces the scenario's.")] = None,
    steps: Annotated[
        int, typer.Option(min=1, help="Agent-steps in all: decisions times vehicles; whole batches.")
    ] = 1_000_000,
    seed: Annotated[int, typer.Option(min=0, help="Of the first worlds and weights.")] = 0,
    env_runners: Annotated[int, typer.Option(min=0, help="Processes that sample, a core each.")] = 2,
    ray: Annotated[
        str | None, typer.Option(metavar="ADDRESS", help="A Ray cluster (auto: the one here). Default: this machine.")
    ] = None,
    output: Annotated[Path, typer.Option(help="Folder of settings, progress and checkpoint.")] = Path("results/rllib"),
    resume: Annotated[bool, typer.Option("--resume", help="Go on from the folder's last checkpoint.")] = False,
) -> None:
    """Train one policy for all vehicles with RLlib's PPO, on this machine or a Ray cluster.

    Vehicles decide every 0.5 s, with yaw damping. Needs the extra "distributed". Writes config.json (settings, seeds,
    versions), progress.csv (a row per iteration) and checkpoints/. Ctrl-C keeps the last checkpoint; the same command
    with --resume goes on, to more --steps too.

    Example: uuv-marl train rllib --scenario tracking --num-vehicles 8 --steps 200000
    """
    with explained():
        with extra("distributed", "training with RLlib"):
            from uuv_marl.train.rllib import Settings, train

        settings = Settings(scenario=scenario, num_vehicles=num_vehicles, seed=seed)
        records = train(output, steps, settings, num_env_runners=env_runners, address=ray, resume=resume)
        last = "no iteration was needed: --steps are done already"
        console.print("Starting Ray takes about 15 s.")
        try:
            with progress_bar() as bar:
                task = bar.add_task("sampling", total=steps)
                shown = "–"
                for record in records:
                    if record.episode_return is not None:
                        shown = f"{record.episode_return:.1f}"
                    rate = f"{record.agent_steps / record.seconds:,.0f} agent-steps/s"
                    bar.update(task, completed=record.agent_steps, description=f"{rate}, return {shown}")
                    last = f"{record.agent_steps:,} agent-steps, {rate}, last return per vehicle {shown}"
        except KeyboardInterrupt:
            console.print(f"Stopped. The last checkpoint is in {output}; the same command with --resume goes on.")
            raise typer.Exit(130) from None
        console.print(f"Done: {last}. Progress: {output}/progress.csv   checkpoint: {output}/checkpoints")
