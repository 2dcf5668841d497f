"""Write docs/speed.md and its picture from perf/results.json: python perf/report.py"""

import hashlib
import json
import statistics
from pathlib import Path
from typing import Any

from compare import AGENTS, CEILINGS, FLOOR_CELLS, PARTS, RESULTS, ROOT, WORLDS
from floor import Work, least_seconds, work
from matplotlib.figure import Figure

from uuv_marl.sim.cells import ONE_CELL_UP_TO

PAGE, PICTURE = ROOT / "docs" / "speed.md", ROOT / "docs" / "figures" / "speed.png"
Results = dict[str, Any]
Record = dict[str, Any]

COLUMNS = {
    "core": "`Swarm.step`",
    "vector_env": "`vector_env`",
    "parallel_env": "`parallel_env`",
    "mpe2": "MPE2",
    "vmas": "VMAS",
    "jaxmarl": "JaxMARL",
}
GOALS = (("vector_env", "jaxmarl", 10), ("vector_env", "vmas", 40), ("parallel_env", "mpe2", 200))
# Okabe and Ito's colours, told apart by the colour-blind; markers tell them apart without colour.
STYLES = {
    "core": ("#0072B2", "o"),
    "idle": ("#0072B2", "o"),
    "bio_inspired": ("#56B4E9", "s"),
    "vector_env": ("#009E73", "^"),
    "parallel_env": ("#000000", "v"),
    "mpe2": ("#D55E00", "D"),
    "vmas": ("#E69F00", "P"),
    "jaxmarl": ("#CC79A7", "X"),
}

TEXT = """# Speed

<!-- Written by perf/report.py from perf/results.json; a test fails where they differ. -->

`make perf` measures this page anew and writes it. One machine: {machine}, load average {load:g} at the start. Every
cell was built by all libraries, then measured in turn in {rounds} rounds of {seconds:g} s, so that a slow phase hits
all alike; a case that takes longer than 10 s has fewer. Medians over rounds [lowest, highest]. Measured {when}.

Versions: {versions}.

## Agent-steps per second

{rates}

{failures}

With 54 agents `parallel_env` makes {plain} agent-steps/s, and {terms} with `info_terms=True`.
`parallel_env` and MPE2 have no batch: their worlds are stepped one after the other in one process. JaxMARL
took {compiled} s to build and compile with {sizes} agents in 64 worlds, which is not counted.

How much faster we are, medians over rounds [lowest, highest]:

{ratios}

With 54 agents, each at its best number of worlds: {best}.

Read these with [what differs](#what-differs): they compare libraries on their own tasks, not one task.

## Three rates

A fast core is worth what reaches the learner. {three_agents} agents; worlds in brackets.

{three}

Training is Stable-Baselines3's PPO on rows of agents: two layers of 64, 16 steps a rollout, batches of 3456, 4 epochs.
JaxMARL's training is compiled together with its environment and is no part of its package; it was not measured.

## What differs

{differs}

Observation sizes with {sizes} agents: {entries}. Actions are random, drawn before the clock runs.

## The floor

What a step must do, whatever the code, and the time that this machine needs for just that: a pair loop that only sums
squared distances, a loop that keeps the nearest of each sub-sector, a loop of sines and cosines, a copy, each as good
as the compiler makes it, measured in the same rounds. One world runs on one thread, several on all. Arithmetic adds up,
memory may work meanwhile: floor = max(pairs + nearest kept + sines, bytes). A step of 0.1 s has every pair
(n (n - 1) / 2), each heard by two, {sines:g} sines and cosines and {bytes:g} bytes per vehicle; exponentials are the
controllers' alone ({exponentials} per second here). Above {one_cell} vehicles a grid spares most pairs, and a step may
take less than this floor.

{floor}

Where the time goes, 54 idle vehicles on `single_obstacle`, microseconds of a step of one world in a batch of 64, one
thread, each part measured by itself:

{profile}

## From few vehicles to many

One world on `tracking`: idle vehicles, whose start's two dense groups stay together, and vehicles under `bio_inspired`,
the controller's own time included, after up to 200 steps. Microseconds per vehicle and step:

{curve}

![Time per vehicle and step over vehicles, and agent-steps per second over worlds](figures/speed.png)
"""

