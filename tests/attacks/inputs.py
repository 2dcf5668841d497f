"""Hostile inputs, a function for each kind: it makes one from random numbers and hands it over.

A case ends in "accepted" or "refused" (a clear error). Everything else that can happen to it is told by ``judge``.
"""

import copy
import json
import math
import shutil
import struct
import warnings
from pathlib import Path

import numpy as np
import safetensors.numpy
from gymnasium.error import ResetNeeded

import uuv_marl
from tests.nets import ANYWHERE
from tests.players import CYCLES, PLAYERS, compare, suited
from tests.processes import cli, succeeds
from tests.swarms import fly, piloted, started
from uuv_marl import load_scenario, scenario_names
from uuv_marl.baselines import POLICIES, make_policy, with_policy_requirements
from uuv_marl.benchmark.results import Results
from uuv_marl.errors import DivergenceError, PolicyError, ResultsError, ScenarioError
from uuv_marl.percept import Percept
from uuv_marl.scenario import parse_override
from uuv_marl.sim.swarm import Swarm

PACKAGE = Path(uuv_marl.__file__).parent
OURS = (ScenarioError, PolicyError, ResultsError, DivergenceError, ResetNeeded)
NUMBERS = (
    0, -0.0, 1, -1, 2, 7, 0.1, 0.05, 1e-3, 1e-9, 5e-324, 3.7, 54, 100, 1e3, 1e6, 1e9, 1e30, 1e308, -1e308, 2**31, 2**63,
    2**64, -(2**63), math.inf, -math.inf, math.nan, True, False,
)  # fmt: skip
THINGS = (
    *NUMBERS, None, "", "x", "²", "centre", "active", [], [1], [1, 2], [[1, 2], [3, 4]], {}, {"a": 1}, "9" * 400, b"x",
)  # fmt: skip


class WrongError(AssertionError):
    """Something was accepted that does not work."""


def judge(error):
    """What an exception says of the case in which it came: a clear refusal, or a fault of ours."""
    if isinstance(error, WrongError):
        return "wrong"
    if isinstance(error, IndexError) and "out of bounds" in str(error):
        return "memory"
    where = error.__traceback__
    while where.tb_next:
        where = where.tb_next
    ours = PACKAGE in Path(where.tb_frame.f_code.co_filename).parents
    clear = ours and isinstance(error, ValueError | TypeError | RuntimeError | KeyError | AttributeError)
    return "refused" if isinstance(error, OURS) or (clear and len(str(error)) > 12) else "unclear"


def pick(rng, options):
    return options[int(rng.integers(len(options)))]


def leaves(data, prefix=""):
    for key, value in data.items() if isinstance(data, dict) else enumerate(data):
        if isinstance(value, dict) or (isinstance(value, tuple | list) and value and isinstance(value[0], dict)):
            yield from leaves(value, f"{prefix}{key}.")
        else:
            yield f"{prefix}{key}", value


def mutated(rng, value):
    """A value near or far from the one that was there."""
    if isinstance(value, int | float) and not isinstance(value, bool) and rng.random() < 0.6:
        return type(value)(value * float(10.0 ** rng.uniform(-3, 3)) * pick(rng, (1, 1, 1, -1)))
    return pick(rng, THINGS)


def changed_scenario(rng, num=1):
    base = load_scenario(pick(rng, scenario_names()), num_vehicles=int(rng.integers(1, 9)))
    fields = dict(leaves(base.model_dump(mode="json")))
    overrides = {}
    for _ in range(int(rng.integers(1, num + 1))):
        field = pick(rng, list(fields))
        overrides[field] = mutated(rng, fields[field])
    return load_scenario(base, overrides=overrides)


def finite(*arrays):
    if not all(np.isfinite(array).all() for array in arrays):
        raise WrongError("a number that is not finite was handed out")


def inside(space, observation):
    if not (np.isfinite(observation).all() and (observation >= space.low).all() and (observation <= space.high).all()):
        raise WrongError("an observation left its bounds")


def fields(rng, folder):
    changed_scenario(rng, 3)


