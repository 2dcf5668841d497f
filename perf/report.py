"""Fill the tables of docs/speed.md, perf/adapters.md and perf/training.md from the results files: python perf/report.py

A table lies between two marks with its name, ``<!-- rates -->`` and ``<!-- /rates -->``; the words around it are
written by hand. A page of which nothing was measured stays as it is.
"""

import hashlib
import json
import math
import re
from collections.abc import Callable, Iterable, Sequence
from pathlib import Path
from statistics import median
from typing import Any

from compare import ADAPTERS, AGENTS, CEILINGS, FLOOR_CELLS, HERE, PARTS, RESULTS, ROOT, TRAININGS, WORLDS
from floor import least_seconds, work
from matplotlib.figure import Figure

from uuv_marl.benchmark.style import house_style

SPEED, PICTURE = ROOT / "docs" / "speed.md", ROOT / "docs" / "figures" / "speed.png"
# Names and styles; Okabe and Ito's colours are told apart by the colour-blind, markers without colour.
COLUMNS = {
    "core": "`Swarm.step`", "vector_env": "`vector_env`", "parallel_env": "`parallel_env`", "mpe2": "MPE2",
    "vmas": "VMAS", "jaxmarl": "JaxMARL",
}  # fmt: skip
STYLES = {
    "core": ("#0072B2", "o"), "idle": ("#999999", "*"), "bio_inspired": ("#56B4E9", "s"), "mpe2": ("#D55E00", "D"),
    "vector_env": ("#009E73", "^"), "parallel_env": ("#000000", "v"), "vmas": ("#E69F00", "P"),
    "jaxmarl": ("#CC79A7", "X"),
}  # fmt: skip
PAGES = {
    SPEED: (RESULTS, "rates"),
    HERE / "adapters.md": (RESULTS, "adapters"),
    HERE / "training.md": (TRAININGS, "trainings"),
}
"""The file that a page is made of, and the kind of case without which it stays as it is."""
PAIRS = (("vector_env", "jaxmarl"), ("vector_env", "vmas"), ("parallel_env", "mpe2"))
GRID = [(agents, worlds) for agents in AGENTS for worlds in WORLDS]


def table(head: Iterable[str], rows: Iterable[Iterable[str]]) -> str:
    """A Markdown table."""
    head = tuple(head)
    return "\n".join(f"| {' | '.join(cells)} |" for cells in (head, ("---",) * len(head), *rows))


def short(value: float) -> str:
    """Three digits and a unit prefix."""
    size, prefix = next((s for s in ((1e9, "G"), (1e6, "M"), (1e3, "k")) if value >= 0.9995 * s[0]), (1.0, ""))
    return (f"{value / size:.0f}" if value / size >= 99.95 else f"{value / size:#.3g}") + prefix


def spread(values: Sequence[float]) -> str:
    """Median [lowest, highest]."""
    if len(values) < 2:
        return f"{short(values[0])} (once)" if values else "–"
    return f"{short(median(values))} [{short(min(values))}, {short(max(values))}]"


class Cases:
    """Records of a results file by what they are about."""

    def __init__(self, path: Path) -> None:
        self.results: dict[str, Any] = json.loads(path.read_text(encoding="utf-8"))
        self.records: list[dict[str, Any]] = self.results["cases"]
        self._by = {(r["kind"], r["case"], r["agents"], r["worlds"]): r for r in self.records}

    def find(self, case: str, agents: int, worlds: int, kind: str = "rates") -> dict[str, Any]:
        """The record of a case, one without rates where there is none."""
        return self._by.get((kind, case, agents, worlds), {"rates": []})

    def rates(self, case: str, agents: int, worlds: int, kind: str = "rates") -> list[float]:
        """Its rates."""
        return self.find(case, agents, worlds, kind)["rates"]

    def ratios(self, ours: str, theirs: str, agents: int, worlds: int, kind: str = "rates") -> list[float]:
        """Of two cases, round by round."""
        both = zip(*(self.rates(case, agents, worlds, kind) for case in (ours, theirs)), strict=False)
        return [mine / other for mine, other in both]


def measured(cases: Cases) -> str:
    """Machine, rounds, date and versions."""
    results, dates = cases.results, sorted(record["date"][:10] for record in cases.records)
    versions = {"Python": ", ".join(sorted({library["python"] for library in results["libraries"].values()}))}
    for library in results["libraries"].values():
        versions |= library["versions"]
    return (
        "{cpu}, {cores} cores, {memory_gib} GiB, {system}".format(**results["machine"])
        + f", load average {results['load']:g} at the start. {results['rounds']} rounds of {results['seconds']:g} s. "
        f"Measured {' to '.join(dict.fromkeys((dates[0], dates[-1])))}.\n\n"
        f"Versions: {', '.join(f'{name} {number}' for name, number in versions.items())}."
    )


