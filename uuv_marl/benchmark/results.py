"""Results on disk: every seed and metric, written after each run, so that a stopped benchmark can be resumed."""

import json
import os
import platform
import re
import uuid
import zipfile
import zlib
from collections.abc import Container, Iterable
from importlib.metadata import version
from pathlib import Path
from typing import Any, Literal, NamedTuple, NotRequired

import numpy as np
from pydantic import ConfigDict, TypeAdapter, ValidationError
from typing_extensions import TypedDict

from uuv_marl import __version__
from uuv_marl.atomic import replacing, write_text, writing
from uuv_marl.baselines.learned.trained import Trained
from uuv_marl.baselines.making import policy_requirements
from uuv_marl.baselines.registry import PolicyType, policy_class
from uuv_marl.baselines.requirements import FULL_TORQUE_NM, PolicyRequirements
from uuv_marl.baselines.team_names import members_of
from uuv_marl.benchmark.evaluate import Run
from uuv_marl.benchmark.metrics import Metrics
from uuv_marl.errors import ResultsError
from uuv_marl.modules import digest, file_digest
from uuv_marl.paths import UserPath, user_path
from uuv_marl.scenario import Scenario
from uuv_marl.scenario.messages import explain
from uuv_marl.types import Float32

FILE = "results.json"
Trace = dict[str, Float32]
"""Time series of a run by name, see ``load_trace``."""
_PACKAGE = Path(__file__).resolve().parent.parent
_SOURCES = (
    "*.py", "scenario/**/*.py", "sim/**/*.py", "tasks/**/*.py", "baselines/**/*.py", "baselines/tuned/*.json",
    "benchmark/**/*.py",
)  # fmt: skip
_LIBRARIES = ("numpy", "numba", "scipy", "gymnasium", "pettingzoo")
_LONGEST_NAME = 200  # file systems allow 255 bytes


class ResultRow(NamedTuple):
    """One run in ``results.json``."""

    scenario: str
    policy: str
    seed: int
    metrics: Metrics


class PolicyInfo(TypedDict):
    """Requirements of a policy beyond the percept, and a hash of its file, if it is a user's."""

    channels: list[str]
    yaw_damping_nms: float
    """The policy's inner loop on a vehicle of ``FULL_TORQUE_NM``; ``inner_loop_nms`` gives that on another."""
    decision_period_s: NotRequired[float]
    """Required period between decisions [s], if any."""
    source: str | None
    policy_class: NotRequired[str]
    """Class of a network's policy, such as ``end to end`` or ``end to end + filter``."""


class Content(TypedDict):
    """Content of ``results.json``; docs/benchmark.md defines every key."""

    __pydantic_config__ = ConfigDict(strict=True, extra="forbid")  # pyright: ignore[reportGeneralTypeIssues]

    schema: Literal[2]
    fingerprint: str
    versions: dict[str, str]
    machine: dict[str, str | int | None]
    scenarios: dict[str, dict[str, Any]]
    policies: dict[str, PolicyInfo]
    runs: list[ResultRow]


_CONTENT = TypeAdapter(Content)


def read_content(path: Path, remedy: str = "move it away or give another --output") -> Content:
    """Content of a ``results.json``. Raises ResultsError with the remedy where it is not of this version."""
    try:
        content = _CONTENT.validate_json(path.read_bytes())
    except OSError as error:
        reason = error.strerror or str(error)
    except ValidationError as error:
        reason = explain(error, None)
    else:
        unknown = {row.scenario for row in content["runs"]} - set(content["scenarios"])
        unknown |= {row.policy for row in content["runs"]} - set(content["policies"])
        if not unknown:
            return content
        reason = f"runs name {min(unknown)!r}, which is not described"
    raise ResultsError(f"{path} can't be read ({reason}); {remedy}")


