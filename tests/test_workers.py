"""Workers that find the environments by themselves: they import a user's module, which does not import uuv_marl."""

import importlib

import gymnasium
import numpy as np
import pytest

MAKER = """
import multiprocessing, sys
import gymnasium

def solo():
    here = multiprocessing.parent_process() is None
    forked = multiprocessing.get_start_method() == "fork"
    assert here or forked or "uuv_marl" not in sys.modules
    return gymnasium.make("uuv_marl:uuv_marl/Solo-v2", scenario="starter", num_vehicles=3)
"""


@pytest.fixture
def solo(tmp_path, monkeypatch):
    (tmp_path / "maker_of_solo.py").write_text(MAKER)
    monkeypatch.syspath_prepend(tmp_path)
    return importlib.import_module("maker_of_solo").solo


def stepped(envs, by):
    """Observations and rewards of a few steps from seed 5."""
    if by == "stable_baselines3":
        envs.seed(5)
    seen = [envs.reset() if by == "stable_baselines3" else envs.reset(seed=5)[0]]
    for action in np.random.default_rng(0).uniform(-1, 1, (5, 1, 2)).astype(np.float32):
        seen += envs.step(action)[:2]
    envs.close()
    return b"".join(np.asarray(each, np.float32).tobytes() for each in seen)


@pytest.mark.filterwarnings("ignore:This process.*is multi-threaded, use of fork:DeprecationWarning")
@pytest.mark.parametrize("start", ["fork", "forkserver", "spawn"])
@pytest.mark.parametrize("by", ["gymnasium", "stable_baselines3"])
def test_workers_find_the_environment_and_give_the_same_run(solo, by, start):
    pytest.importorskip(by)
    if by == "gymnasium":
        envs = gymnasium.vector.AsyncVectorEnv([solo], context=start)
    else:
        from stable_baselines3.common.vec_env import SubprocVecEnv

        envs = SubprocVecEnv([solo], start_method=start)
    assert stepped(envs, by) == stepped(gymnasium.vector.SyncVectorEnv([solo]), "gymnasium")