def headline(cases: Cases) -> str:
    """Best against best at 54 agents, and where we do worst."""
    rows: list[tuple[str, ...]] = []
    for pair in PAIRS:
        best = [max(median(cases.rates(case, 54, w) or [0.0]) for w in WORLDS) for case in pair]
        ratios = {median(found): cell for cell in GRID if (found := cases.ratios(*pair, *cell))}
        if ratios and all(best):
            agents, worlds = ratios[min(ratios)]
            lowest = f"{min(ratios):#.3g} ({agents} agents, {worlds} world{'s' * (worlds > 1)})"
            names = (COLUMNS[case] for case in pair)
            rows.append((" / ".join(names), *map(short, best), f"{best[0] / best[1]:.3g}", lowest))
    return table(("54 agents, best number of worlds", "ours", "theirs", "ratio", "lowest ratio of all cells"), rows)


def rates(cases: Cases) -> str:
    """Agent-steps per second of all libraries."""
    rows = ((f"{a}", f"{w}", *(spread(cases.rates(case, a, w)) for case in COLUMNS)) for a, w in GRID)
    return table(("agents", "worlds", *COLUMNS.values()), rows)


def ratios(cases: Cases) -> str:
    """Our rates over the peers' in the same rounds."""
    rows = ((f"{a}", f"{w}", *(spread(cases.ratios(*pair, a, w)) for pair in PAIRS)) for a, w in GRID)
    return table(("agents", "worlds", *(f"{COLUMNS[our]} / {COLUMNS[peer]}" for our, peer in PAIRS)), rows)


def notes(cases: Cases) -> str:
    """Why cells are empty, which worlds were not all built, and other numbers of the cases."""
    lines: list[str] = []
    for record in cases.records:
        agents, worlds, built = record["agents"], record["worlds"], record.get("facts", {}).get("built", math.inf)
        where = f"{COLUMNS.get(record['case'], record['case'])}, {agents} agents x {worlds} worlds"
        if "failed" in record and not record["rates"]:
            lines.append(f"{where}: {record['failed']}.")
        elif built < worlds:
            lines.append(f"{where}: {built} of the worlds, no more could be built within 20 s.")
    plain, terms = (spread(cases.rates(case, 54, 1, "terms")) for case in ("parallel_env", "parallel_env_terms"))
    lines.append(f"`parallel_env`, 54 agents: {plain} agent-steps/s, and {terms} with `info_terms=True`.")
    took = ", ".join(f"{cases.find('jaxmarl', agents, 64).get('build_s', math.nan):.0f}" for agents in AGENTS)
    sizes = ", ".join(map(str, AGENTS))
    lines.append(f"JaxMARL took {took} s to build and compile with {sizes} agents in 64 worlds, which is not counted.")
    for case in ("vector_env", "mpe2", "vmas", "jaxmarl"):
        seen = ", ".join(f"{cases.find(case, agents, 1).get('facts', {}).get('entries', '–')}" for agents in AGENTS)
        lines.append(f"{COLUMNS[case]}: an agent observes {seen} numbers with {sizes} agents.")
    return "\n".join(f"- {line}" for line in lines)


def three(cases: Cases) -> str:
    """Core, API and training of each library."""

    def rate(case: str, kind: str = "rates", worlds: int = 64) -> str:
        return f"{spread(cases.rates(case, 54, worlds, kind))} ({worlds})"

    rows = (
        ("uuv_marl", rate("core"), f"`vector_env` {rate('vector_env')}", rate("ppo", "training")),
        ("MPE2", "no core apart", rate("mpe2"), rate("mpe2_ppo", "training", 4)),
        ("VMAS", "no core apart", rate("vmas"), rate("vmas_ppo", "training")),
        ("JaxMARL", rate("jaxmarl"), "the same: a compiled loop over its API", "not measured"),
    )
    return table(("library", "raw core", "public API", "end-to-end training"), rows)


def floor(cases: Cases) -> str:
    """The step's time beside the least time."""
    rows: list[tuple[str, ...]] = []
    for agents, worlds in FLOOR_CELLS:
        core = cases.rates("core", agents, worlds)
        best = [max(cases.rates(kind, agents, worlds), default=0.0) for kind in CEILINGS]
        if core and all(best):
            loops = zip(work(agents), best, ("", "", "", "B"), strict=True)
            parts = [f"{short(rate)}{unit}/s: {1e6 * worlds * need / rate:,.1f}" for need, rate, unit in loops]
            least, step = least_seconds(agents, worlds, best), agents * worlds / median(core)
            low, middle, high = (f"{least * pick(core) / (agents * worlds):.2%}" for pick in (min, median, max))
            times = f"{1e6 * least:,.1f}", f"{1e6 * step:,.1f}", f"{middle} [{low}, {high}]"
            rows.append((f"{agents} x {worlds}", *parts, *times))
    head = "vehicles x worlds", "pairs [µs]", "nearest kept [µs]", "sines, cosines [µs]", "bytes [µs]", "floor [µs]"
    return table((*head, "step [µs]", "floor / step"), rows)