class Results:
    """``results.json`` in a folder, and ``traces/`` with the time series of every run.

    Two processes must not write to one folder: hold ``uuv_marl.atomic.locked`` while you write.

    Args:
        folder: created if missing. Results in it are continued if they come from the same code, libraries and
            scenarios. Their policies are not imported or opened before ``use``.
        scenarios: the scenarios of the runs.
        route_seeds: seeds whose trajectories are kept.
        traces: whether time series are kept, about 100 kB for each run.

    Raises:
        ResultsError: the folder can't be written, or holds results that can't be continued.
    """

    def __init__(
        self, folder: UserPath, scenarios: Iterable[Scenario], route_seeds: Container[int] = (0,), traces: bool = True
    ) -> None:
        self.folder = folder = user_path(folder)
        self._traces = traces
        self.scenarios = {scenario.name: scenario for scenario in scenarios}
        self.policies: dict[str, PolicyInfo] = {}
        self._dumps = {name: scenario.model_dump(mode="json") for name, scenario in self.scenarios.items()}
        self._route_seeds = route_seeds
        self._fingerprint, self._versions = source_fingerprint(), _versions() | _tasks(self.scenarios.values())
        self._runs: dict[tuple[str, str, int], Metrics] = {}
        self._path = folder / FILE
        with writing(folder):
            (folder / "traces" if traces else folder).mkdir(parents=True, exist_ok=True)
        if self._path.exists():
            self._continue(read_content(self._path))

    def _continue(self, content: Content) -> None:
        elsewhere = "move it away or give another --output"
        saved = content["versions"] | {"code": content["fingerprint"]}
        for what, here in (self._versions | {"code": self._fingerprint}).items():
            if saved.get(what, here) != here:
                raise ResultsError(
                    f"{self._path} comes from {what} {saved[what]}, and here is {here}; {elsewhere}, so that no table "
                    "mixes the two"
                )
        for name, dump in self._dumps.items():
            if content["scenarios"].get(name, dump) != dump:
                raise ResultsError(
                    f"{self._path} holds runs of another {name!r} (different --set or file); {elsewhere}"
                )
        self.policies = content["policies"]
        self._dumps = {**content["scenarios"], **self._dumps}
        self._versions = content["versions"] | self._versions
        self._runs = {row[:3]: row.metrics for row in content["runs"]}

    @property
    def rows(self) -> list[ResultRow]:
        """All runs, by scenario, policy and seed."""
        return [ResultRow(*key, self._runs[key]) for key in sorted(self._runs)]

    def use(self, policy: str) -> None:
        """Record a policy's requirements and file before its first run. Raises ResultsError if its file has changed."""
        now = policy_info(policy)
        if self.policies.setdefault(policy, now)["source"] != now["source"]:
            raise ResultsError(
                f"{self._path} holds runs of {policy!r} as it was before its file changed; give --restart to drop "
                "those runs, or another --output; while a training still writes the file, benchmark a copy of it"
            )

    def forget_changed(self, policy: str) -> None:
        """Drop a policy's runs if its file has changed since."""
        if policy in self.policies and self.policies[policy]["source"] != policy_info(policy)["source"]:
            del self.policies[policy]
            self._runs = {key: metrics for key, metrics in self._runs.items() if key[1] != policy}

    def has(self, scenario: str, policy: str, seed: int) -> bool:
        """Whether this run and its time series exist."""
        key = scenario, policy, seed
        return key in self._runs and (not self._traces or zipfile.is_zipfile(self.trace_path(*key)))

    def add(self, scenario: str, policy: str, run: Run) -> None:
        """Write a run to disk. Raises ResultsError if the policy's file has changed."""
        self.use(policy)
        if self._traces:
            self._add_trace(self.trace_path(scenario, policy, run.seed), run)
        self._runs[scenario, policy, run.seed] = run.metrics
        content = Content(
            schema=2,
            fingerprint=self._fingerprint,
            versions=self._versions,
            machine={"platform": platform.platform(), "processor": platform.machine(), "cores": os.cpu_count()},
            scenarios=self._dumps,
            policies=self.policies,
            runs=self.rows,
        )
        runs = [row._asdict() for row in self.rows]
        write_text(self._path, json.dumps({**content, "runs": runs}, allow_nan=False) + "\n")

    def _add_trace(self, path: Path, run: Run) -> None:
        arrays: dict[str, Any] = {**run.series, "obstacles": run.obstacles, "waypoints": run.waypoints}
        if run.seed in self._route_seeds:
            arrays |= {f"route_{name}": values for name, values in run.routes._asdict().items()}
        with replacing(path) as partial:
            np.savez_compressed(partial, **arrays)

    def select(self, scenario: str, policy: str, seeds: Iterable[int]) -> list[ResultRow]:
        """The runs of a policy on a scenario, by seed."""
        keys = ((scenario, policy, seed) for seed in sorted(set(seeds)))
        return [ResultRow(*key, self._runs[key]) for key in keys if key in self._runs]

    def trace_path(self, scenario: str, policy: str, seed: int) -> Path:
        """Path of a run's time series."""
        return trace_path(self.folder, scenario, policy, seed)

    def trace(self, scenario: str, policy: str, seed: int) -> Trace:
        """A run's time series, see ``load_trace``."""
        return load_trace(self.trace_path(scenario, policy, seed))


