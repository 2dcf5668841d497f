"""Results as a table for analysis. Needs the extra ``analysis``."""

import importlib
import math
from typing import Any

from uuv_marl.benchmark.results import FILE, read_content, trace_path
from uuv_marl.extras import extra
from uuv_marl.paths import UserPath, user_path


def import_pandas(feature: str) -> Any:
    """Import pandas. Raises MissingExtraError, which names the feature that needs it."""
    with extra("analysis", feature):
        return importlib.import_module("pandas")


def load(path: UserPath) -> Any:
    """The runs of a ``results.json`` as a pandas data frame, a row for each, by scenario, policy and seed.

    Columns are ``scenario``, ``policy``, ``seed``, every metric (``constraint_share`` as ``constraint_share_all``,
    ``constraint_share_s_l`` and so on), those of the task by their names, such as ``success_share``, with
    ``task_`` before a name that is taken, and ``trace``, the path of the run's time series for ``load_trace``. NaN
    stands for a value that does not exist. No policy is imported.

    Args:
        path: the file, or the folder that holds it.

    Raises:
        MissingExtraError: pandas is not installed.
        ResultsError: the file is not a results.json of this version.
    """
    pandas = import_pandas("uuv_marl.benchmark.load")
    path = user_path(path)
    file = path / FILE if path.is_dir() else path
    records: list[dict[str, Any]] = []
    content = read_content(file, "give a results.json of this version, or its folder")
    for row in sorted(content["runs"], key=lambda row: row[:3]):
        metrics: dict[str, Any] = {**row.metrics}
        shares = {f"constraint_share_{name}": share for name, share in metrics.pop("constraint_share").items()}
        own = metrics.pop("task", {})
        key = {"scenario": row.scenario, "policy": row.policy, "seed": row.seed}
        usual = {**key, **metrics, **shares}
        every = usual | {f"task_{name}" if name in {*usual, "trace"} else name: value for name, value in own.items()}
        values = {name: math.nan if value is None else value for name, value in every.items()}
        records.append({**values, "trace": str(trace_path(file.parent, *row[:3]))})
    return pandas.DataFrame.from_records(records)