def scenarios_that_run(rng, folder):
    """What was accepted must work: a few decisions of an environment and of a policy, finite and within bounds."""
    scenario = changed_scenario(rng, 2)
    timing = scenario.timing
    steps = timing.control_steps_per_decision * timing.integration_steps_per_control_step
    if scenario.swarm.num_vehicles > 60 or steps > 2000:
        return
    env = uuv_marl.parallel_env(scenario, max_cycles=12)
    observations, _ = env.reset(seed=int(rng.integers(10**6)))
    space = env.observation_space(env.possible_agents[0])
    inside(env.state_space, env.state())
    while env.agents:
        for observation in observations.values():
            inside(space, observation)
        actions = {agent: rng.uniform(-1, 1, 2).astype(np.float32) for agent in env.agents}
        observations, rewards, *_ = env.step(actions)
        finite(list(rewards.values()))
    name = pick(rng, ("bio_inspired", "sff", "sdc", "mappo"))
    try:
        swarm, policy = piloted(name, scenario, seed=1)
    except (PolicyError, ScenarioError):
        return
    policy.reset(1)
    finite(fly(swarm, policy, 6).flat)


def toml_bytes(rng, folder):
    text = bytearray((PACKAGE / "scenario" / f"{pick(rng, scenario_names())}.toml").read_bytes())
    for _ in range(int(rng.integers(1, 6))):
        at = int(rng.integers(len(text)))
        what = rng.integers(3)
        if what == 0:
            text[at] = int(rng.integers(256))
        elif what == 1:
            del text[at : at + int(rng.integers(1, 40))]
        else:
            text[at:at] = bytes(text[at : at + int(rng.integers(1, 40))])
    path = folder / "mutated.toml"
    path.write_bytes(bytes(text))
    load_scenario(path)


def toml_by_hand(rng, folder):
    depth = int(rng.integers(2, 4000))
    texts = (
        "[" * depth, "x = " + "[" * depth, "a" + ".a" * depth + " = 1", "x = " + "9" * depth, "\\u0000" * depth,
        'extends = "a.toml"', 'extends = "../b/a.toml"', "extends = 5", 'extends = "/dev/null"', "extends = 'a''a'",
        "[swarm]\nnum_vehicles = " + "1" * depth,
        "obstacles = [" + "{centre_m=[1,2],radius_m=1}," * min(depth, 300) + "]",
        "[[obstacles]]\n" * min(depth, 300), "\ufeff", "[swarm]\n" * 2, "swarm = 1", "=", "#" * depth,
    )  # fmt: skip
    for name in "ab":
        (folder / name).mkdir(exist_ok=True)
        (folder / name / "a.toml").write_text('extends = "../' + ("b" if name == "a" else "a") + '/a.toml"\n')
    path = folder / "a" / pick(rng, ("a.toml", "mine.toml", "²³.toml"))
    if path.name != "a.toml":
        path.write_text(pick(rng, texts))
    load_scenario(path)


def overrides(rng, folder):
    names = [name for name, _ in leaves(load_scenario(pick(rng, scenario_names())).model_dump(mode="json"))]
    field = pick(rng, names)
    if rng.random() < 0.4:
        letters = list(field)
        letters[int(rng.integers(len(letters)))] = pick(rng, (".", "", "²", "\n", "=", "0", "_", "é"))
        field = "".join(letters)
    text = f"{field}{pick(rng, ('=', '=', '=', '', '=='))}{pick(rng, [str(thing) for thing in THINGS])}"
    load_scenario("single_obstacle", overrides=dict([parse_override(text)]))


def odd_arguments(rng, folder):
    thing = pick(rng, (*THINGS, object(), np.array([1.5]), 1 + 2j, Path("x"), [None], np.int64(3)))
    calls = (
        lambda: load_scenario(thing),
        lambda: load_scenario("tracking", overrides=thing),
        lambda: load_scenario("tracking", num_vehicles=thing),
        lambda: uuv_marl.parallel_env("starter", max_cycles=thing),
        lambda: uuv_marl.parallel_env("starter", reward=thing),
        lambda: uuv_marl.parallel_env("starter", decision_period=thing),
        lambda: uuv_marl.parallel_env("starter", render_mode=thing),
        lambda: uuv_marl.parallel_env("starter", render_options=pick(rng, (thing, {"size": thing}, {"camera": thing}))),
        lambda: uuv_marl.vector_env(thing, "starter"),
        lambda: uuv_marl.parallel_env("starter").reset(seed=thing),
        lambda: uuv_marl.vector_env(2, "starter").reset(seed=thing),
        lambda: Swarm(load_scenario("starter"), thing),
        lambda: Swarm(load_scenario("starter"), 2).reset(thing),
        lambda: make_policy("random", load_scenario("starter"), 2).reset(thing),
        lambda: make_policy(thing, load_scenario("starter")),
        lambda: make_policy("idle", thing),
    )
    if isinstance(thing, int | float) and not isinstance(thing, bool) and not math.isnan(thing) and abs(thing) > 1e4:
        calls = calls[:6]  # a swarm of 2^31 worlds is a wish, and no mistake
    pick(rng, calls)()


