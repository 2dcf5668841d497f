"""Write the tables between ``<!-- name -->`` and ``<!-- /name -->`` of README.md and docs from the code and results."""

import re
from collections.abc import Sequence
from pathlib import Path

import uuv_marl
from research.dynamics import acceptance
from research.episodes import measured, read_rows, select
from research.heldout import page as heldout
from research.tasks.studies import set_name
from uuv_marl import load_scenario, scenario_names, uuv_swarm_v2
from uuv_marl.benchmark.tables import markdown_table
from uuv_marl.envs.state import state_table
from uuv_marl.percept import CHANNELS, EPISODE, PerceptField, PerceptLayout, percept_table
from uuv_marl.scenario.task import task_class
from uuv_marl.sim.observation import closeness_table
from uuv_marl.tasks import TASKS, Follow
from uuv_marl.tasks.reach import Reach

ROOT = Path(__file__).resolve().parent.parent
NAMES = ("environment", "results", "scenarios", "tasks", "vehicles")
PAGES = (ROOT / "README.md", *(ROOT / "docs" / f"{name}.md" for name in NAMES))
MARKED = re.compile(r"<!-- (\w+) -->\n(.*?)\n<!-- /\1 -->", re.DOTALL)
RESULTS = ROOT / "docs" / "results.md"
TIERS = {task: read_rows(ROOT / "docs" / f"{task}.csv.gz") for task in ("hard_water", "two_swarms")}
README_ROWS = {
    "bio_inspired": "`bio_inspired`: the paper's controller",
    "sff": "`sff`: reconstruction, observes link",
    "sdc": "`sdc`: reconstruction, observes compass, link, identity",
    "scout": "`scout`: controller with memory and safety filter",
    "tangent_bug": "`tangent_bug`: controller for walls",
    "mappo": "`mappo`, `mappo_hard_water`, `mappo_two_swarms`: a network for each column",
}
"""Policies in README's table, and what it says of them."""
HELD = heldout.tables(read_rows(ROOT / "docs" / "heldout.csv.gz"))


def table(head: tuple[str, ...], lines: list[tuple[str, ...]]) -> str:
    """A Markdown table."""
    return markdown_table(head, lines).rstrip("\n")


def rows(lines: Sequence[Sequence[str]]) -> str:
    """The same of rows of which the first is the head."""
    return table(tuple(lines[0]), [tuple(line) for line in lines[1:]])


def fields(layout: tuple[PerceptField, ...], start: int = 0) -> str:
    """A table of fields with the index range of each."""
    lines: list[tuple[str, ...]] = []
    for field in layout:
        quantity = field.quantity
        entries = f"{start}" if field.size == 1 else f"{start}-{start + field.size - 1}"
        bounds = f"{quantity.low / quantity.scale:g} to {quantity.high / quantity.scale:g}"
        lines.append((entries, f"`{field.name}`", field.meaning, quantity.unit, f"{quantity.scale:g}", bounds))
        start += field.size
    return table(("entries", "name", "meaning", "unit", "scale", "bounds (scaled)"), lines)


def benchmark() -> str:
    """README's table: time and collisions from ``single_obstacle`` in docs/results.md, success from the tasks' rows."""
    section = RESULTS.read_text(encoding="utf-8").partition("\n## single_obstacle")[2].partition("\n## ")[0]
    found = {cells[0]: cells for line in section.splitlines() if len(cells := line.strip("| ").split(" | ")) > 12}
    lines: list[tuple[str, ...]] = []
    for policy, words in README_ROWS.items():
        cells = found.get(policy)
        first = f"{cells[3].split()[0]} s, {cells[11]}" if cells else "–"
        walls, gap = (shares(f"{policy}_{task}" if policy == "mappo" else policy, task) for task in TIERS)
        lines.append((words, first, walls, gap))
    heads = ("one obstacle: time, collisions", "walls: success", "one gap: success")
    return table(("policy", *heads), lines)