def trace_path(folder: Path, scenario: str, policy: str, seed: int) -> Path:
    """Path of a run's time series."""
    return folder / "traces" / f"{file_name(f'{scenario}.{policy}.{seed}')}.npz"


def file_name(name: str, changes: object = ()) -> str:
    """A name for a file: a short one with plain characters alone, and a hash of what this or ``changes`` hides."""
    words = re.sub(r"[^\w.,=+-]", "_", name, flags=re.ASCII)[:_LONGEST_NAME]
    return words if words == name and not changes else f"{words}.{digest(repr((name, changes)).encode())[:8]}"


def load_trace(path: UserPath) -> Trace:
    """A run's time series: those of ``metrics.measure`` and ``obstacle_distance_m``.

    Also ``obstacles`` and ``waypoints``, and where trajectories are kept the fields of ``evaluate.Routes`` as
    ``route_time_s`` and so on; docs/benchmark.md has shapes and units.

    Raises:
        ResultsError: the file is missing or broken.
    """
    try:
        with user_path(path).open("rb") as file, np.load(file, allow_pickle=False) as arrays:
            return {name: arrays[name] for name in arrays.files}
    except (OSError, ValueError, EOFError, KeyError, zipfile.BadZipFile, zlib.error) as error:
        raise ResultsError(
            f"{path} can't be read ({error}); delete it and run the benchmark's command again"
        ) from error


def policy_info(policy: str) -> PolicyInfo:
    """Requirements of a policy as tables and results show them, and a hash of its file or of those of a team."""
    required, types = policy_requirements(policy), {member: policy_class(member) for member in members_of(policy)}
    damping = required.yaw_damping_nms * (FULL_TORQUE_NM / required.full_torque_nm)
    known = PolicyInfo(channels=list(required.channels), yaw_damping_nms=damping, source=None)
    if required.decision_period_s:
        known["decision_period_s"] = required.decision_period_s
    sources = [_source(member, policy_type) for member, policy_type in types.items()]
    known["source"] = sources[0] if len(sources) == 1 or not any(sources) else digest(repr(sources).encode())
    if isinstance(policy_type := types.get(policy), Trained):
        known["policy_class"] = policy_type.checkpoint.card.policy_class
    return known


def _source(policy: str, policy_type: PolicyType) -> str | None:
    """Hash of a policy's checkpoint or file; None for a controller of the package."""
    if isinstance(policy_type, Trained):
        return policy_type.checkpoint.digest
    return file_digest(policy_type) if ":" in policy else None


def requirements_of(known: PolicyInfo) -> PolicyRequirements:
    """The requirements of a policy in ``results.json``."""
    period = known.get("decision_period_s")
    return PolicyRequirements(known["channels"], known["yaw_damping_nms"], decision_period_s=period)


def source_fingerprint() -> str:
    """Hash of everything that determines a run: code of the layers up to the benchmark's, and tuned gains."""
    code = sorted({path for pattern in _SOURCES for path in _PACKAGE.glob(pattern)})
    if Path(__file__).resolve() not in code:  # a package of byte code: a stand-in that mixes with nothing
        return f"unknown {uuid.uuid4().hex[:16]}"
    return digest(
        b"".join(f"{path.relative_to(_PACKAGE).as_posix()}\0".encode() + path.read_bytes() + b"\0" for path in code)
    )


def _tasks(scenarios: Iterable[Scenario]) -> dict[str, str]:
    """Hash of the file of each user-defined task, by its name."""
    return {each.task.name: file_digest(each.task_class) for each in scenarios if ":" in each.task.name}


def _versions() -> dict[str, str]:
    """Versions of the package, Python and the libraries that runs depend on."""
    libraries = {library: version(library) for library in _LIBRARIES}
    return {"uuv_marl": __version__, "python": platform.python_version(), **libraries}
