"""What must not move: hashes and samples of runs, and the fields of scenarios. ``python -m tests.golden`` writes them.

``tests/golden.json`` was made from commit 3eb4921; ``tests/test_golden.py`` computes it anew. The rule: a commit that
changes golden.json changes nothing else, and its message names the keys and the reason. If what a key pins only gets
another name, the key stays, and ``CONTROLLERS`` or ``NETWORKS`` here give the new name.

``SETTING POLICY WHAT`` is the key of a run: hashes of its states, percepts, actions or reward, one for each seed. They
are the same on any x86-64 processor. A network's are not, because NumPy computes its tanh in another way on an old
processor. So a network sees what ``DRIVER`` perceives, and a sample of its actions is compared within ``ATOL``.
``fields FIELD`` is the key of a scenario's field: its values by scenario.
"""

import hashlib
import json
from collections import Counter
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from uuv_marl import load_scenario
from uuv_marl.baselines import make_policy, with_policy_requirements
from uuv_marl.envs.core import BatchedEnv
from uuv_marl.scenario import Scenario
from uuv_marl.sim.swarm import Swarm

FILE = Path(__file__).with_name("golden.json")
STARTER = str(Path(__file__).with_name("starter_0_1_s.toml"))
"""The scenario ``starter`` of commit 3eb4921, so that the shipped one may change."""
WORLDS = 3
"""Seeds 0 to 2, stepped together."""
REWARD = "sparse"
"""The name of the reward of commit 3eb4921."""

CONTROLLERS = {name: name for name in (
    "bio_inspired", "bio_inspired,obstacle_term=per_obstacle", "bio_inspired_plus", "scout", "sff", "sdc",
    "apf", "olfati_saber", "olfati_saber_informed", "orca_informed", "random", "idle",
)} | {f"scout_{preset}": f"scout,preset={preset}" for preset in ("plus", "lead", "wary")} | {
    "pull": "proportional_tracking",
    "guarded:bio_inspired": "bio_inspired,safety_filter=true",
    "guarded:random": "random,safety_filter=true",
}  # fmt: skip
"""Hand-made policies: as a key names them, and the name that makes them today."""
NETWORKS = {"mappo": "mappo", "ppo": "ppo", "guarded:mappo": "mappo,safety_filter=true"}
"""The same of policies whose actions are compared, not hashed."""
DRIVER = "bio_inspired"
"""Whose percepts ``NETWORKS`` see."""
ATOL = 1e-6
"""How far their actions may be off. On a processor without AVX2 some are farther off, since NumPy's tanh is another."""
RUN = ("states", "percepts", "actions")
REWARDED = ("bio_inspired", "random", "idle")
"""Laws of whose runs the reward is hashed, too."""

LATE = {"timing.decision_period_s": 0.5}
SEA = {
    "current.speed_mps": 0.4, "current.variation_mps": 0.2, "current.eddies": 6, "current.eddy_speed_mps": 0.5,
    "mismatch.mass": 0.2, "mismatch.added_mass": 0.2, "mismatch.drag": 0.3, "mismatch.thrust": 0.2,
    "actuators.thrust_lag_s": 0.5, "actuators.yaw_lag_s": 0.3, "actuators.yaw_authority": 0.7,
    "latency.travel_time": True, "latency.processing_s": 0.2, "latency.compensated": True,
    "latency.active_period_s": 0.2, "latency.passive_period_s": 0.5,
    "noise.bearing_deg": 2.0, "noise.range_m": 0.5, "noise.range_share": 0.03, "noise.passive_range_log_sd": 0.2,
    "noise.active_r50_m": 80.0, "noise.passive_r50_m": 200.0, "noise.silence_probability": 0.02,
    "noise.silence_readings": 3, "noise.false_echo_probability": 0.02,
    "navigation.drift_share": 0.05, "navigation.compass_bias_deg": 5.0,
    "sonar.channels": ["modem"], "modem.period_s": 1.0, "modem.loss_probability": 0.1,
    "sonar.echo_reports": "surface", "sonar.obstacles_hide_vehicles": True,
    "faults": [
        {"kind": "thruster", "share": 0.2, "efficiency": 0.5, "onset_s": 4.0},
        {"kind": "yaw", "share": 0.2, "onset_s": 6.0, "duration_s": 3.0, "efficiency": 0.3},
        {"kind": "array", "array": "bow", "share": 0.2, "onset_s": 3.0, "duration_s": 5.0},
        {"kind": "member", "share": 0.2},
    ],
}  # fmt: skip
"""Everything that can go wrong, at once."""


