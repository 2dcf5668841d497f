"""The contract every API must keep: the same seeds and actions give the same run. Each player drives one API."""

from typing import NamedTuple

import numpy as np

import uuv_marl

WORLDS, VEHICLES, SEED = 3, 4, 20
ARRIVES = {"trajectory.speed_mps": 40.0, "arrival.radius_m": 5e3, "arrival.spread_m": 2e4, "arrival.dwell_s": 0.2}
LOSES = {"losses.times_s": [1.0, 2.0]}
TIMES_OUT = {"time_limit.factor": 0.02, "time_limit.extra_s": 8.0}
WIDE = {
    **LOSES, "time_limit.extra_s": 40.0, "collision.hull_radius_m": 22.0, "start.spacing_m": 45.0, "start.gap_m": 45.0,
}  # fmt: skip
"""Vehicles so wide that they soon collide."""
SINKS = {**WIDE, "collision.ends_vehicle": True}
MEDIUM = {
    "current.speed_mps": 0.5, "current.variation_mps": 0.2, "current.eddies": 4, "current.eddy_speed_mps": 0.5,
    "latency.travel_time": True, "latency.processing_s": 0.3, "latency.compensated": True,
    "latency.active_period_s": 0.5, "latency.passive_period_s": 0.3,
    "noise.bearing_deg": 2.0, "noise.range_share": 0.02, "noise.silence_probability": 0.05, "noise.silence_readings": 3,
    "noise.passive_range_log_sd": 0.1, "noise.passive_r50_m": 100.0, "noise.active_r50_m": 75.0,
    "noise.false_echo_probability": 0.02,
    "traffic.speed_mps": 1.0, "navigation.drift_share": 0.02, "navigation.compass_bias_deg": 2.0,
    "actuators.thrust_lag_s": 0.2, "actuators.yaw_lag_s": 0.2, "mismatch.drag": 0.2, "mismatch.mass": 0.1,
    "faults": [{"kind": "array", "share": 0.2, "array": "bow"}, {"kind": "thruster", "share": 0.2}],
    "sonar.echo_reports": "surface", "arrival.ends_episode": False,
}  # fmt: skip
"""Everything that can disturb a world, in the middle of its range."""
SEA = MEDIUM | {"sonar.channels": ["compass", "current", "age", "ranged", "modem"], "modem.loss_probability": 0.1}
"""The same, and all that vehicles can be told of it."""
TALK = MEDIUM | {
    "modem.message_entries": 3, "modem.message_vectors": 1, "modem.loss_probability": 0.1, "modem.access": "aloha",
    "sonar.channels": ["compass", "messages", "odometry"],
}  # fmt: skip
"""The same with messages that vehicles choose."""
SINKING = {"faults": [{"kind": "member", "share": 0.4, "onset_s": 2.0}]}
BRIEF = {"time_limit.factor": 0.005, "time_limit.extra_s": 4.0}
OWN_TASK = "examples.extending.task:Rendezvous"


class Case(NamedTuple):
    """An environment and actions for WORLDS worlds, with at least one ending in each."""

    name: str
    scenario: str
    overrides: dict
    period: float = 0.5
    steps: int = 110
    options: dict = {}  # noqa: RUF012 - read only

    @property
    def kwargs(self):
        overrides = {**(LOSES if self.scenario == "lossy" else {}), **self.overrides}
        own = {"scenario": self.scenario, "decision_period": self.period, "overrides": overrides}
        return {"num_vehicles": VEHICLES, **own, **self.options}

    def actions(self):
        """Shape (step, world, vehicle, entry)."""
        shape = (self.steps, WORLDS, VEHICLES, 2 + self.overrides.get("modem.message_entries", 0))
        return np.random.default_rng(7).uniform(-1, 1, shape).astype(np.float32)


class Run(NamedTuple):
    """What an API gave. Rows of vehicles that were lost before are zero."""

    observation: np.ndarray
    """(step + 1, world, vehicle, entry), as the next decision sees it: the new episode's where one ended."""
    last: np.ndarray
    """(step, world, vehicle, entry): the observation that ends an episode, else zero."""
    reward: np.ndarray
    terminated: np.ndarray
    truncated: np.ndarray
    """(step, world, vehicle)"""
    over: np.ndarray
    """(step, world): the world was reset after this step."""
    mask: np.ndarray
    """(step + 1, world, vehicle): who makes the next decision."""
    state: np.ndarray
    """(step + 1, world, entry), likewise; no entries from an API that has none."""

    def equals(self, other):
        """Bit for bit, rewards as precise as the coarser of the two."""
        coarser = min(self.reward.dtype, other.reward.dtype)
        for name, mine, theirs in zip(self._fields, self, other, strict=True):
            if name == "state" and 0 in (mine.size, theirs.size):
                continue
            if name == "reward":
                mine, theirs = mine.astype(coarser), theirs.astype(coarser)  # noqa: PLW2901
            assert mine.tobytes() == theirs.tobytes(), f"{name} differs first at {np.argwhere(mine != theirs)[:1]}"


