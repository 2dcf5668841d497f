"""``python -m research.interfaces SB3-PPO``: the success of a learner of docs/interfaces.md, trained as printed there.

It runs the block with a seed of that training, in an environment that has the library, and counts successful
episodes on the validation seeds.
"""

# pyright: reportUnknownMemberType=false, reportMissingTypeStubs=false

import re
import runpy
import tempfile
import time
from collections.abc import Callable
from enum import StrEnum
from pathlib import Path
from typing import Annotated, Any

import numpy as np
import torch
import typer

import uuv_marl
from research import FOLDER
from uuv_marl.cli.console import explained
from uuv_marl.errors import ResultsError
from uuv_marl.types import Bool, Float32

PAGE = Path(FOLDER).parent / "docs" / "interfaces.md"
FIRST, EPISODES = 900_000, 100
"""First seed of the episodes, and their number."""
Act = Callable[[Float32, Bool], Float32]
"""Actions (row, 2) for observations (row, entry), a row per vehicle, and whether its episode begins, shape (row,)."""


class Learner(StrEnum):
    """Learners of the page."""

    PPO = "SB3-PPO"
    RECURRENT = "SB3-RecurrentPPO"
    MAPPO = "BenchMARL-MAPPO"
    IPPO = "BenchMARL-IPPO"
    TORCHRL = "TorchRL-PPO"
    RLLIB = "RLlib-PPO"


_WORDS = {
    Learner.PPO: 'PPO("MlpPolicy", SwarmVecEnv("starter"), seed=0)', Learner.RECURRENT: "RecurrentPPO(",
    Learner.MAPPO: "MappoConfig.", Learner.IPPO: "MappoConfig.", Learner.TORCHRL: "from torchrl.objectives",
    Learner.RLLIB: "from ray.rllib.",
}  # fmt: skip
"""Text that only a learner's block contains."""
_IPPO = {"MappoConfig": "IppoConfig", "max_n_iters, config.lr = 15": "max_n_iters, config.lr = 25"}
"""Changes of MAPPO's block, as the page says."""
APART = 1000
"""Distance between the seeds of trainings, so that none starts from another's worlds."""
app = typer.Typer(add_completion=False)


def printed(learner: Learner, training: int) -> str:
    """The page's block for a training: the first has the printed seed. Raises ResultsError where it is not there."""
    blocks = re.findall(r"```python\n(.*?)```", PAGE.read_text(encoding="utf-8"), flags=re.S)
    (block,) = [each for each in blocks if _WORDS[learner] in each] or [""]
    for was, now in _IPPO.items() if learner is Learner.IPPO else ():
        block = block.replace(was, now) if was in block else ""
    block, count = re.subn(r"(seed[=(])(\d[\d_]*)", lambda at: f"{at[1]}{int(at[2]) + APART * training}", block)
    if not count:
        raise ResultsError(f"{PAGE.name} must print a block of {learner} with a seed; correct it there")
    return block


def acting(learner: Learner, namespace: dict[str, Any]) -> Act:
    """The mean actions of the block's policy."""
    if learner in (Learner.PPO, Learner.RECURRENT):
        return _remembering(namespace["model"])
    if learner is Learner.RLLIB:
        return _of_rllib(namespace["network"])
    return _of_torchrl(namespace["policy"] if learner is Learner.TORCHRL else namespace["experiment"].policy)


def _of_rllib(network: Any) -> Act:
    def act(seen: Float32, _: Bool) -> Float32:
        outputs = network.forward_inference({"obs": torch.from_numpy(seen)})["action_dist_inputs"]
        return np.clip(outputs[:, :2].numpy(), -1.0, 1.0)

    return act


def _of_torchrl(policy: Any) -> Act:
    from tensordict import TensorDict  # noqa: PLC0415 - not where RLlib is
    from torchrl.envs.utils import ExplorationType, set_exploration_type  # noqa: PLC0415 - likewise

    def act(seen: Float32, _: Bool) -> Float32:
        tensordict = {"uuv": {"observation": torch.from_numpy(seen).reshape(EPISODES, -1, seen.shape[1])}}
        with set_exploration_type(ExplorationType.DETERMINISTIC), torch.no_grad():
            return policy(TensorDict(tensordict, [EPISODES]))["uuv", "action"].reshape(-1, 2).numpy()

    return act


def _remembering(model: Any) -> Act:
    state: Any = None

    def act(seen: Float32, begins: Bool) -> Float32:
        nonlocal state
        action, state = model.predict(seen, state, begins, deterministic=True)
        return action

    return act


def successes(act: Act) -> int:
    """Number of episodes that end by arrival without a collision."""
    envs = uuv_marl.vector_env(EPISODES, "starter", autoreset_mode="Disabled")
    seen, _ = envs.reset(seed=FIRST)
    n, begins, ended, good = seen.shape[1], True, np.zeros(EPISODES, np.bool_), 0
    while not ended.all():
        rows = seen.reshape(-1, seen.shape[2])
        action = act(rows, np.full(len(rows), begins))
        seen, _, terminated, truncated, _ = envs.step(action.reshape(EPISODES, n, 2))
        now, begins = (terminated | truncated) & ~ended, False
        good += int((now & terminated & ~envs.swarm.state.collided.any(axis=1)).sum())
        ended |= now
    return good


@app.command()
def main(
    learner: Annotated[Learner, typer.Argument(help="What is trained.")],
    training: Annotated[int, typer.Option(min=0, help="Which one; each has another seed.")] = 0,
) -> None:
    """Train by the page's block, and count the successes of 100 validation episodes.

    Example: python -m research.interfaces SB3-RecurrentPPO --training 2
    """
    with explained(FOLDER):
        began, used = time.perf_counter(), time.process_time()
        with tempfile.TemporaryDirectory() as folder:
            block = Path(folder, "block.py")
            block.write_text(printed(learner, training), encoding="utf-8")
            namespace = runpy.run_path(str(block), run_name="page")
        took, used = time.perf_counter() - began, time.process_time() - used
        good = successes(acting(learner, namespace))
        print(f"{learner}, training {training}: {good} of {EPISODES} succeed; {took:.0f} s, {used:.0f} s of processor")


if __name__ == "__main__":
    app()