class Setting(NamedTuple):
    """What runs are made in."""

    scenario: str
    decisions: int
    """How many, unless all episodes end before."""
    shown: int = 60
    """The same of what ``NETWORKS`` see."""
    overrides: Mapping[str, object] = {}
    controllers: tuple[str, ...] = tuple(CONTROLLERS)
    networks: tuple[str, ...] = tuple(NETWORKS)


SETTINGS = {
    "tracking": Setting("tracking", 100),
    "single_obstacle": Setting("single_obstacle", 500, 200),
    "multi_obstacle": Setting("multi_obstacle", 250),
    "lossy": Setting("lossy", 330),
    "random_field": Setting("random_field", 200),
    "starter": Setting(STARTER, 750, 600),
    "starter_sea": Setting(STARTER, 400, 400, SEA),
    "starter_late": Setting(STARTER, 150, 0, LATE, ("bio_inspired", "bio_inspired_plus", "scout_lead"), ()),
}
"""``starter`` is the frozen one."""
WHOLE = 2_200
"""Decisions of the paper's own law: whole episodes where there is one leg, and beyond the first turn elsewhere."""
FIELDS = "fields"
SCENARIOS = ("lossy", "multi_obstacle", "random_field", "single_obstacle", "starter", "tracking")
"""Those of commit 3eb4921 that still ship."""
EVERYWHERE = "all"


def made(section: str) -> dict[str, Any]:
    """Keys and values of a setting, or of the fields of scenarios; of an unknown section none."""
    return fields() if section == FIELDS else dict(runs(section)) if section in SETTINGS else {}


def runs(name: str) -> Iterator[tuple[str, Any]]:
    """Keys and values of a setting's runs."""
    setting = SETTINGS[name]
    scenario = load_scenario(setting.scenario, overrides=setting.overrides)
    for controller in setting.controllers:
        decisions = WHOLE if controller == DRIVER else setting.decisions
        parts = (*RUN, "reward") if controller in REWARDED else RUN
        for what, value in hashes(scenario, CONTROLLERS.get(controller, controller), decisions, parts).items():
            yield f"{name} {controller} {what}", value
    for network in setting.networks:
        yield f"{name} {network} sample", sample(scenario, NETWORKS[network], setting.shown)


def hashes(scenario: Scenario, policy: str, decisions: int, parts: tuple[str, ...]) -> dict[str, str]:
    """Of the parts of a run, a hash for each of its seeds."""
    scenario = with_policy_requirements(policy, scenario)
    env, actor = BatchedEnv(scenario, WORLDS, REWARD), make_policy(policy, scenario, WORLDS)
    hashed = {what: [hashlib.sha256() for _ in range(WORLDS)] for what in parts}
    running = np.ones(WORLDS, np.bool_)

    def add(what: str, *arrays: Any) -> None:
        for w in np.flatnonzero(running):
            for array in arrays:
                hashed[what][w].update(array[w].tobytes())

    env.reset(0)
    actor.reset(0)
    for _ in range(decisions):
        state, percept = env.swarm.state, env.swarm.percept
        actor.active[:] = running
        action = actor.act(percept)
        add("states", state.eta, state.nu, state.alive, state.tick, state.dwell)
        add("percepts", percept.flat)
        add("actions", action)
        told = env.step(action)
        if "reward" in hashed:
            add("reward", told.reward, told.world_reward, *told.terms.values())
        running &= ~told.over
        if not running.any():
            break
    return {what: " ".join(each.hexdigest()[:16] for each in worlds) for what, worlds in hashed.items()}


