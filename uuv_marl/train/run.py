"""A training at work: iterations, validation, TensorBoard, and files from which it goes on exactly.

``config.json``, ``progress.csv`` and ``checkpoints/`` as ``uuv_marl.train.folder`` keeps them; ``best/``, the policy of
the best validation, or of the last one (``Training.chosen``); ``tensorboard/``. Needs ``train``.
"""

import json
import shutil
import time
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import numpy as np
import safetensors.numpy
from numpy.typing import NDArray

from uuv_marl.atomic import writing
from uuv_marl.baselines.learned.checkpoint import WEIGHTS_FILE, Card, card_rows, save_checkpoint, vehicle_of
from uuv_marl.baselines.learned.percept_features import BARRIER
from uuv_marl.errors import ResultsError, TrainingError
from uuv_marl.extras import extra
from uuv_marl.paths import UserPath, user_path
from uuv_marl.scenario import conditions
from uuv_marl.train.env import EpisodeStats
from uuv_marl.train.folder import Record, Say, TrainingFolder, opened, quiet, versions
from uuv_marl.train.mappo import Mappo
from uuv_marl.train.training import Training
from uuv_marl.train.validation import ValidationResult, validate

with extra("train", "training"):
    import torch
    from torch.utils.tensorboard.writer import SummaryWriter

_LEARNER_FILE, _WORLDS_FILE, _RANDOM_FILE = "learner.safetensors", "worlds.safetensors", "random.json"

Stop = Callable[[], bool]
"""Asked after every iteration; where it says so, the training ends with a checkpoint."""


def train(
    output: UserPath, training: Training | None = None, *, say: Say = quiet, stop: Stop = lambda: False
) -> Iterator[Record]:
    """Train to ``training.steps``; a record for each iteration.

    Closing the iterator, an interrupt or a kill leaves the last checkpoint, from which ``resume`` gives what would have
    come without the break, on the CPU bit for bit. Uses two threads of torch: actor and critic learn side by side.

    Args:
        output: a new or empty folder.
        training: what is trained, and how; all defaults if None.
        say: told on what is trained.
        stop: asked after every iteration; where it says so, the training ends with a checkpoint.

    Raises:
        ResultsError: the folder is used, by another process too, or can't be written; the last checkpoint is whole.
        RewardError: the reward can't be imported, or gives what is no reward.
        TrainingError: torch can't compute on the device.
    """
    with opened(user_path(output), training or Training(), say) as folder:
        yield from _run(folder, folder.until, say, stop)


def resume(
    output: UserPath, steps: int | None = None, *, say: Say = quiet, stop: Stop = lambda: False
) -> Iterator[Record]:
    """Go on with a training; a record for each iteration.

    Args:
        output: the folder of the training.
        steps: agent-steps in all, those before included; as many as at first if None. Beyond those, noise and rates
            stay as they were at the end.
        say: told from where it goes on.
        stop: as for ``train``.

    Raises:
        ResultsError: the folder holds no training, or a damaged one, or is in use; the message names the file.
    """
    with opened(user_path(output), None, say) as folder:
        yield from _run(folder, steps or folder.until, say, stop)


def _run(folder: TrainingFolder, until: int, say: Say, stop: Stop) -> Iterator[Record]:
    """Iterations from where the folder stands, with a checkpoint now and then and at the end."""
    training, record, stopped = folder.training, folder.record, False
    if record.agent_steps >= until:
        return
    sizes = ", ".join(f"{n} vehicles ({worlds} worlds)" for n, worlds in training.sizes)
    drawn = len(training.conditions)
    say(f"Training on swarms of {sizes}; {f'{drawn} conditions' if drawn else conditions(training.loaded)}.")
    with one_thread():
        trainer = Trainer(training, folder.checkpoint)
        folder.begin(until)
        # TensorBoard hides what was written from the purge step on: what a break has left after the checkpoint.
        board = SummaryWriter(str(folder.path / "tensorboard"), purge_step=record.agent_steps + 1)
        with writing(folder.path), board:
            while record.agent_steps < until and not stopped:
                record = trainer.iterate(record)
                episodes = trainer.mappo.env.pop_episode_stats()
                done = record.agent_steps >= until
                if done or record.iteration % training.validate_every == 0:
                    record = _validated(trainer, record, folder.path)
                folder.note(record)
                stopped = stop()
                if done or stopped or record.iteration % training.checkpoint_every == 0:
                    folder.keep(record, lambda path, record=record: trainer.save(path, record))
                _show(board, record, episodes)
                yield record


