"""Running a training: iterations, validations, and files from which it resumes exactly.

``config.json``, ``progress.csv`` and ``checkpoints/`` as ``uuv_marl.train.folder`` keeps them; ``best/``, the policy of
the best validation; ``curve.png``. Needs ``train``.
"""

import json
import math
import shutil
import sys
import time
from collections.abc import Callable, Iterator, Sequence
from contextlib import ExitStack, contextmanager
from pathlib import Path
from typing import Any

import numpy as np
import safetensors.numpy

from uuv_marl.atomic import writing
from uuv_marl.baselines.learned.checkpoint import WEIGHTS_FILE, load_checkpoint, save_checkpoint
from uuv_marl.errors import ResultsError, TrainingError
from uuv_marl.extras import extra
from uuv_marl.paths import UserPath, user_path
from uuv_marl.scenario import conditions
from uuv_marl.train.curve import draw_curve
from uuv_marl.train.folder import Record, Say, Stop, TrainingFolder, opened, versions
from uuv_marl.train.objective import objective
from uuv_marl.train.ppo import Learner, annealed
from uuv_marl.train.rows import TRAINING_SEEDS, Rows
from uuv_marl.train.training import Training
from uuv_marl.train.validation import Validation, Worst, replay_command, validate

with extra("train", "training"):
    import torch

_EXPERT_ACTS, _NETWORK_ACTS = 0.2, 0.8
"""Shares of the imitation phase until which the expert acts in all worlds, and from which in none that starts."""
_IMITATION_NOISE, _IMITATION_RATE = 0.2, (2e-3, 3e-4)
"""Action noise, and learning rates at the start and at the end of the imitation phase."""
_LEARNER_FILE, _WORLDS_FILE, _RANDOM_FILE = "learner.safetensors", "worlds.safetensors", "random.json"


def train(
    output: UserPath, training: Training | None = None, *, say: Say = lambda _: None, stop: Stop = lambda: False
) -> Iterator[Record]:
    """Train until the budget is spent; yields a record after each iteration.

    Closing the iterator, an interrupt or a kill leaves the last checkpoint, from which ``resume`` continues as if there
    had been no break; with a budget of ``steps`` bit for bit. Torch runs on one thread; its global settings are
    restored between iterations.

    Args:
        output: a new or empty folder.
        training: its description; all defaults if None.
        say: called with messages about the training.
        stop: called after every iteration; once it returns True, the training ends with a checkpoint.

    Raises:
        ResultsError: the folder is in use or can't be written; the last checkpoint stays complete.
        RewardError: the reward can't be imported, or returns an invalid value.
        PolicyError: the expert can't run on a scenario.
    """
    with opened(user_path(output), training or Training(), say) as folder:
        yield from _run(folder, folder.until, say, stop)


def resume(
    output: UserPath, until: float | None = None, *, say: Say = lambda _: None, stop: Stop = lambda: False
) -> Iterator[Record]:
    """Continue a training; yields a record after each iteration.

    Args:
        output: the folder of the training.
        until: the new total budget, agent-steps or seconds; unchanged if None. Beyond the first budget, noise,
            learning rate and collision cost keep their final values.
        say: called with where the training resumes.
        stop: as for ``train``.

    Raises:
        ResultsError: the folder holds no training or a damaged one, or is in use; the message names the file.
        TrainingError: ``until`` is not above 0 and finite.
    """
    if until is not None and not 0.0 < until < math.inf:
        raise TrainingError(f"until must be above 0 and finite, got {until}; leave it out to keep the budget")
    with opened(user_path(output), None, say) as folder:
        yield from _run(folder, until or folder.until, say, stop)


