"""The measured side of perf/compare.py: builds cases and times them as it is asked to, a JSON object per line.

Runs in every library's own environment, so it needs Python's own library alone.
"""

import json
import platform
import sys
import time
from collections.abc import Callable, Mapping, Sequence
from importlib.metadata import version
from typing import NamedTuple


class Case(NamedTuple):
    """Something to repeat."""

    run: Callable[[int], object]
    """Does so many units of work."""
    amount: float
    """What a unit holds: agent-steps, or pairs, sines, bytes."""
    facts: Mapping[str, object] = {}
    """What else is worth knowing, for the results file; a repeat may change it."""


Maker = Callable[[int, int], Case]
"""Makes a case of so many agents in so many worlds."""


def seconds_of(case: Case, units: int) -> float:
    """How long so many units take [s]."""
    start = time.perf_counter()
    case.run(units)
    return time.perf_counter() - start


def units_within(case: Case, seconds: float) -> int:
    """How many units fill this time, found with ever larger trials."""
    units, spent = 1, seconds_of(case, 1)
    while spent < seconds / 4:
        units *= min(16, max(2, int(seconds / 2 / spent)))
        spent = seconds_of(case, units)
    return max(1, round(units * seconds / spent))


def serve(makers: Mapping[str, Maker], libraries: Sequence[str]) -> None:
    """Answer until the input ends.

    Requests: ``build`` (a case's name) with ``agents``, ``worlds`` and ``seconds`` (of a repeat); ``repeat`` (a name
    that was built) gives a rate per second; ``clear`` forgets all.
    """
    say(python=platform.python_version(), versions={name: version(name) for name in libraries})
    built: dict[str, tuple[Case, int]] = {}
    for line in sys.stdin:
        request = json.loads(line)
        try:
            if name := request.get("build"):
                start = time.perf_counter()
                case = makers[name](request["agents"], request["worlds"])
                ready = time.perf_counter()
                first = seconds_of(case, 1)
                built[name] = case, units_within(case, request["seconds"]) if first < request["slow"] else 1
                say(build_s=ready - start, first_s=first, first_rate=case.amount / first, facts=dict(case.facts))
            elif name := request.get("repeat"):
                case, units = built[name]
                rate = units * case.amount / seconds_of(case, units)
                say(rate=rate, facts=dict(case.facts))
            else:
                built.clear()
                say()
        except (MemoryError, TimeoutError) as error:
            say(failed=str(error))
        except Exception as error:
            say(failed=f"{type(error).__name__}: {error}")


def say(**answer: object) -> None:
    """Answer with one line."""
    print(json.dumps(answer), flush=True)
