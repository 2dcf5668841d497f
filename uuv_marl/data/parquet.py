"""A world's episodes as a Parquet file. Needs ``data``."""

import json
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from uuv_marl.atomic import replacing
from uuv_marl.data.episodes import Episode
from uuv_marl.extras import extra

with extra("data", "a data set"):
    import pyarrow as pa
    from pyarrow import parquet

_ABOUT = b"uuv_marl"
"""Key of the file's metadata."""


def write_world(path: Path, episodes: Sequence[Episode], period_s: float, about: Mapping[str, Any]) -> None:
    """Write a world's episodes, a row for each decision, by vehicle and time.

    After an episode's decisions a row has its last observation; its action, reward, terminated and truncated are null.

    Args:
        path: the file, which is replaced.
        episodes: those of the world.
        period_s: time between decisions [s].
        about: description of the data, for ``described``.
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
        "action": _lists(np.pad(episode.action, ((0, 1), (0, 0))), pa.array(final)),
        "reward": pa.array(np.pad(episode.reward, (0, 1)), mask=final),
        "terminated": pa.array(last & episode.terminated, mask=final),
        "truncated": pa.array(last & episode.truncated, mask=final),
        "is_success": np.full(rows, episode.is_success),
    })  # fmt: skip


def _lists(rows: Any, mask: Any = None) -> Any:
    """Rows (row, entry) as a column of lists of a fixed size."""
    return pa.FixedSizeListArray.from_arrays(rows.reshape(-1), rows.shape[1], mask=mask)


def described(path: Path) -> dict[str, Any]:
    """The description of a file's data."""
    return json.loads(parquet.read_schema(path).metadata[_ABOUT])


def num_rows(path: Path) -> int:
    """Number of rows of a file."""
    return parquet.read_metadata(path).num_rows


def read_world(path: Path) -> list[Episode]:
    """The episodes of a world, by vehicle."""
    table = parquet.read_table(path).combine_chunks()
    columns = {name: table[name].drop_null().combine_chunks() for name in table.column_names}
    observation, action = (columns[name].flatten().to_numpy() for name in ("observation", "action"))
    vehicle, rewards = columns["vehicle"].to_numpy(), columns["reward"].to_numpy()
    observation, action = observation.reshape(len(vehicle), -1), action.reshape(len(rewards), -1)
    seed, *flags = (
        columns[name].to_numpy(zero_copy_only=False) for name in ("seed", "terminated", "truncated", "is_success")
    )
    ends = [*(np.flatnonzero(np.diff(vehicle)) + 1).tolist(), len(vehicle)]
    episodes: list[Episode] = []
    for k, (begin, end) in enumerate(zip([0, *ends], ends, strict=False)):
        own = slice(begin - k, end - k - 1)  # each earlier episode has a row without a decision
        episodes.append(
            Episode(
                int(seed[begin]), int(vehicle[begin]), observation[begin:end], action[own], rewards[own],
                bool(flags[0][own][-1]), bool(flags[1][own][-1]), bool(flags[2][begin]),
            )
        )  # fmt: skip
    return episodes
