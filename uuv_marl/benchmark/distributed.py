"""The benchmark's seeds on a Ray cluster, with the very runs of one machine. Needs the extra ``distributed``."""

import logging
import os
import socket
from collections.abc import Generator, Iterator, Sequence
from contextlib import contextmanager, nullcontext
from pathlib import Path
from typing import Any

from uuv_marl.benchmark.evaluate import BATCH, Run, evaluate
from uuv_marl.benchmark.results import origin
from uuv_marl.errors import ClusterError
from uuv_marl.extras import environment, extra
from uuv_marl.scenario import Scenario

with extra("distributed", "spreading over a Ray cluster"):
    import ray as _ray  # pyright: ignore[reportMissingImports]

ray: Any = _ray

_CHUNKS_PER_CPU = 4
"""Small chunks let fast nodes take more of them and keep more of a stopped benchmark; large ones start less often."""
_PATIENCE_S = 10.0


@contextmanager
def connected(address: str | None, num_cpus: int = 1, working_dir: Path | None = None) -> Generator[None]:
    """A Ray cluster for a ``with`` block: the one that this process is connected to already, else a new connection.

    Whatever was started or connected here is left at the end.

    Args:
        address: of a running cluster, such as ``auto`` or ``10.0.0.1:6379``; None starts Ray on this machine alone,
            where no other machine can reach it.
        num_cpus: tasks and actors at a time, where Ray is started here.
        working_dir: a folder whose modules the workers must find; every node gets a copy, less what .gitignore names.

    Raises:
        ClusterError: no cluster answers at the address.
    """
    if ray.is_initialized():
        yield
        return
    # Every task has one core, on which Numba's own threads would only contend.
    workers: dict[str, Any] = {"env_vars": {"NUMBA_NUM_THREADS": "1"}}
    if working_dir is not None:
        workers["working_dir"] = str(working_dir)
    common = {"runtime_env": workers, "log_to_driver": False, "logging_level": logging.ERROR}
    closed = _closed_to_others() if address is None else nullcontext()
    with environment(RAY_USAGE_STATS_ENABLED="0"), closed:
        if address is None:
            ray.init("local", num_cpus=num_cpus, include_dashboard=False, **common)
        else:
            _join(address, common)
        try:
            yield
        finally:
            ray.shutdown()


@contextmanager
def _closed_to_others() -> Generator[None]:
    """Ray listens on 127.0.0.1, where on Linux it would otherwise take orders from the whole network."""
    constants = ray._private.ray_constants
    before, constants.ENABLE_RAY_CLUSTER = constants.ENABLE_RAY_CLUSTER, False
    try:
        yield
    finally:
        constants.ENABLE_RAY_CLUSTER = before


def _join(address: str, arguments: dict[str, Any]) -> None:
    try:
        _knock(address)
        ray.init(address, **arguments)
    except (OSError, RuntimeError, ValueError) as error:
        raise ClusterError(
            f"no Ray cluster can be joined at {address!r} ({error}); start one with 'ray start --head' and give the "
            "address that it prints, or 'auto' on its own machine"
        ) from error


def _knock(address: str) -> None:
    """Raise OSError where nobody listens: Ray itself would go on trying for minutes."""
    host, colon, port = address.rpartition("://")[2].rpartition(":")
    if colon:
        socket.create_connection((host, int(port)), _PATIENCE_S).close()


def evaluate_on_cluster(scenario: Scenario, policy: str, seeds: Sequence[int], **parameters: object) -> Iterator[Run]:
    """As ``evaluate``, on the cluster that is ``connected``: chunks of seeds as tasks of one core each.

    A run depends on its seed alone, so neither the chunks nor the nodes change it, as long as all nodes have the same
    kind of processor. Ending the iteration cancels what is unfinished.

    Raises:
        ClusterError: a node has other code, libraries or weights, or a worker died repeatedly.
        PolicyError: a node can't import the policy.
    """
    task, wanted = ray.remote(num_cpus=1)(_chunk), origin(policy)
    pending = [
        task.remote(scenario, policy, chunk, parameters, wanted)
        for chunk in chunks(seeds, int(ray.cluster_resources().get("CPU", 1)))
    ]
    try:
        while pending:
            (ready,), pending = ray.wait(pending)
            yield from _result(ready)
    finally:
        for unfinished in pending:
            ray.cancel(unfinished, force=True)


def chunks(seeds: Sequence[int], num_cpus: int) -> list[Sequence[int]]:
    """The seeds in runs of equal length, several for each core."""
    size = max(1, min(BATCH, len(seeds) // (_CHUNKS_PER_CPU * num_cpus)))
    return [seeds[first : first + size] for first in range(0, len(seeds), size)]


def _chunk(
    scenario: Scenario, policy: str, seeds: Sequence[int], parameters: dict[str, object], wanted: dict[str, str | None]
) -> list[Run]:
    """The runs of a few seeds, on a node of the cluster whose ``origin`` of the policy must be the ``wanted`` one."""
    here = origin(policy)
    for name, value in wanted.items():
        if here.get(name) != value:
            raise ClusterError(
                f"node {os.uname().nodename} has other {name} ({here.get(name)}) than this machine ({value}); install "
                "the same versions and copy the same files to all"
            )
    return [event for event in evaluate(scenario, policy, seeds, **parameters) if isinstance(event, Run)]


def _result(ready: Any) -> list[Run]:
    try:
        return ray.get(ready)
    except ray.exceptions.RayTaskError as error:
        raise error.cause from error
    except ray.exceptions.RayError as error:
        raise ClusterError(f"the Ray cluster lost a task: {error}; give the command again") from error
