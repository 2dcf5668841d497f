"""Write the tables of observation and state, generated from the code, into docs/observation.md and the README."""

from pathlib import Path

from uuv_marl import load_scenario
from uuv_marl.envs.state import state_table
from uuv_marl.percept import PerceptField, PerceptLayout

ROOT = Path(__file__).resolve().parent.parent
PAGE, README = ROOT / "docs" / "observation.md", ROOT / "README.md"
MARKS = "<!-- observation -->", "<!-- /observation -->"

TEXT = """# Observation, action, state

<!-- Written by tools/write_tables.py from the code; a test fails where they differ. -->

An observation entry is the value in its unit divided by the scale; scales are powers of two, so that nothing is lost.
Frames: body frame x forward, y starboard; world frame north, east; headings clockwise from north.

## Observation: `Box`, float32, shape ({size},)

What a vehicle knows with the default sonar suite (three arrays of seven sub-sectors, the bow's active). Invariant under
rotation and translation of the world.

{percept}

### Channels

Off by default; granted by `overrides={{"sonar.channels": ["compass", "link"]}}`, and appended in this order.

{channels}

## Action: `Box(-1, 1, (2,))`, float32

| entry | meaning | unit | scale |
| --- | --- | --- | --- |
| 0 | surge force, ahead positive | N | `actuators.max_force_n` |
| 1 | yaw torque, to starboard positive | N m | `actuators.max_torque_nm` |

Projected onto the unit disc, direction kept. Where `timing.decision_period_s` is longer than the control hold, the
action is a horizontal force that is held in the world frame and projected anew on the vehicle's axes at every hold.

## State: `Box`, float32, shape ({state_size},) for `single_obstacle`

`env.state()`, for centralised critics. Positions are relative to l(t), north and east; vehicles in the order of agents.

{state}
"""


def rows(table: tuple[PerceptField, ...], start: int = 0) -> str:
    """Markdown rows with the index range of every field."""
    lines = ["| entries | name | meaning | unit | scale | bounds (scaled) |", "| --- | --- | --- | --- | --- | --- |"]
    for field in table:
        entries = f"{start}" if field.size == 1 else f"{start}-{start + field.size - 1}"
        bounds = f"{field.low / field.scale:g} to {field.high / field.scale:g}"
        lines.append(f"| {entries} | `{field.name}` | {field.meaning} | {field.unit} | {field.scale:g} | {bounds} |")
        start += field.size
    return "\n".join(lines)


def text() -> str:
    """The whole page."""
    scenario = load_scenario("single_obstacle")
    layout = PerceptLayout.of(scenario)
    full = PerceptLayout.of(load_scenario(scenario, overrides={"sonar.channels": ["compass", "link"]}))
    state = state_table(scenario)
    return TEXT.format(
        size=layout.size,
        percept=rows(layout.table),
        channels=rows(full.table[len(layout.table) :], layout.size),
        state_size=sum(field.size for field in state),
        state=rows(state),
    )


def readme() -> str:
    """The README with the observation's table between its marks."""
    before, _, rest = README.read_text(encoding="utf-8").partition(MARKS[0])
    _, _, after = rest.partition(MARKS[1])
    table = rows(PerceptLayout.of(load_scenario("single_obstacle")).table)
    return f"{before}{MARKS[0]}\n{table}\n{MARKS[1]}{after}"


if __name__ == "__main__":
    PAGE.write_text(text(), encoding="utf-8")
    README.write_text(readme(), encoding="utf-8")
