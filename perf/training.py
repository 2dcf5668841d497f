"""End-to-end training, side by side, and where its time goes: python perf/training.py [FILE.md], or make perf-training.

Every case has a process of its own with one thread, in its library's virtual environment. All are built, then take an
iteration each in turn, round after round, so that a slow phase of the machine hits all alike.
"""

import argparse
import contextlib
import os
import statistics
import sys
from collections.abc import Callable, Sequence
from datetime import UTC, datetime
from pathlib import Path
from typing import Any, NamedTuple

from compare import HERE, ROOT, CannotRun, Library, Record, Worker, machine
from footing import (
    CLIP,
    DECISIONS,
    EPOCHS,
    GAE_LAMBDA,
    GAMMA,
    HIDDEN,
    LEARNING_RATE,
    MINIBATCH,
    ROWS,
    SCENARIO,
    VEHICLES,
    WORLDS,
)

PAGE = HERE / "training.md"
THREADS = ("NUMBA_NUM_THREADS", "OMP_NUM_THREADS", "MKL_NUM_THREADS", "OPENBLAS_NUM_THREADS")
ONE_THREAD = dict.fromkeys(THREADS, "1")
LIMIT_S, PATIENCE_S = 600.0, 20.0
"""For a first iteration, which may compile everything; and for Ray to end its own processes."""

OURS = Library(sys.prefix, "train_ours.py", ONE_THREAD)
SUPERSUIT = Library(".venv-perf-supersuit", "train_supersuit.py", ONE_THREAD)
RLLIB = Library(".venv-rllib", "train_rllib.py", ONE_THREAD)


class Trained(NamedTuple):
    """A case: its name on the page, where it runs, and what it is."""

    title: str
    library: Library
    about: str
    worlds: int = WORLDS


CASES = {
    "mappo": Trained(
        "MAPPO",
        OURS,
        "`uuv_marl.train.mappo`: a shared actor and a critic that sees the whole world, with an optimiser each and "
        "epochs one after the other; the actor's epochs never end early.",
    ),
    "ppo": Trained(
        "SB3's PPO, same rows",
        OURS,
        "`uuv_marl.train.ppo`: Stable-Baselines3 on MAPPO's rows, features, barrier and reward; the same of its "
        "epochs.",
    ),
    "plain": Trained(
        "SB3's PPO, plain",
        OURS,
        "Stable-Baselines3 on `SwarmVecEnv`, observations and reward as they come, as in docs/sb3.md.",
    ),
    "supersuit": Trained(
        "SB3's PPO through SuperSuit",
        SUPERSUIT,
        "The same over `parallel_env` with `pettingzoo_env_to_vec_env_v1` and `concat_vec_envs_v1`, worlds one after "
        "the other.",
    ),
    "rllib": Trained(
        "RLlib's PPO",
        RLLIB,
        "`uuv_marl.train.rllib.ppo_config` without env runners, so that one process samples and learns, with as many "
        "worlds in it.",
    ),
}
PROFILES = {"mappo_profile": "mappo", "ppo_profile": "ppo"}
PARTS = {
    "water": "water: `Swarm.step` and `reset`",
    "eyes": "features, barrier, reward, critic's view",
    "inference": "actor's and critic's inference while sampling",
    "bookkeeping": "generalised advantages, buffers, the rest of sampling",
    "actor": "actor's updates",
    "critic": "critic's updates",
    "both": "actor's and critic's updates together",
    "rest": "rest",
}
LEARNING = {
    "forward": "minibatches, networks forward, losses",
    "backward": "backward",
    "bound": "norm of gradients",
    "adam": "Adam",
}


def measure(rounds: int, only: Sequence[str]) -> list[Record]:
    """A record of every case and profile."""
    names = [*CASES, *PROFILES]
    workers = {name: Worker(CASES[PROFILES.get(name, name)].library) for name in names}
    records = {name: Record(case=name, rates=[], facts=[]) for name in names}
    try:
        for name, record in records.items():
            attempt(record, lambda record, name=name: build(record, workers[name], only))
        for turn in range(rounds):
            for name, record in records.items():
                attempt(record, lambda record, name=name: repeat(record, workers[name]))
                tell(f"round {turn + 1}", record)
    finally:
        for worker in workers.values():
            worker.stop(PATIENCE_S)
    return list(records.values())


