"""A data set for Minari, made of the worlds' Parquet files. Needs ``data``."""

import shutil
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from uuv_marl import __version__
from uuv_marl.atomic import writing
from uuv_marl.data.episodes import Episode
from uuv_marl.data.parquet import read_world
from uuv_marl.envs.solo import SoloEnv
from uuv_marl.extras import extra

with extra("data", "a data set"):
    import h5py  # noqa: F401  # pyright: ignore[reportUnusedImport] - Minari's storage needs it
    from minari import __version__ as minari_version
    from minari.data_collector import EpisodeBuffer
    from minari.dataset.minari_storage import MinariStorage


def write_minari(folder: Path, name: str, env: SoloEnv, about: Mapping[str, Any], worlds: Sequence[Path]) -> int:
    """Write a Minari data set, an episode for each vehicle of each world, in place of an earlier one.

    Returns the number of decisions.

    Args:
        folder: of the data, ``data`` in the data set's own.
        name: the data set's id.
        env: the environment that ``recover_environment`` makes again.
        about: description of the data, for the metadata.
        worlds: Parquet files (``uuv_marl.data.parquet``), in the order of the episodes.
    """
    partial = folder.with_name(f".{folder.name}.partial").absolute()  # Minari fails on relative paths
    with writing(folder):
        shutil.rmtree(partial, ignore_errors=True)
        storage = MinariStorage.new(partial, env.observation_space, env.action_space, env.spec)
        storage.update_metadata({
            "dataset_id": name,
            "minari_version": minari_version,
            "algorithm_name": about["policy"],
            "description": f"Each episode is one vehicle's; all run {about['policy']}.",
            "requirements": [f"uuv_marl=={__version__}"],
            "uuv_marl": dict(about),
        })  # fmt: skip
        for world in worlds:
            storage.update_episodes(map(_buffer, read_world(world)))
        decisions: int = storage.total_steps
        shutil.rmtree(folder, ignore_errors=True)
        partial.rename(folder)
    return decisions


def _buffer(episode: Episode) -> EpisodeBuffer:
    """An episode in Minari's form; its seed and options are those of ``SoloEnv.reset``."""
    rows, last = len(episode.observation), np.arange(len(episode.reward)) == len(episode.reward) - 1
    infos = {name: np.full(rows, getattr(episode, name)) for name in ("seed", "vehicle", "is_success")}
    arrays: dict[str, Any] = {
        "observations": episode.observation, "actions": episode.action, "rewards": episode.reward,
        "terminations": last & episode.terminated, "truncations": last & episode.truncated, "infos": infos,
    }  # fmt: skip
    return EpisodeBuffer(seed=episode.seed, options={"vehicle": episode.vehicle}, **arrays)