def hostile_action(rng, n):
    good = rng.uniform(-1, 1, (n, 2))
    spoilt = good.astype(object)
    spoilt[int(rng.integers(n)), int(rng.integers(2))] = pick(rng, (None, "a", [1, 2], 10**400, 1j))
    other = good.copy()
    other[int(rng.integers(n)), int(rng.integers(2))] = pick(rng, (np.nan, np.inf, -np.inf, 1e300, -1e39))
    return pick(
        rng,
        (
            good, spoilt, other, good[:-1], good[:, :1], good[None], good.T, good[::-1], np.asfortranarray(good),
            good.astype(complex), good.astype(str), good.astype(np.float16), (good * 100).astype(np.int8), good > 0,
            np.ma.masked_array(good, good > 0), good.tolist(), [], None, "ab", {1, 2}, {}, np.zeros((0, 2)),
            np.float64(1), object(), [[1], [2, 3]],
        ),
    )  # fmt: skip


def actions(rng, folder):
    n = 3
    given = hostile_action(rng, n)
    how = rng.integers(4)
    if how == 0:
        env = uuv_marl.parallel_env("starter", n)
        env.reset(seed=0)
        if isinstance(given, np.ndarray | list) and len(given) == n:
            given = dict(zip(env.agents, given, strict=True))
        if rng.random() < 0.2 and isinstance(given, dict):
            given[pick(rng, ("uuv_9", 5, None))] = [0.0, 0.0]
        observations, rewards, *_ = env.step(given)
        finite(*observations.values(), list(rewards.values()))
    elif how == 1:
        envs = uuv_marl.vector_env(2, "starter", num_vehicles=n)
        envs.reset(seed=0)
        observations, rewards, *_ = envs.step([given, given] if rng.random() < 0.5 else given)
        finite(observations, rewards)
    elif how == 2:
        swarm = started("starter", n=n)
        finite(swarm.step([given] if rng.random() < 0.5 else given).flat)
    else:
        import gymnasium

        env = gymnasium.make("uuv_marl/Solo-v2", scenario="starter", num_vehicles=n, disable_env_checker=True).unwrapped
        env.reset(seed=0)
        observation, reward, *_ = env.step(given[0] if isinstance(given, np.ndarray) and given.size > 1 else given)
        finite(observation, reward)


def call_sequences(rng, folder):
    kind = rng.integers(3)
    if kind == 0:
        env = uuv_marl.parallel_env("starter", 2, max_cycles=4, render_mode=pick(rng, (None, "rgb_array")))
        act = lambda: {agent: [0.1, 0.2] for agent in pick(rng, (env.agents, env.possible_agents, []))}  # noqa: E731
    elif kind == 1:
        mode = pick(rng, ("NextStep", "SameStep", "Disabled"))
        env = uuv_marl.vector_env(2, "starter", num_vehicles=2, max_cycles=4, autoreset_mode=mode)
        act = lambda: np.zeros((2, 2, 2), np.float32)  # noqa: E731
    else:
        env = uuv_marl.env("starter", 2, max_cycles=3)
        act = lambda: pick(rng, (None, np.zeros(2, np.float32)))  # noqa: E731
    calls = (
        lambda: env.reset(seed=pick(rng, (None, 0, 5))),
        *[lambda: env.step(act())] * 3,
        lambda: copy.deepcopy(env),
        *(env.state, env.render, env.close, getattr(env, "last", list)),
    )
    for _ in range(12):
        try:
            pick(rng, calls)()
        except Exception as error:
            if judge(error) != "refused" and not isinstance(error, AssertionError | KeyError | AttributeError):
                raise