DIFFERS = (
    ("", "uuv_marl", "MPE2", "VMAS", "JaxMARL"),
    ("task", "`single_obstacle`", "`simple_spread_v3`", "`flocking`", "`MPE_simple_spread_v3`"),
    (
        "motion in a step of 0.1 s",
        "3 degrees of freedom, Runge-Kutta: 4 evaluations of Eq. 1-4, float64",
        "points, 1 Euler step, float64",
        "points, 5 sub-steps, float32",
        "points, 1 Euler step, float32",
    ),
    (
        "pairs",
        "hearing, spacing, contacts of all vehicles; no contact force",
        "contact forces of agents and landmarks, collisions for the reward",
        "contact forces in each sub-step, distances for the reward",
        "as MPE2",
    ),
    (
        "sensing",
        "3 arrays of 7 sub-sectors, nearest vehicle in each; echoes of 1 obstacle",
        "none: all positions",
        "12 lidar rays against 5 obstacles; agents are not seen",
        "none: all positions",
    ),
    (
        "scenery",
        "1 obstacle",
        "as many landmarks as agents",
        "5 obstacles, 1 target; more than 54 agents start closer than by default",
        "as many landmarks as agents",
    ),
    (
        "observation",
        "as long for any n",
        "grows with n",
        "as long for any n",
        "grows with n",
    ),
    (
        "reset at an episode's end",
        "`Swarm.step` none; `vector_env` in the same step; `parallel_env` by the caller; thousands of steps apart",
        "none: episodes made endless",
        "none: episodes endless",
        "in every step, drawn whether needed or not",
    ),
    (
        "many worlds",
        "a loop over threads",
        "one after the other",
        "torch tensors on one thread or torch's own number of them, what is faster",
        "`jit` of a loop over `vmap(step)`, XLA's own threads",
    ),
    ("reward and endings", "not in `Swarm.step`", "yes", "yes", "yes"),
)


def table(head: tuple[str, ...], lines: list[tuple[str, ...]]) -> str:
    """A Markdown table."""
    return "\n".join(f"| {' | '.join(cells)} |" for cells in (head, ("---",) * len(head), *lines))


def short(value: float) -> str:
    """Three digits and a unit prefix."""
    for size, prefix in ((1e9, "G"), (1e6, "M"), (1e3, "k")):
        if value >= 0.9995 * size:
            return f"{_digits(value / size)}{prefix}"
    return _digits(value)


def _digits(value: float) -> str:
    return f"{value:.0f}" if value >= 99.95 else f"{value:#.3g}"


def spread(values: list[float]) -> str:
    """Median [lowest, highest]."""
    if len(values) == 1:
        return f"{short(values[0])} (once)"
    return f"{short(statistics.median(values))} [{short(min(values))}, {short(max(values))}]"


class Cases:
    """Records of a results file by what they are about."""

    def __init__(self, results: Results) -> None:
        self.records: list[Record] = results["cases"]

    def find(self, kind: str, case: str, agents: int, worlds: int | None = None) -> Record | None:
        """The record of a case, if it was measured or failed."""
        for record in self.records:
            if (record["kind"], record["case"], record["agents"]) == (kind, case, agents) and (
                worlds in (None, record["worlds"])
            ):
                return record
        return None

    def rates(self, kind: str, case: str, agents: int, worlds: int | None = None) -> list[float]:
        """Its rates, none where it has none."""
        record = self.find(kind, case, agents, worlds)
        return record["rates"] if record else []

    def cell(self, kind: str, case: str, agents: int, worlds: int | None = None) -> str:
        """Its rates for a table."""
        rates = self.rates(kind, case, agents, worlds)
        return spread(rates) if rates else "–"


