"""Results on disk: every seed and metric, written whole after each run, so that a stopped benchmark can go on."""

import hashlib
import inspect
import json
import os
import platform
from collections.abc import Container, Iterable
from importlib.metadata import version
from pathlib import Path
from typing import Any, NamedTuple
from urllib.parse import quote

import numpy as np
from numpy.typing import NDArray

from uuv_marl import __version__
from uuv_marl.baselines.learned import Trained
from uuv_marl.baselines.registry import policy_class
from uuv_marl.benchmark.evaluate import Run
from uuv_marl.benchmark.metrics import Metrics
from uuv_marl.errors import ResultsError
from uuv_marl.scenario import Scenario

SCHEMA = 1
_PACKAGE = Path(__file__).resolve().parent.parent
_SOURCES = ("percept.py", "scenario*.py", "sim/*.py", "baselines/*.py", "baselines/tuned/*.json", "benchmark/*.py")
_LIBRARIES = ("numpy", "numba", "scipy", "gymnasium", "pettingzoo")


class Row(NamedTuple):
    """One run as ``results.json`` keeps it."""

    scenario: str
    policy: str
    seed: int
    metrics: Metrics


class Results:
    """``results.json`` in a folder, and ``traces/`` with the time series of every run.

    Args:
        folder: made if missing. What it holds already is continued, if it comes from the same code and scenarios.
        scenarios: the scenarios that runs will name.
        route_seeds: seeds whose routes are kept.
    """

    def __init__(self, folder: Path, scenarios: Iterable[Scenario], route_seeds: Container[int] = (0,)) -> None:
        self.folder = folder
        self.scenarios = {scenario.name: scenario for scenario in scenarios}
        self._dumps = {name: scenario.model_dump(mode="json") for name, scenario in self.scenarios.items()}
        self._route_seeds = route_seeds
        self._fingerprint = source_fingerprint()
        self._policies: dict[str, dict[str, Any]] = {}
        self.rows: list[Row] = []
        self._path = folder / "results.json"
        try:
            (folder / "traces").mkdir(parents=True, exist_ok=True)
        except OSError as error:
            raise ResultsError(f"{folder} can't be written ({error.strerror}); give another --output") from None
        if self._path.exists():
            self._continue()

    def _continue(self) -> None:
        try:
            data: dict[str, Any] = json.loads(self._path.read_text(encoding="utf-8"))
            fingerprint, known = data["fingerprint"], data["scenarios"]
            rows = [Row(**row) for row in data["runs"]]
        except (ValueError, KeyError, TypeError) as error:
            raise ResultsError(f"{self._path} can't be read ({error}); move it away or give another --output") from None
        if fingerprint != self._fingerprint:
            raise ResultsError(
                f"{self._path} comes from other code of uuv_marl; move it away or give another --output, "
                "so that no table mixes the two"
            )
        for name, dump in self._dumps.items():
            if name in known and known[name] != dump:
                raise ResultsError(
                    f"{self._path} holds runs of another {name!r} (different --set or file); "
                    "move it away or give another --output"
                )
        self._policies = data["policies"]
        for policy in self._policies:
            self.use(policy)
        self._dumps = {**known, **self._dumps}
        self.rows = [row for row in rows if self.trace_path(row.scenario, row.policy, row.seed).exists()]

    def use(self, policy: str) -> None:
        """Remember what a policy is, before its first run. Raises ResultsError once its file has changed."""
        now = knowledge(policy)
        if self._policies.setdefault(policy, now).get("source") != now["source"]:
            raise ResultsError(
                f"{self._path} holds runs of {policy!r} as it was before its file changed; "
                "move it away or give another --output, and benchmark a copy of what is still being trained"
            )

    def has(self, scenario: str, policy: str, seed: int) -> bool:
        """Whether this run is done."""
        return any((row.scenario, row.policy, row.seed) == (scenario, policy, seed) for row in self.rows)

    def add(self, scenario: str, policy: str, run: Run) -> None:
        """Keep a run, on disk at once; refused where the policy's file has changed, so that no table mixes two."""
        self.use(policy)
        arrays = {**run.series, "obstacles": run.obstacles, "waypoints": run.waypoints}
        if run.seed in self._route_seeds:
            arrays |= {f"route_{name}": values for name, values in run.routes._asdict().items()}
        trace = self.trace_path(scenario, policy, run.seed)
        partial = trace.with_suffix(".partial.npz")
        np.savez_compressed(partial, allow_pickle=False, **arrays)
        partial.replace(trace)
        self.rows.append(Row(scenario, policy, run.seed, run.metrics))
        self._write()

    def select(self, scenario: str, policy: str, seeds: Iterable[int]) -> list[Row]:
        """The runs of a policy on a scenario, by seed."""
        wanted = set(seeds)
        rows = [row for row in self.rows if (row.scenario, row.policy) == (scenario, policy) and row.seed in wanted]
        return sorted(rows, key=lambda row: row.seed)

    def trace_path(self, scenario: str, policy: str, seed: int) -> Path:
        """Where a run's time series are."""
        return self.folder / "traces" / f"{scenario}.{quote(policy.replace(':', '-'), safe='')}.{seed}.npz"

    def trace(self, scenario: str, policy: str, seed: int) -> dict[str, NDArray[np.float32]]:
        """A run's time series: the fields of ``metrics.Sample`` and ``obstacle_distance_m``.

        Beside them ``obstacles``, ``waypoints``, and for the seeds whose routes are kept the fields of
        ``evaluate.Routes``, as ``route_time_s`` and so on.
        """
        with np.load(self.trace_path(scenario, policy, seed)) as file:
            return {name: file[name] for name in file.files}

    def _write(self) -> None:
        data = {
            "schema": SCHEMA,
            "fingerprint": self._fingerprint,
            "versions": {
                "uuv_marl": __version__,
                "python": platform.python_version(),
                **{library: version(library) for library in _LIBRARIES},
            },
            "machine": {"platform": platform.platform(), "processor": platform.machine(), "cores": os.cpu_count()},
            "scenarios": self._dumps,
            "policies": self._policies,
            "runs": [row._asdict() for row in self.rows],
        }
        partial = self._path.with_suffix(".partial")
        partial.write_text(json.dumps(data, allow_nan=False) + "\n", encoding="utf-8")
        partial.replace(self._path)


def knowledge(policy: str) -> dict[str, Any]:
    """What a policy has beyond the percept, as tables and results show it; a hash of its file, if it is a user's."""
    made = policy_class(policy)
    if isinstance(made, Trained):
        source = made.checkpoint.digest
    else:
        file = inspect.getsourcefile(made) if ":" in policy else None
        source = hashlib.sha256(Path(file).read_bytes()).hexdigest()[:16] if file else None
    return {"channels": list(made.channels), "yaw_damping_nms": made.yaw_damping_nms, "source": source}


def source_fingerprint() -> str:
    """Hash of all that a run's numbers come from: code of the layers up to the benchmark's, and tuned gains."""
    digest = hashlib.sha256()
    code = [path for pattern in _SOURCES for path in _PACKAGE.glob(pattern)]
    for path in sorted(code):
        digest.update(path.relative_to(_PACKAGE).as_posix().encode() + b"\0" + path.read_bytes() + b"\0")
    return digest.hexdigest()[:16]


def scenario_hash(scenario: Scenario) -> str:
    """Short name of a configuration, for captions."""
    return hashlib.sha256(json.dumps(scenario.model_dump(mode="json"), sort_keys=True).encode()).hexdigest()[:8]