def _run(folder: TrainingFolder, until: float, say: Say, stop: Stop) -> Iterator[Record]:
    """Iterations from the folder's last checkpoint on, with further checkpoints."""
    training, record, stopped = folder.training, folder.record, False
    if record.spent(training) >= until:
        return
    parts = [
        f"{part.vehicles} vehicles ({part.name}, {part.worlds} worlds, {conditions(part.scenario)})"
        for part in training.parts
    ]
    others = f"; {training.others} does not learn" if training.others else ""
    say(f"{training.card.policy_class}: swarms of {'; '.join(parts)}{others}.")
    say(objective(training))
    with fixed_torch():
        trainer = Trainer(training, folder.checkpoint)
    folder.begin(until)
    while record.spent(training) < until and not stopped:
        with fixed_torch(), writing(folder.path):
            before, record = record, trainer.iterate(record)
            done = record.spent(training) >= until
            validated = done or _due(before, training) < _due(record, training)
            if validated:
                record = _validated(trainer, record, folder.path)
            folder.note(record)
            stopped = stop()
            if validated or stopped or record.iteration % training.checkpoint_every == 0:
                folder.keep(record, lambda path, record=record: trainer.save(path, record))
            if validated:
                draw_curve(folder.rows(), folder.path / "curve.png", training.title or training.loaded.title)
        yield record


def _due(record: Record, training: Training) -> int:
    """Number of validations that are due so far."""
    return int(record.spent(training) * training.validations / training.budget)


class Trainer:
    """A learner with its rows, and their checkpoints."""

    def __init__(self, training: Training, checkpoint: Path | None = None) -> None:
        self.training, self._rng = training, np.random.default_rng(training.seed)
        self.rows = Rows(training, lambda num: self._rng.integers(*TRAINING_SEEDS, num))
        self.learner = Learner(
            training.network, training.card.sizes, self.rows.size, self.rows.part, training.ppo, self._rng,
            2 + training.card.message_entries,
        )  # fmt: skip
        if checkpoint is not None:
            self.restore(checkpoint)

    def iterate(self, before: Record) -> Record:
        """Sample and update once."""
        started, config = time.process_time(), self.training.ppo
        share = before.spent(self.training) / self.training.budget
        imitation_share = self.training.imitation_share if self.training.expert else 0.0
        imitating = share < imitation_share
        self.learner.set_imitation(imitating, 0.0 if imitating else self.training.imitation_weight)
        if imitating:
            expert_share = (_NETWORK_ACTS - share / imitation_share) / (_NETWORK_ACTS - _EXPERT_ACTS)
            noise, message_noise = _IMITATION_NOISE, 0.0  # noisy messages would mislead the expert
            rate, share = annealed(_IMITATION_RATE, share / imitation_share), 0.0
        else:
            expert_share, share = 0.0, (share - imitation_share) / (1.0 - imitation_share)
            noise, rate = annealed(config.noise, share), annealed(config.learning_rate, share)
            message_noise = annealed(config.message_noise, share) if config.message_noise else noise
        self.rows.schedule(annealed(config.collision_cost or (0.0, 0.0), share), expert_share)
        batch, reward = self.learner.sample(self.rows, noise, message_noise)
        kl, explained = self.learner.update(batch, noise, message_noise, rate)
        return Record(
            iteration=before.iteration + 1,
            agent_steps=before.agent_steps + int(batch.acted.sum()),
            seconds=before.seconds + time.process_time() - started,
            reward=reward,
            kl=kl,
            explained=explained,
            best=before.best,
        )

    def save(self, folder: Path, record: Record) -> None:
        """Write the state for ``restore``, and the policy."""
        folder.mkdir(parents=True, exist_ok=True)
        self.save_policy(folder, record)
        (folder / _LEARNER_FILE).write_bytes(safetensors.numpy.save(self.learner.arrays()))
        (folder / _WORLDS_FILE).write_bytes(safetensors.numpy.save(self.rows.snapshot()))
        (folder / _RANDOM_FILE).write_text(json.dumps(self._rng.bit_generator.state) + "\n", encoding="utf-8")

    def save_policy(self, folder: Path, record: Record, validation: Validation | None = None) -> None:
        """Write the policy with the training's settings, versions and record."""
        settings = {**self.training.model_dump(mode="json"), "versions": versions(), "record": record._asdict()}
        if validation is not None:
            settings["worst"] = validation.worst
        card = self.training.card.model_copy(update={"training": settings})
        save_checkpoint(folder / WEIGHTS_FILE, card, self.learner.weights)

    def restore(self, folder: Path) -> None:
        """Restore exactly what ``save`` wrote. Raises ResultsError that names a damaged file."""
        with _reading(folder / _LEARNER_FILE) as data:
            arrays = safetensors.numpy.load(data)
            if spoilt := next((name for name, array in arrays.items() if not np.isfinite(array).all()), None):
                raise ValueError(f"{spoilt} must hold finite numbers")
            self.learner.restore(arrays)
        with _reading(folder / _WORLDS_FILE) as data:
            self.rows.restore(safetensors.numpy.load(data))
        with _reading(folder / _RANDOM_FILE) as data:
            self._rng.bit_generator.state = json.loads(data)