def rates(cases: Cases) -> str:
    """Agent-steps per second of all libraries."""
    lines = [
        (str(agents), str(worlds), *(cases.cell("rates", case, agents, worlds) for case in COLUMNS))
        for agents in AGENTS
        for worlds in WORLDS
    ]
    return table(("agents", "worlds", *COLUMNS.values()), lines)


def failures(cases: Cases) -> str:
    """Why cells are empty, and which worlds were not all built."""
    lines = [
        f"- {COLUMNS.get(record['case'], record['case'])}, {record['agents']} agents x {record['worlds']} worlds: "
        f"{record['failed']}."
        for record in cases.records
        if "failed" in record and not record["rates"]
    ]
    for record in cases.records:
        built = record.get("facts", {}).get("built", record["worlds"])
        if record["rates"] and built < record["worlds"]:
            lines.append(
                f"- {COLUMNS[record['case']]}, {record['agents']} agents x {record['worlds']} worlds: {built} of the "
                "worlds, no more could be built within 20 s."
            )
    return "\n".join(["Without a figure, or with a reservation:", "", *lines]) if lines else "Every case ran."


def ratios(cases: Cases) -> str:
    """Our rate over a peer's in the same rounds."""
    lines: list[tuple[str, ...]] = []
    for agents in AGENTS:
        for worlds in WORLDS:
            cells = []
            for our, peer, _ in GOALS:
                both = zip(
                    cases.rates("rates", our, agents, worlds), cases.rates("rates", peer, agents, worlds), strict=False
                )
                values = [mine / theirs for mine, theirs in both]
                cells.append(spread(values) if values else "–")
            lines.append((str(agents), str(worlds), *cells))
    head = (f"{COLUMNS[our]} / {COLUMNS[peer]} (goal: {goal})" for our, peer, goal in GOALS)
    return table(("agents", "worlds", *head), lines)


def best(cases: Cases) -> str:
    """The best over the numbers of worlds, each library's own, at 54 agents."""
    texts = []
    for our, peer, _ in GOALS:
        both = [
            max((statistics.median(found) for w in WORLDS if (found := cases.rates("rates", case, 54, w))), default=0.0)
            for case in (our, peer)
        ]
        if all(both):
            texts.append(
                f"{COLUMNS[our]} {short(both[0])}, {COLUMNS[peer]} {short(both[1])}: {both[0] / both[1]:.3g} times"
            )
    return "; ".join(texts) or "not measured"


def three(cases: Cases) -> str:
    """Core, API and training of each library."""
    worlds = 64

    def trained(case: str) -> str:
        record = cases.find("training", case, 54)
        return f"{cases.cell('training', case, 54)} ({record['worlds']})" if record else "–"

    def rate(case: str) -> str:
        return f"{cases.cell('rates', case, 54, worlds)} ({worlds})"

    lines = [
        ("uuv_marl", rate("core"), f"`vector_env` {rate('vector_env')}", trained("ppo")),
        ("MPE2", "no core apart", rate("mpe2"), trained("mpe2_ppo")),
        ("VMAS", "no core apart", rate("vmas"), trained("vmas_ppo")),
        ("JaxMARL", rate("jaxmarl"), "the same: a compiled loop over its API", "not measured"),
    ]
    return table(("library", "raw core", "public API", "end-to-end training"), lines)


def entries(cases: Cases) -> str:
    """Numbers that an agent observes, for each library and number of agents."""
    texts = []
    for case, name in (("vector_env", "uuv_marl"), ("mpe2", "MPE2"), ("vmas", "VMAS"), ("jaxmarl", "JaxMARL")):
        found = (cases.find("rates", case, agents, 1) or {} for agents in AGENTS)
        texts.append(f"{name} " + ", ".join(str(record.get("facts", {}).get("entries", "–")) for record in found))
    return "; ".join(texts)


