"""``python -m research.tasks.learn``: Stable-Baselines3's PPO, from the sonar alone, in fifteen minutes."""

# pyright: reportUnknownMemberType=false, reportUnknownVariableType=false, reportUnknownParameterType=false
# Stable-Baselines3 leaves the types of observations and spaces open.

import time
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Annotated

import numpy as np
import torch
import typer
from stable_baselines3 import PPO
from stable_baselines3.common.callbacks import BaseCallback
from stable_baselines3.common.vec_env import VecEnvWrapper

from research import FOLDER
from research.episodes import Row, write_rows
from research.tasks.studies import SEEDS, STUDIES
from uuv_marl.cli.console import console, explained, path_option, progress_line, working
from uuv_marl.envs.core import make_batched_env
from uuv_marl.envs.observation import Observe, observation_layout
from uuv_marl.envs.sb3 import SwarmVecEnv
from uuv_marl.errors import ResultsError
from uuv_marl.scenario import Scenario, load_scenario
from uuv_marl.types import Bool, Float32, Float64

OBSERVE: Observe = "closeness"
TRAINING_SEEDS, VALIDATION_SEEDS, VALIDATED = 100_000, 900_000, 32
"""First seed of a training, first seed on which its curve is measured, and how many."""
STEPS = 64
"""Decisions of each world between two updates."""
app = typer.Typer(add_completion=False)


def sight(scenario: Scenario, blind: bool) -> Float32:
    """Factors of an observation's entries: 0 for those of echoes, if blind, else 1; shape (entry,)."""
    layout = observation_layout(scenario, OBSERVE)
    names = np.repeat([field.name.startswith("echo") for field in layout.table], [f.size for f in layout.table])
    return np.where(names & blind, 0.0, 1.0).astype(np.float32)


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


def judged(model: PPO, scenario: Scenario, seen: Float32, first: int, episodes: int) -> Float64:
    """Share of the vehicles that succeed, shape (episode,), over seeds from ``first`` on, without noise."""
    env = make_batched_env(scenario, episodes, observe=OBSERVE, keep_terms=False)
    observation, share = env.reset(first), np.zeros(episodes)
    while not env.over.all():
        running = ~env.over
        action, _ = model.predict((observation * seen).reshape(-1, len(seen)), deterministic=True)
        observation = env.step(action.reshape(episodes, -1, 2)).observation
        ended = running & env.over
        share[ended] = env.task.succeeded()[ended].mean(axis=1)
    return share


class Budget(BaseCallback):
    """Ends a training after so many minutes of processor time, and measures it fifteen times on the way."""

    def __init__(self, minutes: float, measure: Callable[[PPO], Float64], report: Callable[[float], None]) -> None:
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
            share = self._measure(self.model)  # pyright: ignore[reportArgumentType]
            self._apart += time.process_time() - begin
            self.curve.append({
                "minutes": f"{spent:.2f}", "agent_steps": str(self.num_timesteps),
                "untouched_share": f"{share.mean():.4f}", "whole": f"{(share == 1.0).mean():.4f}",
            })  # fmt: skip


def learn(task: str, seed: int, blind: bool, minutes: float, report: Callable[[float], None]) -> tuple[PPO, list[Row]]:
    """A model trained on a task, and its curve."""
    torch.set_num_threads(1)
    study = STUDIES[task]
    scenario = load_scenario(study.learns)
    seen = sight(scenario, blind)
    budget = Budget(minutes, lambda model: judged(model, scenario, seen, VALIDATION_SEEDS, VALIDATED), report)
    model = PPO(
        "MlpPolicy", Sighted(SwarmVecEnv(scenario, study.worlds, observe=OBSERVE), seen),
        learning_rate=lambda _: 1e-3 * budget.left(), n_steps=STEPS, batch_size=4096, n_epochs=4,
        policy_kwargs={"net_arch": [64, 64], "log_std_init": -0.7}, seed=TRAINING_SEEDS + 1000 * seed, device="cpu",
    )  # fmt: skip
    return model.learn(10**9, callback=budget), budget.curve


@app.command()
def main(
    task: Annotated[str, typer.Argument(help="hard_water or two_swarms.")],
    seed: Annotated[int, typer.Option(min=0, help="Of the training.")] = 0,
    blind: Annotated[bool, typer.Option("--blind", help="Train with all echoes zeroed.")] = False,
    minutes: Annotated[float, typer.Option(min=0.1, help="Processor time of the training.")] = 15.0,
    output: Annotated[Path, path_option("Folder that research.tasks writes to.")] = Path("results/tasks"),
) -> None:
    """Train PPO on a task's scenario, and run it in the episodes of the tables.

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
        model.save(folder / "model")
        names = {folder.name: blind, **({} if blind else {f"zeroed-{seed}": True})}
        episodes = [row for name, unseen in names.items() for row in _rows(model, task, name, unseen)]
        write_rows(folder / "episodes.csv", episodes)
        console.print(f"  {folder}", highlight=False)


def _rows(model: PPO, task: str, name: str, unseen: bool) -> Iterator[Row]:
    """Episodes of a model on the sets that it is judged on."""
    study = STUDIES[task]
    for each in study.judged:
        scenario = load_scenario(study.sets[each].scenario, overrides=study.sets[each].overrides)
        for seed, share in enumerate(judged(model, scenario, sight(scenario, unseen), 0, SEEDS)):
            yield {"learner": name, "set": each, "seed": str(seed), "untouched_share": f"{share:.3f}"}


if __name__ == "__main__":
    app()
