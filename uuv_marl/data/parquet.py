"""A world's episodes as a Parquet file. Needs ``data``."""

import json
from collections.abc import Mapping, Sequence
from itertools import pairwise
from pathlib import Path
from typing import Any

import numpy as np

from uuv_marl.atomic import replacing
from uuv_marl.data.episodes import Episode
from uuv_marl.extras import extra
from uuv_marl.types import Float32

with extra("data", "a data set"):
    import pyarrow as pa
    from pyarrow import parquet

_ABOUT = b"uuv_marl"
"""Key of the file's metadata."""


def write_world(path: Path, episodes: Sequence[Episode], period_s: float, about: Mapping[str, Any]) -> None:
    """Write a world's episodes, a row for each decision, by vehicle and time.

    After an episode's decisions a row has its last observation; its action is NaN (older readers can't read null
    lists), its reward, terminated and truncated are null.

    Args:
        path: the file, which is replaced.
        episodes: those of the world.
        period_s: time between decisions [s].
        about: description of the data, for ``read_description``.
    """
    with replacing(path) as partial:
        tables = [_table(episode, period_s) for episode in episodes]
        table = pa.concat_tables(tables).replace_schema_metadata({_ABOUT: json.dumps(about)})
        parquet.write_table(table.combine_chunks(), partial, compression="zstd", use_dictionary=False)


def _table(episode: Episode, period_s: float) -> Any:
    rows = len(episode.observation)
    last, final = (np.arange(rows) == rows - before for before in (2, 1))
    return pa.table({
        "seed": np.full(rows, episode.seed, np.int64),
        "vehicle": np.full(rows, episode.vehicle, np.int32),
        "time_s": np.arange(rows) * period_s,
        "observation": _lists(episode.observation),
        "action": _lists(np.pad(episode.action, ((0, 1), (0, 0)), constant_values=np.nan)),
        "reward": pa.array(np.pad(episode.reward, (0, 1)), mask=final),
        "terminated": pa.array(last & episode.terminated, mask=final),
        "truncated": pa.array(last & episode.truncated, mask=final),
        "is_success": np.full(rows, episode.is_success),
    })  # fmt: skip


def _lists(rows: Float32) -> Any:
    """Rows (row, entry) as a column of lists of a fixed size."""
    return pa.FixedSizeListArray.from_arrays(rows.reshape(-1), rows.shape[1])


def read_description(path: Path) -> dict[str, Any]:
    """The description of a file's data."""
    return json.loads(parquet.read_schema(path).metadata[_ABOUT])


def num_rows(path: Path) -> int:
    """Number of rows of a file."""
    return parquet.read_metadata(path).num_rows


def read_world(path: Path) -> list[Episode]:
    """The episodes of a world, by vehicle."""
    table = parquet.ParquetFile(path).read()  # parquet.read_table imports pandas
    columns = {name: table[name].combine_chunks() for name in table.column_names}
    lists = [columns.pop(name).flatten().to_numpy().reshape(len(table), -1) for name in ("observation", "action")]
    column = {name: values.to_numpy(zero_copy_only=False) for name, values in columns.items()}
    vehicle = column["vehicle"]
    ends = [*(np.flatnonzero(np.diff(vehicle)) + 1).tolist(), len(vehicle)]
    episodes: list[Episode] = []
    for begin, end in pairwise([0, *ends]):
        decisions, last = slice(begin, end - 1), end - 2  # the row after the last decision has none
        episodes.append(
            Episode(
                int(column["seed"][begin]), int(vehicle[begin]), lists[0][begin:end], lists[1][decisions],
                column["reward"][decisions], bool(column["terminated"][last]), bool(column["truncated"][last]),
                bool(column["is_success"][begin]),
            )
        )  # fmt: skip
    return episodes
