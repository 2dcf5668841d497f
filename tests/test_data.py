"""Data sets: recovered environments replay them bit for bit; any batch and any interruption give the same files."""

import json
from itertools import pairwise

import gymnasium
import minari
import numpy as np
import pandas as pd
import pytest
from gymnasium.envs.registration import EnvSpec

from tests.nets import saved
from tests.processes import cli, quick, refused, succeeds
from uuv_marl import load_scenario, parallel_env
from uuv_marl.data import write
from uuv_marl.data.parquet import read_description, read_world
from uuv_marl.data.write import data_set_name, write_data_set
from uuv_marl.errors import PolicyError, ResultsError

LOST = {"losses.times_s": [1.0, 2.0], "time_limit.extra_s": 0.1, "swarm.num_vehicles": 5}
CRASH = {"collision.ends_vehicle": True, "swarm.num_vehicles": 8, "current.speed_mps": 1.5}


def short(name="starter", seconds=10.0, **changes):
    return load_scenario(name, overrides={"time_limit.factor": 0.001, "time_limit.extra_s": seconds, **changes})


def loaded(done, root, monkeypatch):
    monkeypatch.setenv("MINARI_DATASETS_PATH", str(root))
    return minari.load_dataset(done.name)


def start(data, episode):
    (known,) = data.storage.get_episode_metadata([episode.id])
    return {"seed": known["seed"], "options": known["options"]}


CASES = {
    "memory": ("scout", lambda: short("hard_water")),
    "lost": ("sff", lambda: quick("lossy", **LOST)),
    "crashes": ("random", lambda: short("hard_water", **CRASH)),
    "messages": ("mappo_few_informed", lambda: short("few_informed")),
    "clock": ("mappo,own_clock=true,safety_filter=true", lambda: quick("single_obstacle")),
    "plain": ("bio_inspired", short),
}


@pytest.fixture(params=CASES)
def case(request):
    policy, scenario = CASES[request.param]
    return policy, scenario()


def test_a_recovered_environment_replays_every_vehicle(case, tmp_path, monkeypatch):
    policy, scenario = case
    data = loaded(write_data_set(tmp_path, policy, scenario, [7, 3]), tmp_path, monkeypatch)
    env = data.recover_environment()
    assert len(data) == 2 * scenario.swarm.num_vehicles
    for episode in data:
        observation, _ = env.reset(**start(data, episode))
        np.testing.assert_array_equal(observation, episode.observations[0])
        for k, action in enumerate(episode.actions):
            observation, *rest, info = env.step(action)
            np.testing.assert_array_equal(observation, episode.observations[k + 1])
            assert rest == [episode.rewards[k], episode.terminations[k], episode.truncations[k]]
        assert info["ending"] != "running"
        assert episode.infos["is_success"].tolist() == [info["is_success"]] * (len(episode) + 1)
    assert env.unwrapped.swarm.num_vehicles == scenario.swarm.num_vehicles


def test_all_vehicles_actions_give_the_same_world(case, tmp_path):
    policy, scenario = case
    done = write_data_set(tmp_path, policy, scenario, [3], observe="positions")
    episodes = read_world(done.folder / "worlds" / "seed_000003.parquet")
    env = parallel_env(scenario, for_policy=policy)
    seen, _ = env.reset(seed=3)
    for k in range(max(len(episode.reward) for episode in episodes)):
        acting = {f"uuv_{one.vehicle}": one for one in episodes if k < len(one.reward)}
        assert set(acting) == set(env.agents), "one episode until the loss or the end"
        for agent, one in acting.items():
            np.testing.assert_array_equal(seen[agent], one.observation[k])
        seen, rewards, terminated, truncated, _ = env.step({agent: one.action[k] for agent, one in acting.items()})
        for agent, one in acting.items():
            last = k == len(one.reward) - 1
            assert rewards[agent] == one.reward[k]
            assert (terminated[agent], truncated[agent]) == (last and one.terminated, last and one.truncated)
            if last:
                np.testing.assert_array_equal(seen[agent], one.observation[-1])
    assert not env.agents


def test_the_cases_lose_vehicles(tmp_path):
    for which in ("lost", "crashes"):
        policy, scenario = CASES[which][0], CASES[which][1]()
        done = write_data_set(tmp_path, policy, scenario, [3])
        lengths = {len(one.reward) for one in read_world(done.folder / "worlds" / "seed_000003.parquet")}
        assert len(lengths) > 1, which


