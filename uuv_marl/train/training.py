"""A training from its settings: iterations, validation, TensorBoard, and files from which it goes on exactly.

``config.json``, ``progress.csv`` and ``checkpoints/`` as ``uuv_marl.train.folder`` keeps them; ``best/``, the policy of
the best validation, or of the last one (``Settings.chosen``); ``tensorboard/``. Needs ``train``.
"""

import json
import shutil
import time
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from dataclasses import asdict, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np
import safetensors.numpy
from numpy.typing import NDArray

from uuv_marl.atomic import writing
from uuv_marl.baselines.learned.checkpoint import WEIGHTS_FILE, Card, rows_of, save_checkpoint, vehicle_of
from uuv_marl.baselines.learned.percept_features import BARRIER
from uuv_marl.errors import ResultsError
from uuv_marl.extras import extra
from uuv_marl.paths import UserPath, user_path
from uuv_marl.percept import PerceptLayout
from uuv_marl.scenario import conditions
from uuv_marl.scenario.overrides import plain
from uuv_marl.train.env import EpisodeStats
from uuv_marl.train.folder import Say, begun_with, opened, quiet, versions
from uuv_marl.train.group import Problem
from uuv_marl.train.mappo import Mappo
from uuv_marl.train.settings import Settings
from uuv_marl.train.validation import ValidationResult, validate

with extra("train", "training"):
    import torch
    from torch.utils.tensorboard.writer import SummaryWriter

if TYPE_CHECKING:
    from uuv_marl.train import ppo

_LIBRARIES = ("torch", "stable-baselines3", "numpy", "numba", "safetensors")
_LEARNER_FILE, _WORLDS_FILE, _RANDOM_FILE = "learner.safetensors", "worlds.safetensors", "random.json"


class Record(NamedTuple):
    """One iteration, a row of ``progress.csv``."""

    iteration: int = 0
    agent_steps: int = 0
    seconds: float = 0.0
    """Spent on training and validation so far."""
    reward: float | None = None
    """Mean per decision and vehicle, of this iteration's samples."""
    kl: float | None = None
    """Divergence from the policy that sampled to the one that learned."""
    explained: float | None = None
    """Share of the returns' variance that the critic explains."""
    best: float | None = None
    """Score of the best validation so far."""
    score: float | None = None
    """Score of this iteration's validation, None without one. The fields below are of this validation, too."""
    arrived: float | None = None
    collisions: int | None = None
    lateness_s: float | None = None
    min_spacing_m: float | None = None
    min_obstacle_distance_m: float | None = None


class Trainer:
    """An algorithm at work, and how it is kept on disk.

    Args:
        settings: of the training.
        device: torch's name of where networks and batches are; worlds are on the CPU.
        checkpoint: where to go on, see ``restore``; else the training begins, from ``settings.start`` if there is one.
    """

    def __init__(self, settings: Settings, device: str = "cpu", checkpoint: Path | None = None) -> None:
        self.settings = settings
        self.scenario = settings.load()
        self.algorithm: Mappo | ppo.Ppo = settings.algorithm.begin(
            Problem(
                self.scenario,
                settings.sizes,
                settings.paid(),
                settings.sees,
                settings.change_cost,
                settings.held_s,
                settings.law,
                settings.safety,
                settings.trims,
                settings.conditions,
            ),
            settings.seed,
            device,
        )
        if checkpoint is not None:
            self.restore(checkpoint)
        elif settings.start is not None:
            remedy = "give a folder best or a checkpoint of the same algorithm and sizes of network"
            with _reading(user_path(settings.start) / _LEARNER_FILE, remedy) as data:
                self.algorithm.start_from(_learned(data))

    def iterate(self, before: Record) -> Record:
        """Sample and update once."""
        started = time.perf_counter()
        reward, update = self.algorithm.iterate(before.agent_steps / self.settings.steps)
        return Record(
            iteration=before.iteration + 1,
            agent_steps=before.agent_steps + self.algorithm.agent_steps,
            seconds=before.seconds + time.perf_counter() - started,
            reward=reward,
            kl=update.kl,
            explained=update.explained,
            best=before.best,
        )

    def save(self, folder: Path, record: Record) -> None:
        """All that ``restore`` needs, and the policy."""
        folder.mkdir(parents=True, exist_ok=True)
        self.save_policy(folder, record)
        (folder / _WORLDS_FILE).write_bytes(safetensors.numpy.save(self.algorithm.snapshot()))
        (folder / _RANDOM_FILE).write_text(json.dumps(self.algorithm.random) + "\n", encoding="utf-8")

    def save_policy(self, folder: Path, record: Record) -> None:
        """The policy, and the learner that a later training may start from."""
        training = plain({**asdict(self.settings), "versions": versions(_LIBRARIES), "record": record._asdict()})
        card = Card(
            percept=rows_of(PerceptLayout.of(self.scenario)),
            yaw_damping_nms=self.scenario.actuators.yaw_damping_nms,
            channels=self.scenario.sonar.channels,
            features=self.settings.sees,
            barrier=BARRIER,
            law=self.settings.law,
            trims=self.settings.trims,
            safety=self.settings.safety,
            vehicle=vehicle_of(self.scenario),
            training=training,
        )
        save_checkpoint(folder / WEIGHTS_FILE, card, self.algorithm.layers)
        (folder / _LEARNER_FILE).write_bytes(safetensors.numpy.save(self.algorithm.arrays()))

    def restore(self, folder: Path) -> None:
        """Go on from what ``save`` wrote, as if there had been no break. Raises ResultsError naming a damaged file."""
        remedy = "copy the checkpoint again as a whole, or give --start with a policy and another --output"
        with _reading(folder / _LEARNER_FILE, remedy) as data:
            self.algorithm.restore(_learned(data))
        with _reading(folder / _WORLDS_FILE, remedy) as data:
            self.algorithm.put_back(safetensors.numpy.load(data))
        with _reading(folder / _RANDOM_FILE, remedy) as data:
            self.algorithm.random = json.loads(data)