def floor(cases: Cases) -> str:
    """The step's time beside the least time."""
    lines: list[tuple[str, ...]] = []
    for agents, worlds in FLOOR_CELLS:
        core = cases.rates("rates", "core", agents, worlds)
        measured = [cases.rates("rates", kind, agents, worlds) for kind in CEILINGS]
        if not core or not all(measured):
            continue
        ceilings = Work(*map(max, measured))
        need, least = work(agents), least_seconds(agents, worlds, ceilings)
        parts = (worlds * amount / rate for amount, rate in zip(need, ceilings, strict=True))
        pairs, keeps, sines, _, copied = (f"{1e6 * part:,.1f}" for part in parts)
        shares = [least * rate / (agents * worlds) for rate in core]
        low, middle, high = min(shares), statistics.median(shares), max(shares)
        lines.append(
            (
                f"{agents} x {worlds}",
                f"{short(ceilings.pairs)}/s: {pairs}",
                f"{short(ceilings.keeps)}/s: {keeps}",
                f"{short(ceilings.sines)}/s: {sines}",
                f"{short(ceilings.bytes)}B/s: {copied}",
                f"{1e6 * least:,.1f}",
                f"{1e6 * agents * worlds / statistics.median(core):,.1f}",
                f"{middle:.2%} [{low:.2%}, {high:.2%}]",
            )
        )
    head = (
        "vehicles x worlds",
        "pairs [µs]",
        "nearest kept [µs]",
        "sines, cosines [µs]",
        "bytes [µs]",
        "floor [µs]",
        "step [µs]",
    )
    return table((*head, "floor / step"), lines)


def profile(cases: Cases) -> str:
    """Microseconds of a step of one world on one thread, by part."""
    times = {name: 54e6 / statistics.median(rates) for name in PARTS if (rates := cases.rates("profile", name, 54, 64))}
    if len(times) < len(PARTS):
        return "Not measured."
    moved, cells, measured, heard, perceived, whole = times.values()
    lines = [
        ("motion: actions, forces, Runge-Kutta, headings", moved),
        ("the living copied and sorted into cells", cells),
        ("spacing, clearance, contacts, extent", measured - cells),
        ("hearing: the nearest vehicle of every sub-sector", heard - cells),
        ("echoes and percepts", perceived - heard),
        ("all parts", moved + measured + perceived - cells),
        ("the whole step in one go", whole),
    ]
    return table(("part", "µs", "share"), [(name, f"{time:.1f}", f"{time / whole:.0%}") for name, time in lines])


def curve_points(cases: Cases, case: str) -> list[tuple[int, list[float]]]:
    """Numbers of vehicles, and microseconds per vehicle and step of each repeat."""
    found = [record for record in cases.records if record["kind"] == "curve" and record["case"] == case]
    return [(record["agents"], [1e6 / rate for rate in record["rates"]]) for record in found if record["rates"]]


def curve(cases: Cases) -> str:
    """Cost per vehicle and step over the number of vehicles."""
    idle, guided = dict(curve_points(cases, "idle")), dict(curve_points(cases, "bio_inspired"))
    lines = [
        (f"{agents:,}", *(spread(values[agents]) if agents in values else "–" for values in (idle, guided)))
        for agents in sorted({*idle, *guided})
    ]
    return table(("vehicles", "`Swarm.step`, idle", "`Swarm.step` and `bio_inspired`"), lines)