def attempt(record: Record, do: Callable[[Record], None]) -> None:
    """Go on with a case unless it has failed, and note where it does."""
    if "failed" in record:
        return
    try:
        do(record)
    except CannotRun as reason:
        record["failed"] = str(reason)


def build(record: Record, worker: Worker, only: Sequence[str]) -> None:
    """Start the case's process, and take its first iteration, which compiles."""
    name, venv = record["case"], worker.library.venv
    if only and name not in only:
        raise CannotRun("not asked for")
    if not (ROOT / venv / "bin" / "python").exists():
        raise CannotRun(f"{venv} is missing, 'make perf-training' makes it")
    size = {"agents": VEHICLES, "worlds": CASES[PROFILES.get(name, name)].worlds}
    record["built"] = worker.ask(LIMIT_S, build=name, seconds=0.0, slow=0.0, **size)["facts"]
    record |= worker.about
    sys.stderr.write(f"{name}: ready\n")


def repeat(record: Record, worker: Worker) -> None:
    """One more iteration."""
    answer = worker.ask(LIMIT_S, repeat=record["case"])
    record["rates"].append(answer["rate"])
    record["facts"].append(answer["facts"])


def tell(when: str, record: Record) -> None:
    """A line for the terminal."""
    what = record.get("failed") or f"{record['rates'][-1]:,.0f}/s"
    sys.stderr.write(f"{when}: {record['case']}: {what}\n")


def text(records: list[Record], about: dict[str, Any]) -> str:
    """The page."""
    by_name = {record["case"]: record for record in records}
    rows, minibatches = f"{ROWS:,}", ROWS // MINIBATCH
    lines = [
        "# Training",
        "",
        "<!-- Written by perf/training.py. -->",
        "",
        f"Agent-steps per second of whole iterations, sampling and learning, with {VEHICLES} vehicles in {WORLDS} "
        f"worlds of `{SCENARIO}`, a decision every 0.5 s and a yaw damping of 600 N m s. An iteration is {DECISIONS} "
        f"decisions of all worlds, {rows} rows, then {EPOCHS} epochs of {minibatches} minibatches of {MINIBATCH}. "
        f"Actor and critic have {len(HIDDEN)} layers of {HIDDEN[0]}, tanh, apart. Learning rate {LEARNING_RATE:g}, "
        f"discount {GAMMA:g}, lambda {GAE_LAMBDA:g}, clip {CLIP:g}.",
        "",
        "Every case has a process of its own with one thread: `torch.set_num_threads(1)`, and 1 in "
        + ", ".join(f"`{name}`" for name in THREADS)
        + ". After a first iteration, which compiles and is not counted, all take one in turn, "
        f"rounds: {about['rounds']}. Medians over rounds [lowest, highest], ratios within a round.",
        "",
        "| case | agent-steps/s | to SB3's PPO, same rows | to SB3's PPO, plain |",
        "| --- | --- | --- | --- |",
        *(row(name, by_name) for name in CASES),
        "",
        *(f"- {case.title}: {case.about}" for case in CASES.values()),
        "",
        "## What differs",
        "",
        *(f"- {line}" for line in differences(by_name)),
        "",
        "## Where the time goes",
        "",
        *profile(by_name),
        "",
        "## Machine",
        "",
        *closing(records, about),
    ]
    return "\n".join([*lines, ""])


def spread(values: Sequence[float], form: str) -> str:
    """Median and range."""
    return f"{statistics.median(values):{form}} [{min(values):{form}}, {max(values):{form}}]"


def row(name: str, records: dict[str, Record]) -> str:
    """A case's row of the table."""
    record, cells = records[name], []
    if "failed" in record:
        return f"| {CASES[name].title} | not measured: {record['failed']} | – | – |"
    for base in ("ppo", "plain"):
        pairs = zip(record["rates"], records[base]["rates"], strict=False)
        ratios = [own / other for own, other in pairs] if "failed" not in records[base] else []
        cells.append("1" if base == name else spread(ratios, ".2f") if ratios else "–")
    return f"| {CASES[name].title} | {spread(record['rates'], ',.0f')} | {' | '.join(cells)} |"