def test_a_network_with_a_memory_is_found_again(tmp_path, monkeypatch):
    scenario = short()
    best = saved(tmp_path / "best", scenario, memory=True)
    test_a_recovered_environment_replays_every_vehicle((best, scenario), tmp_path, monkeypatch)


def contents(folder):
    return {path.name: path.read_bytes() for path in sorted((folder / "worlds").iterdir())}


def test_the_batch_changes_no_byte(tmp_path, monkeypatch):
    """Worlds of different lengths, in batches of three, two and one."""
    policy, scenario = "bio_inspired", short("starter", 60.0)
    whole = write_data_set(tmp_path / "a", policy, scenario, range(5))
    monkeypatch.setattr("uuv_marl.data.episodes.batch_size", lambda _: 2)
    pairs = write_data_set(tmp_path / "b", policy, scenario, reversed(range(5)))
    monkeypatch.setattr("uuv_marl.data.episodes._MOST_BYTES", 1)
    alone = write_data_set(tmp_path / "c", policy, scenario, range(5))
    assert contents(whole.folder) == contents(pairs.folder) == contents(alone.folder)
    sets = [
        loaded(done, tmp_path / letter, monkeypatch) for letter, done in zip("abc", (whole, pairs, alone), strict=True)
    ]
    for episodes in zip(*sets, strict=True):
        assert len({len(episode) for episode in episodes}) == 1
        for one, other in pairwise(episodes):
            np.testing.assert_array_equal(one.observations, other.observations)
            assert {key: value.tolist() for key, value in one.infos.items()} == {
                key: value.tolist() for key, value in other.infos.items()
            }
    assert len({len(episode) for episode in sets[0]}) > 1


def test_an_interrupted_run_continues(tmp_path, monkeypatch):
    scenario, run, asked = short(), write.worlds, []
    expected = write_data_set(tmp_path / "whole", "scout", scenario, range(4))

    def stopping(scenario, policy, seeds, observe):
        asked.append(list(seeds))
        for k, episodes in enumerate(run(scenario, policy, seeds, observe)):
            yield episodes
            if k == 1 and len(asked) == 1:
                raise KeyboardInterrupt

    monkeypatch.setattr(write, "worlds", stopping)
    with pytest.raises(KeyboardInterrupt):
        write_data_set(tmp_path, "scout", scenario, range(4))
    (folder,) = (tmp_path / "uuv_marl").glob("*/*")
    kept = {path: path.stat().st_mtime_ns for path in (folder / "worlds").iterdir()}
    assert len(kept) == 2
    assert not (folder / "data").exists()
    shares = []
    done = write_data_set(tmp_path, "scout", scenario, range(4), report=shares.append)
    finished = {int(path.stem.removeprefix("seed_")) for path in kept}
    assert (set(asked[1]), shares) == ({*range(4)} - finished, [0.75, 1.0])
    assert kept == {path: path.stat().st_mtime_ns for path in kept}
    assert contents(done.folder) == contents(expected.folder)
    assert done[2:] == expected[2:]
    more = write_data_set(tmp_path, "scout", scenario, range(1, 6))
    assert (asked[2], len(loaded(more, tmp_path, monkeypatch))) == ([4, 5], 5 * scenario.swarm.num_vehicles)


def test_other_episodes_are_refused(tmp_path):
    scenario = short()
    folder = write_data_set(tmp_path, "scout", scenario, [0]).folder
    before = contents(folder)
    with pytest.raises(ResultsError, match=rf"{folder}.*another environment; move .* away, or give another output"):
        write_data_set(tmp_path, "scout", short(seconds=9.0), [0, 1])
    with pytest.raises(ResultsError, match="another observe"):
        write_data_set(tmp_path, "scout", scenario, [0, 1], observe="positions")
    best = saved(tmp_path / "best", scenario)
    write_data_set(tmp_path, best, scenario, [0])
    saved(tmp_path / "best", scenario, scale=0.2)
    with pytest.raises(ResultsError, match="another policy_file"):
        write_data_set(tmp_path, best, scenario, [0, 1])
    with pytest.raises(PolicyError, match="nobody"):
        write_data_set(tmp_path / "new", "nobody", scenario, [0])
    assert contents(folder) == before
    assert not (tmp_path / "new").exists()