def own_reward(swarm):
    """A user's: minus the distance to l(t) in units of 10 m."""
    away = swarm.state.eta[:, :, :2] - swarm.own_reference[:, :, :2]
    return -np.hypot(away[..., 0], away[..., 1]) / 10.0


def empty(steps, size, reward=np.float64, state=0):
    shape = (steps, WORLDS, VEHICLES)
    observations = np.zeros((steps + 1, *shape[1:], size), np.float32), np.zeros((*shape, size), np.float32)
    terminated, truncated, over = (np.zeros(form, bool) for form in (shape, shape, shape[:2]))
    mask, states = np.zeros((steps + 1, *shape[1:]), bool), np.zeros((steps + 1, WORLDS, state), np.float32)
    return Run(*observations, np.zeros(shape, reward), terminated, truncated, over, mask, states)


def cases():
    scenarios = ("tracking", "single_obstacle", "multi_obstacle", "lossy", "random_field")
    return [
        *(Case(f"{name}-times_out", name, TIMES_OUT) for name in scenarios),
        *(Case(f"{name}-arrives", name, ARRIVES) for name in scenarios),
        Case("sinks", "single_obstacle", SINKS, 1.0, 350),
        Case("sea", "starter", SEA | TIMES_OUT, 0.5, 60),
        Case("sea-loses", "starter", SEA | TIMES_OUT | SINKING, 0.5, 60),
        Case("talk-loses", "starter", TALK | TIMES_OUT | SINKING, 0.5, 60),
        Case("talk", "starter", TALK | TIMES_OUT, 0.5, 60),
        Case("own_period", "random_field", BRIEF, 0.1),
        Case("team_reward", "lossy", TIMES_OUT, options={"reward": "team"}),
        Case("own_reward", "random_field", ARRIVES, options={"reward": own_reward}),
        Case("closeness", "random_field", BRIEF, options={"observe": "closeness"}),
        Case("reach", "starter", TIMES_OUT, options={"task": "reach"}),
        Case("two_swarms", "two_swarms", TIMES_OUT),
        Case("silent_targets", "silent_targets", TIMES_OUT),
        Case("few_informed", "starter", TIMES_OUT, options={"task": {"name": "few_informed", "informed": 1}}),
        Case("own_task", "starter", TIMES_OUT, options={"task": OWN_TASK}),
        Case("own_task-arrives", "starter", {}, steps=5, options={"task": {"name": OWN_TASK, "near_m": 5000.0}}),
        Case("max_cycles", "single_obstacle", TIMES_OUT, options={"max_cycles": 9}),
    ]


def parallel(case):
    """PettingZoo's parallel API, a world after the other: the reference."""
    actions = case.actions()
    run = None
    for w in range(WORLDS):
        env = uuv_marl.parallel_env(**case.kwargs)
        run = run or empty(len(actions), env.observation_space("uuv_0").shape[0], state=env.state_space.shape[0])
        play_dictionaries(env, run, w, actions[:, w])
    return run


def play_dictionaries(env, run, w, actions):
    """One world through any environment that speaks dictionaries of agents."""
    index = {agent: i for i, agent in enumerate(env.possible_agents)}

    def write(out, values):
        for agent, value in values.items():
            if agent in index:
                out[index[agent]] = value

    def begin(t, observations):
        write(run.observation[t, w], observations)
        run.mask[t, w] = [agent in env.agents for agent in env.possible_agents]
        if run.state.size:
            run.state[t, w] = env.state()

    begin(0, env.reset(seed=SEED + w)[0])
    for t, action in enumerate(actions):
        observations, rewards, terminated, truncated, _ = env.step({a: action[index[a]] for a in env.agents})
        write(run.reward[t, w], rewards)
        write(run.terminated[t, w], terminated)
        write(run.truncated[t, w], truncated)
        if not env.agents:
            run.over[t, w] = True
            write(run.last[t, w], observations)
            observations = env.reset()[0]
        begin(t + 1, observations)


def aec(case):
    """PettingZoo's turn-based API: what an agent reads by ``last`` at its turn is the outcome of the round before."""
    actions = case.actions()
    run = None
    for w in range(WORLDS):
        env = uuv_marl.env(**case.kwargs)
        size = env.unwrapped.state_space.shape[0]
        run = run or empty(len(actions), env.observation_space("uuv_0").shape[0], state=size)
        t, seed = 0, SEED + w
        while t <= len(actions):
            env.reset(seed=seed)
            run.over[t - 1, w] |= t > 0
            t, seed = play_turns(env, run, w, actions[:, w], t), None
    return run


