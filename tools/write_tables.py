"""Write the tables between ``<!-- name -->`` and ``<!-- /name -->`` of README.md and docs from the code and results."""

import re
from collections.abc import Callable, Mapping
from pathlib import Path

import uuv_marl
from uuv_marl import load_scenario, scenario_names, uuv_swarm_v0
from uuv_marl.benchmark.tables import markdown_table
from uuv_marl.envs.reward import TERMS
from uuv_marl.envs.state import state_table
from uuv_marl.percept import CHANNELS, PerceptField, PerceptLayout

ROOT = Path(__file__).resolve().parent.parent
PAGES = ROOT / "README.md", ROOT / "docs" / "environment.md", ROOT / "docs" / "scenarios.md"
RESULTS = ROOT / "docs" / "results.md"


def table(head: tuple[str, ...], lines: list[tuple[str, ...]]) -> str:
    """A Markdown table."""
    return markdown_table(head, lines).rstrip("\n")


def fields(layout: tuple[PerceptField, ...], start: int = 0) -> str:
    """A table of fields with the index range of each."""
    lines: list[tuple[str, ...]] = []
    for field in layout:
        kind = field.kind
        entries = f"{start}" if field.size == 1 else f"{start}-{start + field.size - 1}"
        bounds = f"{kind.low / kind.scale:g} to {kind.high / kind.scale:g}"
        lines.append((entries, f"`{field.name}`", field.meaning, kind.unit, f"{kind.scale:g}", bounds))
        start += field.size
    return table(("entries", "name", "meaning", "unit", "scale", "bounds (scaled)"), lines)


def benchmark() -> str:
    """The short table of ``single_obstacle`` from the long one in docs/results.md."""
    section = RESULTS.read_text(encoding="utf-8").partition("\n## single_obstacle")[2].partition("\n## ")[0]
    lines: list[tuple[str, ...]] = []
    for line in section.splitlines():
        if line.startswith("| ") and not line.startswith(("| policy", "| ---")):
            policy, extra, _, time, _, _, obstacle, _, spacing, _, _, collisions, _ = line.strip("| ").split(" | ")
            name = f"`{policy}`" + ("" if extra == "–" else f" with {extra.removesuffix(' 600 N m s')}")
            closest = f"{float(obstacle):.1f} m, {float(spacing):.1f} m"
            lines.append((name, f"{time.split()[0]} s", closest, collisions))
    closest = "smallest distance to the obstacle, to a vehicle (worst seed)"
    return table(("policy, and what it gets beyond sonar", "task time", closest, "collisions"), lines)


def scenarios() -> str:
    """Every scenario that ships."""
    lines = [
        (f"`{s.name}`", s.title, f"{s.swarm.num_vehicles}", f"{s.max_obstacles or 'none'}", s.source)
        for s in map(load_scenario, scenario_names())
    ]
    return table(("name", "what", "vehicles", "obstacles (at most)", "source"), lines)


def facts() -> str:
    """The environment at a glance, in the form that PettingZoo's pages have."""
    env = uuv_marl.parallel_env("single_obstacle")
    agents, timing = env.possible_agents, env.scenario.timing
    return table(
        ("what", "value"),
        [
            ("name", f"`{env.metadata['name']}`"),
            ("import", "`from uuv_marl import uuv_swarm_v0`, or `import uuv_marl`"),
            ("agents", f"{len(agents)}: `{agents[0]}` to `{agents[-1]}`; `num_vehicles` sets any number from 1"),
            ("actions", f"continuous, `{env.action_space('uuv_0')}`"),
            ("observations", f"`Box`, float32, shape {env.observation_space('uuv_0').shape}, finite bounds"),
            ("state", f"`Box`, float32, shape {env.state_space.shape}"),
            ("parallel API, AEC API", "yes, yes"),
            ("time between two decisions (`decision_period`)", f"{timing.decision_period_s:g} s"),
            ("time for which a force is held, integration step",
             f"{timing.control_hold_s:g} s, {timing.integration_step_s:g} s"),
            ("render modes", ", ".join(f"`{mode}`" for mode in env.metadata["render_modes"])),
        ],
    )  # fmt: skip