_TORCH: Sequence[tuple[Callable[[], Any], Callable[[Any], object], Any]] = (
    (torch.get_num_threads, torch.set_num_threads, 1),  # sums in another order give other bits
    (torch.get_default_dtype, torch.set_default_dtype, torch.float32),
    # oneDNN multiplies in half precision where torch.set_float32_matmul_precision or torch.backends allows it.
    (lambda: torch.backends.mkldnn.enabled, lambda on: setattr(torch.backends.mkldnn, "enabled", on), False),
    (lambda: sys.float_info.min / 2.0 == 0.0, torch.set_flush_denormal, False),
)
"""Global settings of torch that change numbers: how each is read and set, and its value in a training."""


@contextmanager
def fixed_torch() -> Iterator[None]:
    """Run torch in float32 on one CPU thread with gradients, whatever the global settings are."""
    with ExitStack() as stack:
        for get, put, value in _TORCH:
            stack.callback(put, get())
            put(value)
        if torch.get_default_device() != torch.device("cpu"):  # this mode slows every operation
            stack.enter_context(torch.device("cpu"))
        for mode in (torch.autocast("cpu", enabled=False), torch.inference_mode(False), torch.enable_grad()):
            stack.enter_context(mode)
        yield


def _validated(trainer: Trainer, record: Record, output: Path) -> Record:
    """Validate the present policy, and keep it as ``best`` unless an earlier one was better; the record."""
    candidate, best = output / "candidate", output / "best"
    trainer.save_policy(candidate, record)
    validation = validate(str(candidate), trainer.training)
    better = record.best is None or validation.score >= record.best
    fields = {name: value for name, value in validation._asdict().items() if name in Record._fields}
    record = record._replace(best=validation.score if better else record.best, **fields)
    if better:
        trainer.save_policy(candidate, record, validation)
        best.mkdir(exist_ok=True)
        (candidate / WEIGHTS_FILE).replace(best / WEIGHTS_FILE)
    shutil.rmtree(candidate)
    return record


def best_of(output: Path) -> tuple[Record, str]:
    """The record of a training's best policy, and the command that shows the worst episode of its validation."""
    training = dict(load_checkpoint(output / "best").card.training)
    fields = {name: value for name, value in training.items() if name in Training.model_fields}
    return Record(**training["record"]), replay_command(output / "best", Training(**fields), Worst(*training["worst"]))


@contextmanager
def _reading(path: Path) -> Iterator[bytes]:
    """Turn any error caused by a file's content into a ResultsError that names the file."""
    try:
        yield path.read_bytes()
    except Exception as error:
        reason = " ".join(str(error).split())
        raise ResultsError(
            f"{path} can't be used ({type(error).__name__}: {reason}); copy the whole checkpoint again, or "
            "start again with another --output"
        ) from error