def play_turns(env, run, w, actions, start):
    """An episode from round ``start`` on; the round in which the next one starts, or one past the last."""
    rounds = dict.fromkeys(env.possible_agents, start)
    for agent in env.agent_iter():
        i, t = env.possible_agents.index(agent), rounds[agent]
        observation, reward, terminated, truncated, _ = env.last()
        over = all(env.terminations[other] or env.truncations[other] for other in env.agents)
        (run.last[t - 1, w] if over else run.observation[t, w])[i] = observation
        if t > start:
            at = (t - 1, w, i)
            run.reward[at], run.terminated[at], run.truncated[at] = reward, terminated, truncated
        if not over:
            run.state[t, w] = env.state()
        if terminated or truncated:
            env.step(None)
        else:
            run.mask[t, w, i] = True
            env.step(actions[t, i] if t < len(actions) else np.zeros_like(actions[0, i]))
            rounds[agent] = t + 1
            if min(rounds[other] for other in env.agents) > len(actions):
                return len(actions) + 1
    return max(rounds.values())


def vector(case):
    """Gymnasium's vector API."""
    env = uuv_marl.vector_env(WORLDS, **case.kwargs)
    actions = case.actions()
    run = empty(len(actions), env.single_observation_space.shape[1], state=env.state_space.shape[0])
    run.observation[0], infos = env.reset(seed=SEED)
    run.mask[0], run.state[0] = infos["agent_mask"], env.state()
    for t, action in enumerate(actions):
        observation, reward, terminated, truncated, infos = env.step(action)
        run.observation[t + 1], run.mask[t + 1], run.state[t + 1] = observation, infos["agent_mask"], env.state()
        run.reward[t], run.terminated[t], run.truncated[t] = (
            infos[f"agent_{name}"] for name in ("reward", "terminated", "truncated")
        )
        if "reward" not in case.options:
            np.testing.assert_array_equal(reward, run.reward[t].mean(axis=1))
        run.over[t] = over = terminated | truncated
        assert not (terminated & truncated).any()
        np.testing.assert_array_equal(infos.get("_final_obs", np.zeros(WORLDS, bool)), over)
        for w in np.flatnonzero(over):
            run.last[t, w] = infos["final_obs"][w]
    return run


def sb3(case):
    """Stable-Baselines3's VecEnv: rows are vehicles."""
    from uuv_marl.envs.sb3 import SwarmVecEnv

    env = SwarmVecEnv(num_worlds=WORLDS, **case.kwargs)
    actions = case.actions()
    run = empty(len(actions), env.observation_space.shape[0], np.float32)
    split = (WORLDS, VEHICLES, -1)
    run.mask[:] = True
    env.seed(SEED)
    run.observation[0] = env.reset().reshape(split)
    for t, action in enumerate(actions):
        observation, reward, done, infos = env.step(action.reshape(-1, action.shape[-1]))
        run.over[t] = done.reshape(split[:2]).all(axis=1)
        run.observation[t + 1], run.reward[t] = observation.reshape(split), reward.reshape(split[:2])
        for row in range(env.num_envs):
            at = (t, *divmod(row, VEHICLES))
            assert done[row] == ("terminal_observation" in infos[row])
            if done[row]:
                run.last[at] = infos[row]["terminal_observation"]
                run.truncated[at] = infos[row]["TimeLimit.truncated"]
                run.terminated[at] = not infos[row]["TimeLimit.truncated"]
    return run


def torchrl(case):
    """TorchRL's EnvBase, reset as its collectors do."""
    import torch

    from uuv_marl.envs.torchrl import SwarmEnv

    env = SwarmEnv(WORLDS, **case.kwargs, seed=SEED)
    actions = case.actions()
    sizes = (env.observation_spec[key].shape[-1] for key in (("uuv", "observation"), "state"))
    run = empty(len(actions), next(sizes), np.float32, next(sizes))

    def begin(t, data):
        run.observation[t], run.mask[t] = data["uuv", "observation"], data["uuv", "mask"]
        run.state[t] = data["state"]

    data = env.reset()
    begin(0, data)
    for t, action in enumerate(actions):
        data["uuv", "action"] = torch.from_numpy(action)
        stepped, data = env.step_and_maybe_reset(data)
        after = stepped["next"]
        run.over[t] = over = after["done"].squeeze(-1).numpy()
        begin(t + 1, data)
        run.reward[t] = after["uuv", "reward"].squeeze(-1)
        run.terminated[t] = after["uuv", "terminated"].squeeze(-1).numpy() & run.mask[t]
        run.truncated[t] = after["uuv", "truncated"].squeeze(-1)
        run.last[t, over] = after["uuv", "observation"][over]
        # A world's own flags say what ends it; a lost vehicle's do not.
        truncated = after["truncated"].squeeze(-1).numpy()
        np.testing.assert_array_equal(truncated, run.truncated[t].any(axis=1))
        np.testing.assert_array_equal(after["terminated"].squeeze(-1).numpy(), over & ~truncated)
    return run