def channels() -> str:
    """The fields that all channels append to the observation."""
    plain = PerceptLayout.of(load_scenario("single_obstacle"))
    full = PerceptLayout.of(load_scenario("single_obstacle", overrides={"sonar.channels": list(CHANNELS)}))
    return fields(full.table[len(plain.table) :], plain.size)


def actions() -> str:
    """The two entries of an action."""
    limits = load_scenario("single_obstacle").actuators
    return table(
        ("entry", "meaning", "unit", "value at 1"),
        [
            ("0", "surge force, ahead positive", "N", f"{limits.max_force_n:g}"),
            ("1", "yaw torque, to starboard positive", "N m", f"{limits.max_torque_nm:g}"),
        ],
    )


def rewards() -> str:
    """The reward's terms and their weights."""
    scenario = load_scenario("single_obstacle")
    weights, limits = scenario.reward.model_dump(), scenario.constraints
    terms = [(f"`{name}`", what, f"{weights[name]:g}" if name in weights else "") for name, what in TERMS.items()]
    lengths = f"s_l = {limits.s_l_m:g} m, s_o = {limits.s_o_m:g} m, s_u = {limits.s_u_m:g} m."
    return f"{table(('term', 'value', 'weight w'), terms)}\n\n{lengths}"


def endings() -> str:
    """What ends an episode, for whom, and how."""
    scenario = load_scenario("single_obstacle")
    arrival, limit, hull = scenario.arrival, scenario.time_limit, scenario.contact.hull_radius_m
    arrived = (
        f"arrival: l(t) has stopped, the swarm's centre has been within {arrival.radius_m:g} m of the end for "
        f"{arrival.dwell_s:g} s, and every vehicle is within {arrival.spread_m:g} m x max(1, sqrt(n/54)) of it"
    )
    late = f"the time limit, {limit.factor:g} x the trajectory's duration + {limit.extra_s:g} s, or `max_cycles` steps"
    lost = "a vehicle is lost: at `disturbance.loss_times_s` (`lossy`), or by a collision if `contact.ends_vehicle`"
    ends = [
        (arrived, "all vehicles", "terminated"),
        (late, "all vehicles", "truncated"),
        (lost, "that vehicle", "terminated"),
        ("the last vehicle is lost", "the world", "terminated"),
    ]
    collision = (
        f"Two vehicles collide when their centres are nearer than {2 * hull:g} m; a vehicle collides with an obstacle\n"
        f"when its centre is nearer than {hull:g} m to the surface."
    )
    return f"{table(('what happens', 'whose episode ends', 'how'), ends)}\n\n{collision}"


TABLES: Mapping[str, Callable[[], str]] = {
    "benchmark": benchmark,
    "scenarios": scenarios,
    "facts": facts,
    "observation": lambda: fields(PerceptLayout.of(load_scenario("single_obstacle")).table),
    "channels": channels,
    "actions": actions,
    "rewards": rewards,
    "endings": endings,
    "state": lambda: fields(state_table(load_scenario("single_obstacle"))),
    "history": lambda: table(("version", "what changed"), list(uuv_swarm_v0.HISTORY.items())),
}
"""The tables by the names of their marks."""


def written(page: Path) -> str:
    """A page with every marked table written anew."""
    marked = r"<!-- (\w+) -->\n.*?<!-- /\1 -->"
    anew = lambda found: f"<!-- {found[1]} -->\n{TABLES[found[1]]()}\n<!-- /{found[1]} -->"  # noqa: E731
    return re.sub(marked, anew, page.read_text(encoding="utf-8"), flags=re.S)


if __name__ == "__main__":
    for one in PAGES:
        one.write_text(written(one), encoding="utf-8")
