"""``python -m research.tasks.learn``: Stable-Baselines3's PPO, plain or recurrent, from the sonar alone."""

# pyright: reportUnknownMemberType=false, reportUnknownVariableType=false, reportUnknownParameterType=false
# Stable-Baselines3 leaves the types of observations and spaces open.

import time
from collections.abc import Callable, Iterator, Sequence
from pathlib import Path
from typing import Annotated, Any

import numpy as np
import torch
import typer
from sb3_contrib import RecurrentPPO
from stable_baselines3 import PPO
from stable_baselines3.common.callbacks import BaseCallback
from stable_baselines3.common.vec_env import VecEnvWrapper

from research import FOLDER
from research.episodes import Row, cells, measured, write_rows
from research.sets import DIGITS
from research.tasks.learner import OBSERVE, sight
from research.tasks.studies import SEEDS, STUDIES
from uuv_marl.benchmark.evaluate import Run, evaluate
from uuv_marl.cli.console import console, explained, path_option, progress_line, working
from uuv_marl.envs.sb3 import SwarmVecEnv
from uuv_marl.errors import ResultsError
from uuv_marl.scenario import Scenario, load_scenario
from uuv_marl.types import Bool, Float32

TRAINING_SEEDS, VALIDATION_SEEDS = 100_000, range(900_000, 900_032)
"""First seed of a training, and seeds on which its curve is measured."""
STEPS = 64
"""Decisions of each world between two updates."""
app = typer.Typer(add_completion=False)


class Sighted(VecEnvWrapper):
    """An environment whose observations are multiplied by ``sight``."""

    def __init__(self, env: SwarmVecEnv, seen: Float32) -> None:
        super().__init__(env)
        self._seen = seen

    def reset(self) -> Float32:
        """The first observations."""
        return np.asarray(self.venv.reset()) * self._seen

    def step_wait(self) -> tuple[Float32, Float32, Bool, list[dict[str, object]]]:
        """Also the last observation of an episode is multiplied."""
        observation, reward, done, infos = self.venv.step_wait()
        for row in np.flatnonzero(done):
            infos[row]["terminal_observation"] = infos[row]["terminal_observation"] * self._seen
        return np.asarray(observation) * self._seen, reward, done, infos


def judged(model: Any, scenario: Scenario, blind: bool, seeds: Sequence[int]) -> Iterator[Run]:
    """Episodes of a model, without noise."""
    for event in evaluate(scenario, "research.tasks.learner:Learner", seeds, model=model, blind=blind):
        if isinstance(event, Run):
            yield event


class Budget(BaseCallback):
    """Ends a training after so many minutes of processor time, and measures it fifteen times on the way."""

    def __init__(self, minutes: float, measure: Callable[[Any], Row], report: Callable[[float], None]) -> None:
        super().__init__()
        self.curve: list[Row] = []
        self._minutes, self._measure, self._report, self._apart = minutes, measure, report, 0.0
        self._start = time.process_time()

    def _on_training_start(self) -> None:
        self._start = time.process_time()

    def _spent(self) -> float:
        return (time.process_time() - self._start - self._apart) / 60.0

    def left(self) -> float:
        """The share of the time that is left."""
        return max(1.0 - self._spent() / self._minutes, 0.0)

    def _on_step(self) -> bool:
        return self._spent() < self._minutes

    def _on_rollout_start(self) -> None:
        self._report(self._spent() / self._minutes)
        if self._spent() >= self._minutes * len(self.curve) / 15:
            begin, spent = time.process_time(), self._spent()
            row = {"minutes": f"{spent:.2f}", "agent_steps": str(self.num_timesteps)}
            self.curve.append({**row, **self._measure(self.model)})
            self._apart += time.process_time() - begin


def learn(task: str, seed: int, blind: bool, minutes: float, report: Callable[[float], None]) -> tuple[Any, list[Row]]:
    """A model trained on a task, and its curve."""
    torch.set_num_threads(1)
    study = STUDIES[task]
    scenario = load_scenario(study.learns)

    def measure(model: Any) -> Row:
        """The headline on maps of validation."""
        rows = [cells(run.metrics, study.metrics, DIGITS) for run in judged(model, scenario, blind, VALIDATION_SEEDS)]
        return {name: f"{np.mean(measured(rows, name)):.4f}" for name in (study.headline, "whole")}

    budget = Budget(minutes, measure, report)
    env = Sighted(SwarmVecEnv(scenario, study.worlds, observe=OBSERVE), sight(scenario, blind))
    kind, policy = (RecurrentPPO, "MlpLstmPolicy") if study.memory else (PPO, "MlpPolicy")
    own = {"lstm_hidden_size": 64, "enable_critic_lstm": False, "shared_lstm": True} if study.memory else {}
    model = kind(
        policy, env, learning_rate=lambda _: 1e-3 * budget.left(), n_steps=STEPS, batch_size=4096, n_epochs=4,
        policy_kwargs={"net_arch": [64, 64], "log_std_init": -0.7, **own}, seed=TRAINING_SEEDS + 1000 * seed,
        device="cpu",
    )  # fmt: skip
    return model.learn(10**9, callback=budget), budget.curve


@app.command()
def main(
    task: Annotated[str, typer.Argument(help=f"One of {', '.join(STUDIES)}.")],
    seed: Annotated[int, typer.Option(min=0, help="Of the training.")] = 0,
    blind: Annotated[bool, typer.Option("--blind", help="Train with all echoes zeroed.")] = False,
    minutes: Annotated[float, typer.Option(min=0.1, help="Processor time of the training.")] = 15.0,
    output: Annotated[Path, path_option("Folder that research.tasks writes to.")] = Path("results/tasks"),
) -> None:
    """Train PPO on a task's scenario, or RecurrentPPO where the study has a memory, and run it in the tables' episodes.

    A sighted model is also run with its echoes zeroed. The time of a training is the processor's, and its measuring
    does not count. OUTPUT/learned/TASK gets a folder with model.zip, curve.csv and episodes.csv.

    Example: python -m research.tasks.learn hard_water --seed 1 --blind
    """
    with explained(FOLDER):
        if task not in STUDIES:
            raise ResultsError(f"task must be one of {', '.join(STUDIES)}, got {task!r}")
        folder = output / "learned" / task / f"{'blind' if blind else 'sighted'}-{seed}"
        with working(f"Nothing is kept of a training that did not end; {folder} stays as it was") as bar:
            model, curve = learn(task, seed, blind, minutes, progress_line(bar, folder.name))
        write_rows(folder / "curve.csv", curve)
        model.save(folder / "model", exclude=["learning_rate", "lr_schedule"])  # which know the clock
        names = {folder.name: blind, **({} if blind else {f"zeroed-{seed}": True})}
        episodes = [row for name, unseen in names.items() for row in _rows(model, task, name, unseen)]
        write_rows(folder / "episodes.csv", episodes)
        console.print(f"  {folder}", highlight=False)


def _rows(model: Any, task: str, name: str, blind: bool) -> Iterator[Row]:
    """Episodes of a model on the sets that it is judged on."""
    study = STUDIES[task]
    for each in study.judged:
        scenario = load_scenario(study.sets[each].scenario, overrides=study.sets[each].overrides)
        for run in judged(model, scenario, blind, range(SEEDS)):
            yield {"learner": name, "set": each, "seed": str(run.seed), **cells(run.metrics, study.metrics, DIGITS)}


if __name__ == "__main__":
    app()
