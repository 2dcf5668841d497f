"""Write docs/environment.md and the README's table of the observation from the code."""

from pathlib import Path

import uuv_marl
from uuv_marl import load_scenario, uuv_swarm_v0
from uuv_marl.envs.reward import TERMS
from uuv_marl.envs.state import state_table
from uuv_marl.percept import PerceptField, PerceptLayout
from uuv_marl.scenario import Scenario

ROOT = Path(__file__).resolve().parent.parent
PAGE, README = ROOT / "docs" / "environment.md", ROOT / "README.md"
MARKS = "<!-- observation -->", "<!-- /observation -->"

TEXT = """# The environment

<!-- Written by tools/write_tables.py from the code; a test fails where they differ. -->

{facts}

Numbers on this page are those of `single_obstacle`; every one is a field of the scenario.
Frames: body frame x forward, y starboard; world frame north, east; headings clockwise from north.

## Observation: `Box`, float32, shape ({size},)

An entry is the value in its unit divided by the scale; scales are powers of two, so that nothing is lost. What a
vehicle knows with the default sonar suite (three arrays of seven sub-sectors, the bow's active). Invariant under
rotation and translation of the world.

{percept}

### Channels

Off by default; granted by `overrides={{"sonar.channels": ["compass", "link"]}}`, and appended in this order.

{channels}

## Action: `Box(-1, 1, (2,))`, float32

| entry | meaning | unit | scale |
| --- | --- | --- | --- |
| 0 | surge force, ahead positive | N | {force:g} |
| 1 | yaw torque, to starboard positive | N m | {torque:g} |

Projected onto the unit disc, direction kept. Where the decision period is longer than the control hold, the action is a
horizontal force that is held in the world frame and projected anew on the vehicle's axes at every hold.

## Reward

Per agent, the sum of these terms. `reward="team"` gives everybody the mean over all vehicles (and a lost vehicle its
own loss besides), `reward=function` takes your own; a vector environment's row is the mean.

{rewards}

s_l = {s_l:g} m, s_o = {s_o:g} m, s_u = {s_u:g} m (Eq. 7).

## Endings

| what | who | how |
| --- | --- | --- |
| arrival: l(t) at rest, the swarm's centre within {radius:g} m of the end for {dwell:g} s, every vehicle within \
{spread:g} m x max(1, sqrt(n/54)) of it | all | terminated |
| the time limit: {factor:g} x the trajectory's duration + {extra:g} s, or `max_cycles` decisions | all | truncated |
| a vehicle is lost: at `disturbance.loss_times_s` (`lossy`), or by a collision where `contact.ends_vehicle` \
| that one | terminated |
| the last vehicle is lost | the world | terminated |

A collision (centres nearer than {contact:g} m, or an obstacle's surface nearer than {hull:g} m) is counted and
charged, and ends nothing unless `contact.ends_vehicle` says so. A lost vehicle is heard by nobody.

{apis}

## Seeds

`reset(seed=s)` fixes the episode bit for bit; world w of several starts from `s + w` and is the same as alone, through
every API. Unseeded resets and resets at an episode's end go on with that world's own random stream.

## State: `Box`, float32, shape ({state_size},)

`state()`, for centralised critics. Positions are relative to l(t), north and east; vehicles in the order of agents.

{state}

## Version history

{history}
"""

APIS = (
    ("PettingZoo `parallel_env`, `env`", "leaves `agents`", "no: call `reset`"),
    ("Gymnasium `vector_env`", 'row of zeros, `infos["agent_mask"]` False', "same step: `AutoresetMode.SAME_STEP`"),
    ("Gymnasium `Solo-v0`", "the learner's loss ends the episode, others' do not", "no: call `reset`"),
    ("SB3 `SwarmVecEnv`", "such scenarios are refused", "same step, all rows of the world"),
    ("TorchRL `SwarmEnv`", "stays terminated, `mask` False", "by collectors and `rollout`, on the root's `done`"),
    ("BenchMARL `SwarmTask`", "such scenarios are refused", "as TorchRL"),
    ("RLlib `SwarmMultiAgentEnv`", "terminated alone, then absent", "by RLlib, on `__all__`"),
)