def train(
    output: UserPath,
    settings: Settings | None = None,
    *,
    resume: bool = False,
    device: str = "cpu",
    say: Say = quiet,
    stop: Callable[[], bool] = lambda: False,
) -> Iterator[Record]:
    """Train to ``settings.steps``; a record for each iteration.

    Closing the iterator, an interrupt or a kill leaves the last checkpoint, from which ``resume`` gives what would have
    come without the break, on the CPU bit for bit (of a GPU, PPO's generator of noise is not kept). Uses two threads of
    torch: actor and critic learn side by side.

    Args:
        output: a new or empty folder, or with ``resume`` that of an earlier training.
        settings: the default ones if None; a resume needs the same, but for more steps: it goes on to them, with noise
            and rates as they were at the end.
        resume: go on from the last checkpoint.
        device: torch's name of where networks and batches are (cpu, cuda); may change at a resume.
        say: told on what is trained, and from where a resume goes on.
        stop: asked after every iteration; where it says so, the training ends with a checkpoint.

    Raises:
        ResultsError: the folder is used, by another process too, holds no training of these settings, or can't be
            written; the last checkpoint is whole.
        RewardError: the reward can't be imported, or gives what is no reward.
    """
    output, settings = user_path(output), settings or Settings()
    until = settings.steps
    if resume:
        settings = replace(settings, steps=min(until, begun_with(output).get("steps", until)))
    scenario = settings.load()
    described = {**asdict(settings), "scenario": scenario.model_dump(mode="json")}
    with opened(output, described, resume, Record(), say) as folder, one_thread():
        record, stopped = folder.record, False
        if record.agent_steps >= until:
            return
        sizes = ", ".join(f"{n} vehicles ({worlds} worlds)" for n, worlds in settings.sizes)
        own = f"{len(settings.conditions)} conditions, an episode each" if settings.conditions else conditions(scenario)
        say(f"Training on swarms of {sizes}; {own}.")
        trainer = Trainer(settings, device, folder.checkpoint)
        folder.begin({"seed": settings.seed, "steps": until, "device": device}, _LIBRARIES)
        # TensorBoard hides what was written from the purge step on: what a break has left after the checkpoint.
        with writing(output), SummaryWriter(str(output / "tensorboard"), purge_step=record.agent_steps + 1) as board:
            while record.agent_steps < until and not stopped:
                record = trainer.iterate(record)
                episodes = trainer.algorithm.pop_episode_stats()
                done = record.agent_steps >= until
                if done or record.iteration % settings.validate_every == 0:
                    record = _validated(trainer, record, output)
                folder.note(record)
                stopped = stop()
                if done or stopped or record.iteration % settings.checkpoint_every == 0:
                    folder.keep(record, lambda path, record=record: trainer.save(path, record))
                _show(board, record, episodes)
                yield record


@contextmanager
def one_thread() -> Iterator[None]:
    """Torch computes on one thread in this block: sums in another order give other bits."""
    before = torch.get_num_threads()
    torch.set_num_threads(1)
    try:
        yield
    finally:
        torch.set_num_threads(before)


def _validated(trainer: Trainer, record: Record, output: Path) -> Record:
    """The record with a validation of the policy as it stands, which becomes ``best`` where it is."""
    started, settings = time.perf_counter(), trainer.settings
    candidate, best = output / "candidate", output / "best"
    trainer.save_policy(candidate, record)
    result: ValidationResult = validate(
        candidate, settings.load_for_validation(), settings.validation, settings.validation_conditions
    )
    better = settings.chosen == "last" or record.best is None or result.score > record.best
    record = record._replace(
        seconds=record.seconds + time.perf_counter() - started,
        best=result.score if better else record.best,
        **result._asdict(),
    )
    if better:
        trainer.save_policy(candidate, record)
        best.mkdir(exist_ok=True)
        for file in (_LEARNER_FILE, WEIGHTS_FILE):
            (candidate / file).replace(best / file)
    shutil.rmtree(candidate)
    return record


def _show(board: SummaryWriter, record: Record, episodes: EpisodeStats) -> None:
    """Numbers for TensorBoard; of episodes the means."""
    numbers = {f"train/{name}": getattr(record, name) for name in ("reward", "kl", "explained")}
    numbers |= {f"validation/{name}": getattr(record, name) for name in ("best", *ValidationResult._fields)}
    if episodes.number:
        names = {"returns": "return", "arrived": "arrived", "collisions": "collisions", "decisions": "decisions"}
        numbers |= {f"episodes/{tag}": getattr(episodes, name) / episodes.number for name, tag in names.items()}
    for name, value in numbers.items():
        if value is not None:
            board.add_scalar(name, value, record.agent_steps)


@contextmanager
def _reading(path: Path, remedy: str) -> Iterator[bytes]:
    """Turn whatever data from outside can cause into one message that names the file."""
    try:
        yield path.read_bytes()
    except Exception as error:
        reason = " ".join(str(error).split())
        raise ResultsError(f"{path} can't be used ({type(error).__name__}: {reason}); {remedy}") from error


def _learned(data: bytes) -> Mapping[str, NDArray[Any]]:
    arrays = safetensors.numpy.load(data)
    spoilt = [name for name, array in arrays.items() if not np.isfinite(array).all()]
    if spoilt:
        raise ValueError(f"{spoilt[0]} must hold finite numbers")
    return arrays