def foreign_percepts(rng, folder):
    """A policy is handed the percepts of another swarm, or numbers that no sonar gives."""
    name = pick(rng, ANYWHERE)
    n, worlds = int(rng.integers(1, 7)), int(rng.integers(1, 4))
    scenario = with_policy_requirements(name, load_scenario("single_obstacle", num_vehicles=n))
    policy = make_policy(name, scenario, worlds)
    policy.reset(0)
    other = with_policy_requirements(
        pick(rng, (name, "sdc", "idle")), load_scenario("single_obstacle", num_vehicles=int(rng.integers(1, 7)))
    )
    swarm = Swarm(pick(rng, (scenario, other)), pick(rng, (worlds, worlds, 1, 4)))
    percept = swarm.reset(1)
    flat = percept.flat.copy()
    if rng.random() < 0.7:
        noise = rng.normal(0, pick(rng, (0.01, 1.0, 1e6)), flat.shape)
        flat += noise.astype(np.float32)
        flat[rng.random(flat.shape) < 0.02] = pick(rng, (np.nan, np.inf, -np.inf, -1.0, 1e30))
    for _ in range(2):
        action = policy.act(Percept(flat, percept.layout))
    if action.shape != (worlds, n, 2):
        raise WrongError("actions of another shape")


def snapshots(rng, folder):
    swarm = started(pick(rng, ("lossy", "random_field", "starter")), {"losses.times_s": [1.0, 2.0]}, 2, 3, n=7)
    snapshot = swarm.snapshot()
    name = pick(rng, list(snapshot))
    if rng.random() < 0.3:
        old = snapshot[name]
        snapshot[name] = pick(rng, (old[:1], old.astype(np.int8), np.zeros(0), old[..., None]))
    elif snapshot[name].size:
        array = snapshot[name].reshape(-1)
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")
            value = pick(rng, [v for v in NUMBERS if not isinstance(v, bool)])
            array[int(rng.integers(array.size))] = np.array(value, np.float64).astype(array.dtype)
    swarm.restore(snapshot)
    for _ in range(3):
        swarm.step(np.zeros((2, 7, 2), np.float32))