def test_the_size_is_estimated_and_limited(tmp_path):
    scenario = short("hard_water", 60.0)
    done = write_data_set(tmp_path, "scout", scenario, range(3))
    real = sum(path.stat().st_size for path in done.folder.rglob("*") if path.is_file())
    assert done.size == pytest.approx(real, rel=0.1)
    with pytest.raises(
        ResultsError, match=r"--max-gb \S+ is too small for 4 worlds.*or --seeds 3.*finished worlds \(3\)"
    ):
        write_data_set(tmp_path, "scout", scenario, range(4), max_gb=3.5e-9 / 3.0 * done.size)
    assert write_data_set(tmp_path, "scout", scenario, range(4)).size > done.size
    with pytest.raises(ResultsError, match=r"finished worlds \(1\)"):
        write_data_set(tmp_path / "other", "scout", scenario, range(4), max_gb=1e-9)


def test_parquet_has_a_row_for_each_decision_and_last_observation(tmp_path):
    scenario = quick("lossy", **LOST)
    done = write_data_set(tmp_path, "sdc", scenario, [1, 2])
    rows = pd.read_parquet(done.folder / "worlds")
    decisions = rows.dropna()
    assert len(decisions) == done.decisions == len(rows) - 2 * scenario.swarm.num_vehicles
    assert rows.groupby(["seed", "vehicle"]).reward.apply(lambda reward: reward.isna().sum()).eq(1).all()
    period = scenario.timing.decision_period_s
    for (_, _), one in decisions.groupby(["seed", "vehicle"]):
        np.testing.assert_allclose(one.time_s, period * np.arange(len(one)))
        ends = one.terminated.astype(bool) | one.truncated.astype(bool)
        assert ends.tolist() == [False] * (len(one) - 1) + [True]
    about = read_description(done.folder / "worlds" / "seed_000001.parquet")
    assert {one.shape for one in rows.observation} == {(sum(size for _, size, *_ in about["observation"]),)}
    env = gymnasium.make(EnvSpec.from_json(about["environment"]))
    assert env.observation_space.shape == rows.observation[0].shape


def test_a_relative_folder_is_enough(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    done = write_data_set("data", "scout", short(), [0])
    assert len(loaded(done, "data", monkeypatch)) == 5


def test_the_metadata_says_what_the_data_are(tmp_path, monkeypatch):
    scenario = short()
    known = loaded(write_data_set(tmp_path, "sdc", scenario, [4]), tmp_path, monkeypatch).storage.metadata
    about = known["uuv_marl"]
    assert (about["scenario"], about["task"], about["observe"]) == ("starter", "follow", "closeness")
    assert about["channels"] == ["compass", "link", "identity"]
    assert known["algorithm_name"] == about["policy"] == "sdc"
    assert json.loads(known["env_spec"])["kwargs"]["others"] == "sdc"


@pytest.mark.parametrize("policy", ["runs/starter/best", "mine:Class", "bio_inspired,zeta_n=0.5", "x", "../../x"])
def test_any_policy_s_data_set_has_a_valid_name(policy):
    name = data_set_name("hard water.v2", policy)
    namespace, words, version = minari.dataset.minari_dataset.parse_dataset_id(name)
    assert (namespace.split("/")[0], version) == ("uuv_marl", 0)
    assert "/" not in words
    assert name != data_set_name("hard water.v2", f"{policy}_")


def stop(*_):
    raise KeyboardInterrupt


def test_the_command(tmp_path, monkeypatch):
    words = "export", "scout", tmp_path / "data", "--set=time_limit.factor=0.001", "--set=time_limit.extra_s=5"
    said = succeeds(*words, "--seeds", 2)
    monkeypatch.setenv("MINARI_DATASETS_PATH", str(tmp_path / "data"))
    (name,) = minari.list_local_datasets()
    assert f'minari.load_dataset("{name}")' in said
    assert {int(one.infos["seed"][0]) for one in minari.load_dataset(name)} == {100_000, 100_001}
    refused("--seeds is for data sets", "export", "mappo", tmp_path / "mappo.onnx", "--seeds", 3)
    refused("is too small", *words, "--seeds", 50, "--max-gb", 0.001)
    monkeypatch.setattr(write, "worlds", stop)
    assert cli(*words, "--seeds", 3)[0] == 130