def profile(cases: Cases) -> str:
    """Microseconds of a step of one world on one thread, by part."""
    moved, cells, measured, heard, perceived, whole = (
        54e6 / median(cases.rates(name, 54, 64, "profile") or [math.nan]) for name in PARTS
    )
    parts = {
        "motion: actions, forces, Runge-Kutta, headings": moved,
        "the living copied and sorted into cells": cells,
        "spacing, clearance, contacts, extent": measured - cells,
        "hearing: the nearest vehicle of every sub-sector": heard - cells,
        "echoes and percepts": perceived - heard,
        "all parts": moved + measured + perceived - cells,
        "the whole step in one go": whole,
    }
    return table(("part", "µs", "share"), ((name, f"{t:.1f}", f"{t / whole:.0%}") for name, t in parts.items()))


def points(cases: Cases, case: str) -> dict[int, list[float]]:
    """Microseconds per vehicle and step of each repeat, by number of vehicles."""
    found = (record for record in cases.records if record["kind"] == "curve" and record["case"] == case)
    return {record["agents"]: [1e6 / rate for rate in record["rates"]] for record in found if record["rates"]}


def curve(cases: Cases) -> str:
    """Cost per vehicle and step over the number of vehicles."""
    both = [points(cases, case) for case in ("idle", "bio_inspired")]
    rows = ((f"{n:,}", *(spread(one.get(n, [])) for one in both)) for n in sorted({*both[0], *both[1]}))
    return table(("vehicles", "`Swarm.step`, idle", "`Swarm.step` and `bio_inspired`"), rows)


def adapters(cases: Cases) -> str:
    """Every API beside the batched step."""
    return beside(cases, ADAPTERS, ("task_idle",), "adapters", 64)


def trainings(cases: Cases) -> str:
    """Whole trainings beside Stable-Baselines3's PPO."""
    return beside(cases, ("mappo", "ppo", "plain", "supersuit", "rllib"), ("ppo", "plain"), "trainings", 16)


def beside(cases: Cases, names: Sequence[str], bases: Sequence[str], kind: str, worlds: int) -> str:
    """Rates, and their ratios to some of them in the same rounds."""
    rows = (
        (f"`{name}`", *map(spread, (cases.rates(name, 54, worlds, kind), *over)))
        for name in names
        for over in [[cases.ratios(name, base, 54, worlds, kind) for base in bases]]
    )
    return table(("case", "agent-steps/s", *(f"to `{base}`" for base in bases)), rows)


TABLES: dict[str, Callable[[Cases], str]] = {
    make.__name__: make
    for make in (
        measured, headline, rates, ratios, notes, three, floor, profile, curve, adapters, trainings,
    )
}  # fmt: skip


def filled(page: str, cases: Cases) -> str:
    """A page with its tables written anew."""
    marked = re.compile(r"(<!-- (\w+) -->\n).*?(<!-- /\2 -->)", re.DOTALL)
    return marked.sub(lambda found: f"{found[1]}{TABLES[found[2]](cases)}\n{found[3]}", page)


@house_style()
def draw(cases: Cases) -> Figure:
    """Cost over vehicles, and rate over worlds."""
    figure = Figure((11.0, 5.2), dpi=120, layout="constrained")
    left, right = figure.subplots(1, 2)
    for case, name in (("idle", "Swarm.step, tracking"), ("bio_inspired", "Swarm.step and bio_inspired, tracking")):
        _line(left, case, name, points(cases, case))
    for case in ("parallel_env", *(peer for _, peer in PAIRS)):
        found = {n: [1e6 / rate for rate in cases.rates(case, n, 1)] for n in AGENTS}
        _line(left, case, COLUMNS[case].strip("`"), found, ":")
    for case, name in COLUMNS.items():
        _line(right, case, name.strip("`"), {w: cases.rates(case, 54, w) for w in WORLDS})
    left.set(xlabel="vehicles or agents in one world", ylabel="time per vehicle and step [µs]")
    left.set(title="One world; Swarm.step: idle")
    right.set(xlabel="worlds", ylabel="agent-steps per second [1/s]", title="54 vehicles or agents per world")
    once: dict[str, Any] = {}
    for axes in (left, right):
        axes.set(xscale="log", yscale="log")
        once |= {name: handle for handle, name in zip(*axes.get_legend_handles_labels(), strict=True)}
    figure.legend(once.values(), once.keys(), loc="outside lower center", ncols=4)
    return figure


def _line(axes: Any, case: str, name: str, values: dict[int, list[float]], dashes: str = "-") -> None:
    """Medians with their lowest and highest."""
    there = {at: (median(v), median(v) - min(v), max(v) - median(v)) for at, v in values.items() if v}
    if there:
        (colour, marker), (middle, below, above) = STYLES[case], zip(*there.values(), strict=True)
        how = {"color": colour, "marker": marker, "linestyle": dashes, "capsize": 2, "label": name}
        axes.errorbar(list(there), middle, (below, above), **how)


def main() -> None:
    """Fill the pages, and draw the picture."""
    for page, (path, kind) in PAGES.items():
        cases = Cases(path) if path.exists() else None
        if cases and any(record["kind"] == kind for record in cases.records):
            page.write_text(filled(page.read_text(encoding="utf-8"), cases), encoding="utf-8")
    draw(Cases(RESULTS)).savefig(PICTURE, metadata={"Source": hashlib.sha256(RESULTS.read_bytes()).hexdigest()})


if __name__ == "__main__":
    main()