def states_by_hand(rng, folder):
    n = int(pick(rng, (1, 2, 6, 54, 260, 400)))
    swarm = started("single_obstacle", n=n)
    how = rng.integers(5)
    place = swarm.state.eta[0, :, :2]
    if how == 0:
        place[...] = rng.normal(0, pick(rng, (1e-9, 1.0, 1e3, 1e8)), (n, 2))
    elif how == 1:
        place[...] = 0.0
    elif how == 2:
        place[...] = np.round(rng.uniform(0, 30, (n, 2))) * 10.0
    elif how == 3:
        place[: n // 2] = 1e12
    else:
        place[int(rng.integers(n))] = pick(rng, (np.nan, np.inf, 1e200))
    swarm.state.nu[0] = rng.normal(0, pick(rng, (0.0, 4.0, 60.0)), (n, 3))
    swarm.state.alive[0] = rng.random(n) < 0.8
    with np.errstate(all="ignore"):
        swarm.observe()
        for _ in range(2):
            swarm.step(rng.uniform(-1, 1, (1, n, 2)).astype(np.float32))


def checkpoints(rng, folder):
    data = bytearray((PACKAGE / "baselines" / "weights" / f"{pick(rng, ('mappo', 'ppo'))}.safetensors").read_bytes())
    length = struct.unpack("<Q", data[:8])[0]
    how = rng.integers(5)
    if how == 0:
        data[int(rng.integers(len(data)))] ^= 1 << int(rng.integers(8))
    elif how == 1:
        data = data[: int(rng.integers(len(data)))]
    elif how == 2:
        at = int(rng.integers(8, 8 + length))
        data[at : at + int(rng.integers(1, 30))] = bytes(rng.integers(32, 127, int(rng.integers(0, 30)), np.uint8))
    else:
        tensors = safetensors.numpy.load(bytes(data))
        meta = json.loads(data[8 : 8 + length])["__metadata__"]
        if how == 3:
            name = pick(rng, list(tensors))
            old = tensors[name]
            forms = (old * np.float32(np.nan), old[..., None], old[:1], old.astype(np.float64), np.full_like(old, 1e38))
            tensors[name] = np.ascontiguousarray(pick(rng, forms))
        else:
            card = json.loads(meta["uuv_marl"])
            card[pick(rng, list(card))] = pick(rng, [thing for thing in THINGS if not isinstance(thing, bytes)])
            meta = {"uuv_marl": json.dumps(card)}
        data = safetensors.numpy.save(tensors, meta)
    path = folder / "policy.safetensors"
    path.write_bytes(bytes(data))
    swarm, policy = piloted(str(folder), "random_field", n=4)
    finite(policy.act(swarm.percept))


def results_folders(rng, folder):
    target = folder / "results"
    shutil.rmtree(target, ignore_errors=True)
    shutil.copytree(SOURCE_RESULTS, target)
    path = target / "results.json"
    how = rng.integers(4)
    if how == 0:
        data = bytearray(path.read_bytes())
        for _ in range(int(rng.integers(1, 4))):
            data[int(rng.integers(len(data)))] = int(rng.integers(256))
        path.write_bytes(bytes(data))
    elif how == 1:
        data = json.loads(path.read_text())
        place = data
        while isinstance(place, dict | list) and place and rng.random() < 0.7:
            key = pick(rng, list(place) if isinstance(place, dict) else list(range(len(place))))
            if not isinstance(place[key], dict | list) or rng.random() < 0.4:
                if rng.random() < 0.5:
                    place[key] = pick(rng, [t for t in THINGS if not isinstance(t, bytes | float) or t == 0])
                else:
                    del place[key]
                break
            place = place[key]
        path.write_text(json.dumps(data))
    elif how == 2:
        trace = pick(rng, sorted((target / "traces").iterdir()))
        data = trace.read_bytes()
        trace.write_bytes(pick(rng, (b"", data[: len(data) // 2], b"x" + data)))
    else:
        path.unlink()
        path.mkdir()
    results = Results(target, [load_scenario("starter")])
    for row in results.rows:
        results.trace(row.scenario, row.policy, row.seed)


SOURCE_RESULTS = Path()
"""A good results folder, which ``prepare`` makes."""


def prepare(folder):
    """Make what the cases start from, and compile what they need, so that their time limit is for them alone."""
    global SOURCE_RESULTS  # noqa: PLW0603
    SOURCE_RESULTS = folder / "source"
    succeeds("benchmark", "--scenario=starter", "--policy=idle", "--seeds=2", f"--output={SOURCE_RESULTS}")
    for name in POLICIES:
        fly(*piloted(name, TASKS_OF.get(name, "single_obstacle")), 1)
    for name in scenario_names():
        env = uuv_marl.parallel_env(load_scenario(name, overrides={"current.speed_mps": 0.1}))  # what the sea does, too
        env.reset(seed=0)
        env.step({agent: [0.0, 0.0] for agent in env.agents})


TASKS_OF = {
    "oracle": "hard_water", "carrot_informed": "hard_water", "nearest_target": "silent_targets",
    "mappo_silent_targets": "silent_targets", "mappo_few_informed": "few_informed",
    "mappo_few_informed_messages": "few_informed",
}  # fmt: skip


def interfaces(rng, folder):
    """Every policy, over several episodes, through an interface drawn for it: the actions must be the same bits."""
    for name in POLICIES:
        scenario = suited(name, TASKS_OF.get(name, "starter"), **{"swarm.num_vehicles": 5})
        try:
            compare(pick(rng, PLAYERS), name, scenario, int(rng.integers(2**40)), CYCLES + 3, rng)
        except AssertionError as error:
            raise WrongError(f"{name}: {error}") from None


def command_line(rng, folder):
    words = (
        "benchmark", "train", "mappo", "ppo", "robustness", "list", "scenarios", "policies", "export", "replay",
        "tune", "--help", "-h", "--scenario", "starter", "nowhere", "./x.toml", "--policy", "idle", ":", "a:b", "/x/y",
        "--seeds", "0", "-1", "1e3", "x", "--set", "a=b", "swarm.num_vehicles=0", "--output", "/dev/null", "/proc/x",
        "--only", "--show", "--steps", "3e6", "--noise", "inf", "--resume", "--trials", "²", "",
    )  # fmt: skip
    line = [pick(rng, words) for _ in range(int(rng.integers(1, 6)))]
    if line[0] in ("benchmark", "robustness", "replay", "tune", "train") and not any(
        word in line for word in ("--help", "-h", "0", "-1", "x", "²", "nowhere", "/dev/null", ":", "a:b")
    ):
        line.append("--nothing-like-this")  # so that no long work begins
    return "accepted" if cli(*line)[0] == 0 else "refused"


COUNTS = {
    fields: 1200, scenarios_that_run: 400, toml_bytes: 700, toml_by_hand: 150, overrides: 700, odd_arguments: 300,
    actions: 300, call_sequences: 150, foreign_percepts: 200, snapshots: 200, states_by_hand: 150, checkpoints: 400,
    results_folders: 200, command_line: 150, interfaces: 28,
}  # fmt: skip
"""Kinds of inputs, and how many cases of each the campaign has."""