def text(results: Results) -> str:
    """The whole page."""
    cases, machine = Cases(results), results["machine"]
    dates = sorted({record["date"][:10] for record in cases.records})
    exponentials = [
        max(found) for a, w in FLOOR_CELLS if w == 1 and (found := cases.rates("rates", "exponentials", a, w))
    ]
    libraries = results["libraries"].values()
    versions = {"Python": ", ".join(sorted({library["python"] for library in libraries}))}
    for library in libraries:
        versions |= library["versions"]
    built = [cases.find("rates", "jaxmarl", agents, 64) or {} for agents in AGENTS]
    return TEXT.format(
        machine="{cpu}, {cores} cores, {memory_gib} GiB, {system}".format(**machine),
        load=results["load"],
        rounds=results["rounds"],
        seconds=results["seconds"],
        when=" to ".join(dict.fromkeys((dates[0], dates[-1]))),
        versions=", ".join(f"{name} {number}" for name, number in versions.items()),
        rates=rates(cases),
        failures=failures(cases),
        ratios=ratios(cases),
        three_agents=54,
        three=three(cases),
        best=best(cases),
        plain=cases.cell("terms", "parallel_env", 54, 1),
        terms=cases.cell("terms", "parallel_env_terms", 54, 1),
        differs=table(DIFFERS[0], list(DIFFERS[1:])),
        sizes=", ".join(map(str, AGENTS)),
        compiled=", ".join(f"{record['build_s']:.0f}" if "build_s" in record else "–" for record in built),
        entries=entries(cases),
        sines=work(1).sines,
        one_cell=ONE_CELL_UP_TO,
        bytes=work(1).bytes,
        exponentials=short(max(exponentials)) if exponentials else "–",
        floor=floor(cases),
        profile=profile(cases),
        curve=curve(cases),
    )


def draw(results: Results) -> Figure:
    """Cost over vehicles, and rate over worlds."""
    cases = Cases(results)
    figure = Figure((11.0, 5.2), dpi=120, layout="constrained")
    left, right = figure.subplots(1, 2)
    for case, name in (("idle", "Swarm.step, tracking"), ("bio_inspired", "Swarm.step and bio_inspired, tracking")):
        _line(left, case, name, curve_points(cases, case))
    for case in ("parallel_env", *(peer for _, peer, _ in GOALS)):
        found = [(agents, cases.rates("rates", case, agents, 1)) for agents in AGENTS]
        _line(left, case, COLUMNS[case].strip("`"), [(n, [1e6 / rate for rate in values]) for n, values in found], ":")
    left.set(
        xlabel="vehicles or agents in one world",
        ylabel="time per vehicle and step [µs]",
        title="One world; Swarm.step: idle",
    )
    for case, name in COLUMNS.items():
        _line(right, case, name.strip("`"), [(w, cases.rates("rates", case, 54, w)) for w in WORLDS])
    right.set(xlabel="worlds", ylabel="agent-steps per second [1/s]", title="54 vehicles or agents per world")
    for axes in (left, right):
        axes.set(xscale="log", yscale="log")
        axes.grid(visible=True, which="major", alpha=0.3)
    handles, names = (a + b for a, b in zip(*(axes.get_legend_handles_labels() for axes in (left, right)), strict=True))
    once = dict(zip(names, handles, strict=True))
    figure.legend(once.values(), once.keys(), loc="outside lower center", ncols=4)
    return figure


def _line(axes: Any, case: str, name: str, points: list[tuple[int, list[float]]], dashes: str = "-") -> None:
    """Medians with their lowest and highest."""
    points = [(at, values) for at, values in points if values]
    if not points:
        return
    colour, marker = STYLES[case]
    middle = [statistics.median(values) for _, values in points]
    below = [median - min(values) for median, (_, values) in zip(middle, points, strict=True)]
    above = [max(values) - median for median, (_, values) in zip(middle, points, strict=True)]
    axes.errorbar(
        [at for at, _ in points], middle, (below, above), color=colour, marker=marker, linestyle=dashes, capsize=2,
        label=name,
    )  # fmt: skip


def source(path: Path) -> str:
    """Hash of a results file, kept in the picture made of it."""
    return hashlib.sha256(path.read_bytes()).hexdigest()


def main() -> None:
    """Write the page and the picture."""
    results = json.loads(RESULTS.read_text(encoding="utf-8"))
    PAGE.write_text(text(results), encoding="utf-8")
    draw(results).savefig(PICTURE, metadata={"Source": source(RESULTS)})


if __name__ == "__main__":
    main()