def table(head: tuple[str, ...], lines: list[tuple[str, ...]]) -> str:
    """A Markdown table."""
    rows = [head, ("---",) * len(head), *lines]
    return "\n".join(f"| {' | '.join(cells)} |" for cells in rows)


def fields(layout: tuple[PerceptField, ...], start: int = 0) -> str:
    """A table of fields with the index range of each."""
    lines: list[tuple[str, ...]] = []
    for field in layout:
        entries = f"{start}" if field.size == 1 else f"{start}-{start + field.size - 1}"
        bounds = f"{field.low / field.scale:g} to {field.high / field.scale:g}"
        lines.append((entries, f"`{field.name}`", field.meaning, field.unit, f"{field.scale:g}", bounds))
        start += field.size
    return table(("entries", "name", "meaning", "unit", "scale", "bounds (scaled)"), lines)


def facts(scenario: Scenario) -> str:
    """The environment at a glance, in the form that PettingZoo's pages have."""
    env = uuv_marl.parallel_env(scenario)
    agents, timing = env.possible_agents, scenario.timing
    return table(
        ("what", "value"),
        [
            ("name", f"`{env.metadata['name']}`"),
            ("import", "`from uuv_marl import uuv_swarm_v0`, or `import uuv_marl`"),
            ("agents", f"{len(agents)}: `{agents[0]}` to `{agents[-1]}`; any number from 1 by `num_vehicles`"),
            ("actions", f"continuous, `{env.action_space('uuv_0')}`"),
            ("observations", f"`Box`, float32, shape {env.observation_space('uuv_0').shape}, finite bounds"),
            ("state", f"`Box`, float32, shape {env.state_space.shape}"),
            ("parallel API, AEC API", "yes, yes"),
            ("decision period", f"{timing.decision_period_s:g} s, by `decision_period`"),
            ("control hold, integration step", f"{timing.control_hold_s:g} s, {timing.integration_step_s:g} s"),
            ("render modes", ", ".join(f"`{mode}`" for mode in env.metadata["render_modes"])),
        ],
    )


def rewards(scenario: Scenario) -> str:
    """The reward's terms and their weights."""
    weights = scenario.reward.model_dump()
    return table(
        ("term", "what", "weight w"),
        [(f"`{name}`", what, f"{weights[name]:g}" if name in weights else "") for name, what in TERMS.items()],
    )


def text() -> str:
    """The whole page."""
    scenario = load_scenario("single_obstacle")
    layout = PerceptLayout.of(scenario)
    full = PerceptLayout.of(load_scenario(scenario, overrides={"sonar.channels": ["compass", "link"]}))
    state, limits, arrival, hull = state_table(scenario), scenario.constraints, scenario.arrival, scenario.contact
    return TEXT.format(
        facts=facts(scenario),
        size=layout.size,
        percept=fields(layout.table),
        channels=fields(full.table[len(layout.table) :], layout.size),
        force=scenario.actuators.max_force_n,
        torque=scenario.actuators.max_torque_nm,
        rewards=rewards(scenario),
        s_l=limits.s_l_m,
        s_o=limits.s_o_m,
        s_u=limits.s_u_m,
        radius=arrival.radius_m,
        dwell=arrival.dwell_s,
        spread=arrival.spread_m,
        factor=scenario.time_limit.factor,
        extra=scenario.time_limit.extra_s,
        contact=2 * hull.hull_radius_m,
        hull=hull.hull_radius_m,
        apis=table(("API", "a vehicle that was lost", "reset at an episode's end"), list(APIS)),
        state_size=sum(field.size for field in state),
        state=fields(state),
        history=table(("version", "what changed"), list(uuv_swarm_v0.HISTORY.items())),
    )


def readme() -> str:
    """The README with the observation's table between its marks."""
    before, _, rest = README.read_text(encoding="utf-8").partition(MARKS[0])
    _, _, after = rest.partition(MARKS[1])
    return f"{before}{MARKS[0]}\n{fields(PerceptLayout.of(load_scenario('single_obstacle')).table)}\n{MARKS[1]}{after}"


if __name__ == "__main__":
    PAGE.write_text(text(), encoding="utf-8")
    README.write_text(readme(), encoding="utf-8")