def shares(policy: str, task: str) -> str:
    """Share of vehicles that succeed in a task's medium tier, mean over the kinds of maps that it samples."""
    kinds = getattr(load_scenario(task).task_numbers, "kinds", [""])
    sets = [select(TIERS[task], policy=policy, set=set_name(task, kind)) for kind in kinds]
    means = [sum(measured(each, "success_share")) / len(each) for each in sets if each]
    return f"{sum(means) / len(means):.2f}".replace("0.", ".") if means else "–"


def scenarios() -> str:
    """Every scenario that ships."""
    lines = [
        (f"`{s.name}`", s.title, f"{s.swarm.num_vehicles}", f"{s.max_obstacles or 'none'}", s.source)
        for s in map(load_scenario, scenario_names())
    ]
    return table(("name", "what", "vehicles", "obstacles (at most)", "source"), lines)


def tasks() -> list[tuple[str, ...]]:
    """Every task that ships: its name, what it is, its numbers with their values."""
    return [
        (f"`{name}`", (task.__doc__ or "").splitlines()[0],
         ", ".join(f"`{field}`" for field in task.Numbers.model_fields) or "none")
        for name, task in ((name, task_class(name)) for name in TASKS)
    ]  # fmt: skip


def channels() -> str:
    """The fields that all channels append to the observation."""
    scenario = load_scenario("single_obstacle")
    sonar, plain = scenario.sonar, PerceptLayout.of(scenario)
    full = (*percept_table(sonar.num_sectors, sonar.num_active_sectors, CHANNELS, message_entries=2), *EPISODE)
    return fields(full[len(plain.table) :], plain.size)


def filled() -> dict[str, str]:
    """The tables of ``tables.md``, by name."""
    env = uuv_marl.parallel_env("single_obstacle")
    scenario, agents = env.scenario, env.possible_agents
    weights = scenario.reward.model_dump()
    terms = [
        (f"`{name}`", what, f"{weights[name]:g}" if name in weights else "")
        for name, what in Follow.rewards["dense"].items()
    ]
    text = Path(__file__).with_name("tables.md").read_text(encoding="utf-8")
    values = {
        "env": env, "scenario": scenario, "agents": agents, "last": agents[-1],
        "action": env.action_space(agents[0]), "observation": env.observation_space(agents[0]),
        "render_modes": ", ".join(f"`{mode}`" for mode in env.metadata["render_modes"]),
        "terms": table(("term", "value", "weight w"), terms), "hulls": 2 * scenario.collision.hull_radius_m,
    }  # fmt: skip
    return dict(MARKED.findall(text.format(**values)))


TABLES = filled() | {
    "benchmark": benchmark(),
    "scenarios": scenarios(),
    "observation": fields(PerceptLayout.of(load_scenario("single_obstacle")).table),
    "closeness": fields(closeness_table(load_scenario("single_obstacle"))),
    "reach": table(("term", "value"), [(f"`{name}`", what) for name, what in Reach.rewards["dense"].items()]),
    "tasks": table(("name", "what", "numbers of its own"), tasks()),
    "channels": channels(),
    "state": fields(state_table(load_scenario("single_obstacle"))),
    "vehicles": rows(acceptance.measures()),
    "figures": rows(acceptance.figures()),
    "stability": rows(acceptance.stability()),
    "heldout": HELD[0].rstrip("\n"),
    "fields": HELD[1].rstrip("\n"),
    "history": table(("version", "what changed"), list(uuv_swarm_v2.HISTORY.items())),
}
"""The tables by the names of their marks."""


def written(page: Path) -> str:
    """A page with every marked table written again."""
    filled_table = lambda found: f"<!-- {found[1]} -->\n{TABLES[found[1]]}\n<!-- /{found[1]} -->"  # noqa: E731
    return MARKED.sub(filled_table, page.read_text(encoding="utf-8"))


if __name__ == "__main__":
    for one in PAGES:
        one.write_text(written(one), encoding="utf-8")
