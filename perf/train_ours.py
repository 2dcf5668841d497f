"""Cases of perf/training.py in our own environment: MAPPO, PPO on its problem, plain PPO, and profiles of both."""

import functools
import math
import time
from collections.abc import Callable
from typing import Any

import torch
from footing import (
    CLIP,
    DECISIONS,
    EPOCHS,
    GAE_LAMBDA,
    GAMMA,
    HIDDEN,
    LEARNING_RATE,
    MINIBATCH,
    SEED,
    one_thread,
    sb3_ppo,
    scenario,
)
from stable_baselines3 import PPO
from stable_baselines3.common.policies import ActorCriticPolicy
from stable_baselines3.common.vec_env import VecMonitor, VecNormalize
from worker import Case, Maker, serve

from uuv_marl.envs import task
from uuv_marl.envs.sb3 import SwarmVecEnv
from uuv_marl.sim.swarm import Swarm
from uuv_marl.train import crew, fleet, mappo, ppo
from uuv_marl.train.shaping import Weights

WATER, EYES, INFERENCE, BOOKKEEPING = "water", "eyes", "inference", "bookkeeping"
ACTOR, CRITIC, BOTH, REST = "actor", "critic", "both", "rest"
FORWARD, BACKWARD, BOUND, ADAM = "forward", "backward", "bound", "adam"
EITHER = {
    "hidden": HIDDEN, "gamma": GAMMA, "gae_lambda": GAE_LAMBDA, "horizon": DECISIONS, "minibatch": MINIBATCH,
    "clip": CLIP, "kl_stop": math.inf, "learning_rate": (LEARNING_RATE, LEARNING_RATE),
}  # fmt: skip


def repeated(iterate: Callable[[], object], rows: int, inputs: str) -> Case:
    """A unit is an iteration: so many rows sampled and learned from."""

    def run(units: int) -> None:
        for _ in range(units):
            iterate()

    return Case(run, rows, {"rows": rows, "inputs": inputs})


def mappo_case(agents: int, worlds: int) -> Case:
    by = mappo.Hyperparameters(**EITHER, actor_epochs=EPOCHS, critic_epochs=EPOCHS)
    training = by.begin(scenario(), [(agents, worlds)], Weights(), SEED)
    inputs = f"{training.fleet.features}, critic {training.fleet.size}"
    return repeated(lambda: training.iterate(0.0), training.agent_steps, inputs)


def ppo_case(agents: int, worlds: int) -> Case:
    training = ppo.Hyperparameters(**EITHER, epochs=EPOCHS).begin(scenario(), [(agents, worlds)], Weights(), SEED)
    inputs = str(training.model.observation_space.shape[0])
    return repeated(lambda: training.iterate(0.0), training.agent_steps, inputs)


def plain_case(agents: int, worlds: int) -> Case:
    env = VecMonitor(SwarmVecEnv(worlds, scenario(agents)))
    model, rows = sb3_ppo(env, SEED), DECISIONS * env.num_envs
    return repeated(lambda: model.learn(rows, reset_num_timesteps=False), rows, str(env.observation_space.shape[0]))


class Clock:
    """Seconds by part, without what a part calls of other parts."""

    def __init__(self) -> None:
        self.seconds: dict[str, float] = {}
        self._open: list[str] = []
        self._since = 0.0

    def wrap(self, owner: Any, name: str, part: str) -> None:
        """Time what ``owner`` has under this name."""
        function = getattr(owner, name)

        @functools.wraps(function)
        def timed(*args: Any, **kwargs: Any) -> Any:
            self._turn()
            self._open.append(part)
            try:
                return function(*args, **kwargs)
            finally:
                self._turn()
                self._open.pop()

        setattr(owner, name, timed)

    def _turn(self) -> None:
        now = time.perf_counter()
        if self._open:
            self.seconds[self._open[-1]] = self.seconds.get(self._open[-1], 0.0) + now - self._since
        self._since = now


WRAPPED = (
    (Swarm, "step", WATER), (Swarm, "reset", WATER),
    (fleet, "shaped", EYES), (fleet.Fleet, "_look", EYES),
    (ppo, "shaped", EYES), (crew.Crew, "_features", EYES), (task, "observe", EYES),
    (mappo.Learner, "act", INFERENCE), (mappo.Learner, "value", INFERENCE),
    (ActorCriticPolicy, "forward", INFERENCE), (ActorCriticPolicy, "predict_values", INFERENCE),
    (mappo.Learner, "sample", BOOKKEEPING), (PPO, "collect_rollouts", BOOKKEEPING),
    (VecNormalize, "step_wait", BOOKKEEPING),
    (mappo.Learner, "_improve", ACTOR), (mappo.Learner, "_regress", CRITIC), (PPO, "train", BOTH),
    (mappo.Mappo, "iterate", REST), (ppo.Ppo, "iterate", REST),
)  # fmt: skip
LEARNING = (
    (mappo.Learner, "_improve", FORWARD), (mappo.Learner, "_regress", FORWARD), (PPO, "train", FORWARD),
    (torch.Tensor, "backward", BACKWARD), (torch.nn.utils, "clip_grad_norm_", BOUND), (torch.optim.Adam, "step", ADAM),
)  # fmt: skip


def profiled(maker: Maker) -> Maker:
    """The same case with clocks in it, whose seconds per iteration are facts. Spoils its process for other cases."""

    def made(agents: int, worlds: int) -> Case:
        clocks = {"parts": Clock(), "learning": Clock()}
        for name, wrapped in (("parts", WRAPPED), ("learning", LEARNING)):
            for owner, function, part in wrapped:
                clocks[name].wrap(owner, function, part)
        case = maker(agents, worlds)
        facts = dict(case.facts)

        def run(units: int) -> None:
            for clock in clocks.values():
                clock.seconds.clear()
            case.run(units)
            facts.update({name: {k: s / units for k, s in clock.seconds.items()} for name, clock in clocks.items()})

        return Case(run, case.amount, facts)

    return made


if __name__ == "__main__":
    one_thread()
    cases = {"mappo": mappo_case, "ppo": ppo_case, "plain": plain_case}
    cases |= {"mappo_profile": profiled(mappo_case), "ppo_profile": profiled(ppo_case)}
    serve(cases, ("uuv_marl", "numpy", "numba", "gymnasium", "stable_baselines3", "torch"))