def differences(records: dict[str, Record]) -> list[str]:
    """Where the footing is not the same."""
    there = {name: records[name]["built"] for name in CASES if "built" in records[name]}
    inputs = "; ".join(f"{CASES[name].title}: {facts['inputs']}" for name, facts in there.items())
    others = [f"{CASES[k].title} takes {facts['rows']:,}" for k, facts in there.items() if facts["rows"] != ROWS]
    return [
        f"Inputs of the networks. {inputs}.",
        f"Rows of an iteration: {'; '.join(others) or 'the same for all that were measured'}.",
        "MAPPO takes its actor's gradient steps first and then its critic's, each with half of the parameters; the "
        "others take one of both.",
        "MAPPO's noise is not learned.",
        "Plain PPO, SuperSuit's and RLlib's learn from the environment's own reward, without the barrier.",
        "Learning goes on from round to round, from the start of an episode; few worlds end meanwhile.",
    ]


def profile(records: dict[str, Record]) -> list[str]:
    """Both tables of where the time goes."""
    there = {name: records[name] for name in PROFILES if "failed" not in records[name]}
    missing = [
        f"{CASES[PROFILES[name]].title} is not profiled: {records[name]['failed']}."
        for name in PROFILES
        if name not in there
    ]
    if not there:
        return missing
    titles = [CASES[PROFILES[name]].title for name in there]
    lines = [
        "The same two cases again with clocks around their functions, in processes of their own: milliseconds of an "
        "iteration and share, medians over rounds. A part is without the parts that it calls.",
        "",
        *table("part", titles, PARTS, [median_of(record, "parts") for record in there.values()]),
        "",
        "Learning alone:",
        "",
        *table("step", titles, LEARNING, [median_of(record, "learning") for record in there.values()]),
    ]
    return [*lines, *([""] if missing else []), *missing]


def median_of(record: Record, what: str) -> dict[str, float]:
    """Median seconds of every part."""
    names = record["facts"][0][what]
    return {name: statistics.median(facts[what].get(name, 0.0) for facts in record["facts"]) for name in names}


def table(kind: str, titles: Sequence[str], names: dict[str, str], columns: Sequence[dict[str, float]]) -> list[str]:
    """Milliseconds and shares."""
    sums = [sum(column.values()) for column in columns]
    lines = [f"| {kind} | {' | '.join(titles)} |", "| --- |" + " --- |" * len(titles)]
    for name, words in names.items():
        if any(name in column for column in columns):
            cells = [
                f"{1e3 * column[name]:,.0f} ({column[name] / total:.1%})" if name in column else "–"
                for column, total in zip(columns, sums, strict=True)
            ]
            lines.append(f"| {words} | {' | '.join(cells)} |")
    return [*lines, f"| all | {' | '.join(f'{1e3 * total:,.0f}' for total in sums)} |"]


def closing(records: list[Record], about: dict[str, Any]) -> list[str]:
    """Machine and versions."""
    here = about["machine"]
    lines = [
        f"{here['cpu']}, {here['cores']} cores, {here['memory_gib']} GiB, {here['system']}, load average "
        f"{about['load']:.2f} at the start. Measured {about['date']}.",
        "",
    ]
    versions: dict[str, list[str]] = {}
    for record in records:
        if "versions" in record:
            named = [f"Python {record['python']}", *(f"{k} {v}" for k, v in record["versions"].items())]
            titles = versions.setdefault(", ".join(named), [])
            if record["case"] in CASES:
                titles.append(CASES[record["case"]].title)
    return lines + [f"- {', '.join(titles) or 'Profiles'}: {named}." for named, titles in versions.items()]


def main() -> None:
    """Measure, print, and write the page."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("page", type=Path, nargs="?", default=PAGE, help="page (default perf/training.md)")
    parser.add_argument("--rounds", type=int, default=5, help="counted iterations of each case (default 5)")
    parser.add_argument("--only", nargs="+", default=(), choices=[*CASES, *PROFILES], help="cases, for a quick look")
    arguments = parser.parse_args()
    about = {
        "machine": machine(), "load": os.getloadavg()[0], "rounds": arguments.rounds,
        "date": datetime.now(UTC).date().isoformat(),
    }  # fmt: skip
    with contextlib.suppress(KeyboardInterrupt):
        page = text(measure(arguments.rounds, arguments.only), about)
        sys.stdout.write(page)
        arguments.page.write_text(page, encoding="utf-8")
        return
    sys.exit(130)


if __name__ == "__main__":
    main()