def sample(scenario: Scenario, policy: str, decisions: int) -> list[float]:
    """Actions of a policy that sees what ``DRIVER`` sees: of two vehicles of each world, at five times."""
    own = with_policy_requirements(policy, scenario)
    damping = with_policy_requirements(DRIVER, scenario).actuators.yaw_damping_nms
    driven = load_scenario(own, overrides={"actuators.yaw_damping_nms": damping})
    swarm, driver, actor = Swarm(driven, WORLDS), make_policy(DRIVER, driven, WORLDS), make_policy(policy, own, WORLDS)
    swarm.reset(0)
    driver.reset(0)
    actor.reset(0)
    shown: list[float] = []
    for k in range(1, decisions + 1):
        action = actor.act(swarm.percept)
        if k % (decisions // 5) == 0:
            shown += [round(float(number), 7) for number in action[:, [0, -1]].ravel()]
        swarm.step(driver.act(swarm.percept))
    return shown


def fields() -> dict[str, Any]:
    """Every field of the shipped scenarios: its value by scenario, or one value where all agree."""
    values: dict[str, dict[str, Any]] = {}
    for scenario in SCENARIOS:
        for field, value in leaves(load_scenario(scenario).model_dump(mode="json", exclude={"name"})):
            values.setdefault(f"{FIELDS} {field}", {})[scenario] = value
    return {field: {EVERYWHERE: next(iter(by.values()))} if alike(by) else by for field, by in values.items()}


def alike(by: Mapping[str, Any]) -> bool:
    """Whether all scenarios have the field, with one value."""
    return len(by) == len(SCENARIOS) and len(Counter(map(json.dumps, by.values()))) == 1


def leaves(data: Any, prefix: str = "") -> Iterator[tuple[str, Any]]:
    """Names and values of fields; of a list of tables its length and the fields of each."""
    for name, value in data.items() if isinstance(data, dict) else enumerate(data):
        tables = isinstance(value, list) and any(isinstance(entry, dict) for entry in value)
        if tables:
            yield f"{prefix}{name}", len(value)
        if tables or isinstance(value, dict):
            yield from leaves(value, f"{prefix}{name}.")
        else:
            yield f"{prefix}{name}", value


def differences(then: Mapping[str, Any], now: Mapping[str, Any]) -> list[str]:
    """A line for each key that differs. A field of a scenario may be new; nothing else may."""
    return [
        f"{key}: {json.dumps(then.get(key))} before, {json.dumps(now.get(key))} now"
        for key in sorted({**then, **now})
        if not same(key, then.get(key), now.get(key))
    ]


def same(key: str, before: Any, after: Any) -> bool:
    """Whether hashes are equal, the numbers of a sample near, or a field's values in all scenarios as before."""
    if key.startswith(f"{FIELDS} "):
        old, new = (
            dict.fromkeys(SCENARIOS, by[EVERYWHERE]) if EVERYWHERE in by else by for by in (before or {}, after or {})
        )
        return all(json.dumps(new.get(scenario)) == json.dumps(value) for scenario, value in old.items())
    if isinstance(before, list) and isinstance(after, list):
        return len(before) == len(after) and bool(np.all(np.abs(np.subtract(before, after)) <= ATOL))
    return before == after


def read() -> dict[str, Any]:
    """What golden.json holds, nothing if there is none."""
    return json.loads(FILE.read_text(encoding="utf-8")) if FILE.exists() else {}


def main() -> None:
    """Write golden.json, one key a line, and print which keys of it change."""
    now = {key: value for section in (*SETTINGS, FIELDS) for key, value in made(section).items()}
    print("\n".join(differences(read(), now)))
    lines = (f"{json.dumps(key)}: {json.dumps(value)}" for key, value in sorted(now.items()))
    FILE.write_text("{\n" + ",\n".join(lines) + "\n}\n", encoding="utf-8")


if __name__ == "__main__":
    main()