class Trainer:
    """MAPPO at work, and how it is kept on disk.

    Args:
        training: what is trained, and how.
        checkpoint: where to go on, see ``restore``; else the training begins, from ``training.start`` if there is one.
    """

    def __init__(self, training: Training, checkpoint: Path | None = None) -> None:
        _need_device(training.device)
        self.training, self.mappo = training, Mappo(training)
        if checkpoint is not None:
            self.restore(checkpoint)
        elif training.start is not None:
            remedy = "give a folder best or a checkpoint of the same sizes of network"
            with _reading(user_path(training.start) / _LEARNER_FILE, remedy) as data:
                self.mappo.learner.start_from(_learned(data))

    def iterate(self, before: Record) -> Record:
        """Sample and update once."""
        started = time.perf_counter()
        reward, update = self.mappo.iterate(before.agent_steps / self.training.steps)
        return Record(
            iteration=before.iteration + 1,
            agent_steps=before.agent_steps + self.mappo.agent_steps,
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
        (folder / _WORLDS_FILE).write_bytes(safetensors.numpy.save(self.mappo.env.snapshot()))
        (folder / _RANDOM_FILE).write_text(json.dumps(self.mappo.random) + "\n", encoding="utf-8")

    def save_policy(self, folder: Path, record: Record) -> None:
        """The policy, and the learner that a later training may start from."""
        training = self.training
        scenario = training.loaded
        card = Card(
            percept=card_rows(scenario),
            yaw_damping_nms=scenario.actuators.yaw_damping_nms,
            channels=scenario.sonar.channels,
            features=training.sees,
            barrier=BARRIER,
            law=training.law,
            trims=training.trims,
            safety=training.safety,
            vehicle=vehicle_of(scenario),
            training={**training.model_dump(mode="json"), "versions": versions(), "record": record._asdict()},
        )
        save_checkpoint(folder / WEIGHTS_FILE, card, self.mappo.learner.layers)
        (folder / _LEARNER_FILE).write_bytes(safetensors.numpy.save(self.mappo.learner.arrays()))

    def restore(self, folder: Path) -> None:
        """Go on from what ``save`` wrote, as if there had been no break. Raises ResultsError naming a damaged file."""
        remedy = "copy the checkpoint again as a whole, or begin with --set start=BEST and another --output"
        with _reading(folder / _LEARNER_FILE, remedy) as data:
            self.mappo.learner.restore(_learned(data))
        with _reading(folder / _WORLDS_FILE, remedy) as data:
            self.mappo.env.restore(safetensors.numpy.load(data))
        with _reading(folder / _RANDOM_FILE, remedy) as data:
            self.mappo.random = json.loads(data)


def _need_device(device: str) -> None:
    """Refuse what torch can't compute on here."""
    try:
        torch.zeros(1, device=device)
    except (RuntimeError, AssertionError) as error:
        reason = str(error).splitlines()[0]
        raise TrainingError(
            f"device {device!r} can't be used: {reason}; give cpu, or install a torch that can"
        ) from None


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
    started, training = time.perf_counter(), trainer.training
    candidate, best = output / "candidate", output / "best"
    trainer.save_policy(candidate, record)
    result: ValidationResult = validate(candidate, training)
    better = training.chosen == "last" or record.best is None or result.score > record.best
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
