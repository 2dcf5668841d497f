"""Whatever enters compiled code is checked first: percepts of others, snapshots, masks; and a runaway is named."""

import io
import shutil
import sys
from pathlib import Path
from typing import get_type_hints

import numpy as np
import pytest
import typer

import uuv_marl
from tests.nets import ANYWHERE
from tests.processes import python, succeeds
from tests.swarms import piloted, started
from uuv_marl import load_scenario
from uuv_marl.baselines import POLICIES, PolicyError, make_policy, with_policy_requirements
from uuv_marl.baselines.learned.checkpoint import load_checkpoint, save_checkpoint
from uuv_marl.benchmark.evaluate import episodes
from uuv_marl.benchmark.results import Results, load_trace
from uuv_marl.cli import app, main
from uuv_marl.cli.console import _width, console
from uuv_marl.errors import DivergenceError
from uuv_marl.paths import user_path
from uuv_marl.percept import Percept, PerceptLayout
from uuv_marl.replay.page import write_page
from uuv_marl.replay.record import record
from uuv_marl.scenario import show, show_vehicle
from uuv_marl.scenario.vehicle_files import VEHICLES
from uuv_marl.sim import model as model_module
from uuv_marl.sim.vehicle import plant


def made_for(name, n=5, worlds=2):
    swarm, policy = piloted(name, "single_obstacle", worlds=worlds, n=n)
    return policy, swarm.percept


@pytest.mark.parametrize("name", ANYWHERE)
def test_percepts_of_others_are_refused(name):
    """Compiled code would read, and write memory, beyond the ends of the policy's arrays."""
    policy, percept = made_for(name)
    good = policy.act(percept)
    assert good.shape == (2, 5, 2 + policy.requirements.message_entries)
    other_suite = PerceptLayout.of(load_scenario("single_obstacle", overrides={"sonar.arrays.bow.sub_sectors": 3}))
    for other in (
        made_for(name, worlds=8)[1],
        made_for(name, n=54)[1],
        Percept(percept.flat[:1], percept.layout),
        Percept(percept.flat[:, :4], percept.layout),
        Percept(percept.flat.astype(np.float64), percept.layout),
        Percept(percept.flat[..., :-1], percept.layout),
        Percept(np.zeros((2, 5, other_suite.size), np.float32), other_suite),
        Percept(percept.flat, other_suite),
    ):
        with pytest.raises(PolicyError, match="was made for"):
            policy.act(other)
    strided = np.zeros((2, 5, 2 * percept.flat.shape[2]), np.float32)[..., ::2]
    strided[...] = percept.flat
    assert policy.act(Percept(strided, percept.layout)).shape == good.shape


@pytest.mark.parametrize("name", ["sdc", "sff", "olfati_saber_informed", "orca_informed"])
def test_no_number_of_an_observation_is_an_index(name):
    """An identity beyond the swarm, a fraction or NaN is never another vehicle's place in memory."""
    policy, percept = made_for(name)
    policy.act(percept)
    identity = percept["link_identity"]
    percept["detected"][...] = 1.0
    for ghost in (0.0, -3.0, 6.0, 16384.0, 1e30, np.inf, np.nan):
        identity[...] = ghost
        assert np.isfinite(policy.act(percept)).all(), ghost


def test_a_swarm_too_large_to_assign_slots_is_refused_at_once():
    with pytest.raises(PolicyError, match="at most 2000 vehicles"):
        make_policy("sdc", with_policy_requirements("sdc", load_scenario("tracking", num_vehicles=2001)))


@pytest.mark.parametrize("active", [[True], np.ones(8), np.ones((8, 1), bool), np.ones(9, bool)])
def test_a_mask_of_other_worlds_is_refused(active):
    swarm = started("tracking", worlds=8, n=2)
    with pytest.raises(ValueError, match="active must be bool of shape"):
        swarm.step(np.zeros((8, 2, 2), np.float32), np.asarray(active))


@pytest.mark.parametrize(("name", "value"), [
    ("last", 9),
    ("last", 0),
    ("num_obstacles", -1),
    ("num_obstacles", 1000),
    ("losses", 1 << 40),
    ("losses", -1),
    ("detected_index", 6),
    ("diverged", 77),
    ("times", np.nan),
])  # fmt: skip
def test_a_snapshot_holds_no_index_out_of_range(name, value):
    swarm = started("lossy", {"losses.times_s": [1.0]}, worlds=2, n=6)
    before, snapshot = swarm.snapshot(), swarm.snapshot()
    snapshot[name][0] = value
    snapshot["eta"][...] = 5.0
    with pytest.raises(ValueError, match=name):
        swarm.restore(snapshot)
    assert np.array_equal(swarm.snapshot()["eta"], before["eta"]), "half a snapshot was taken"
    if name == "num_obstacles":  # a state changed by hand is checked, too
        swarm.world_map.num_obstacles[0] = value
        with pytest.raises(ValueError, match=name):
            swarm.observe()


@pytest.mark.parametrize("change", ["missing", "shape", "type"])
@pytest.mark.parametrize("name", ["eta", "tick", "streams", "keys", "percept"])
def test_a_snapshot_of_another_swarm_is_refused(name, change):
    swarm = started("tracking", worlds=2, n=3)
    snapshot = swarm.snapshot()
    array = snapshot.pop(name)
    if change == "shape":
        snapshot[name] = np.concatenate([array, array])
    if change == "type":
        snapshot[name] = array.astype(np.complex64)
    with pytest.raises(ValueError, match=name):
        swarm.restore(snapshot)


@pytest.fixture
def runaway(monkeypatch):
    """A vehicle that Runge-Kutta can't follow, as if the scenario's check had missed it: no damping but a pump."""

    def pumped(scenario):
        return plant(scenario)._replace(X_u=-2000.0, X_uu=0.0)

    monkeypatch.setattr(model_module, "plant", pumped)
    return load_scenario("single_obstacle", num_vehicles=4)


@pytest.mark.parametrize("worlds", [1, 3])
def test_divergence_is_named_where_it_happens_and_ends_the_world(runaway, worlds, caplog):
    swarm = started(runaway, worlds=worlds)
    assert not swarm.ended.any()
    action = np.zeros((worlds, 4, 2), np.float32)
    action[0, 2] = 1.0, 0.0  # one vehicle of one world is the first
    swarm.state.nu[...] = 0.0
    for _ in range(100):
        swarm.step(action)
        assert np.isfinite(swarm.percept.flat).all()
        assert np.isfinite(swarm.state.eta).all()
    assert swarm.facts.diverged.tolist() == [2] + [-1] * (worlds - 1)
    assert swarm.endings()[1].tolist() == swarm.ended.tolist() == [True] + [False] * (worlds - 1)
    assert caplog.text.count("vehicle 2 of world 0 diverged") == 1
    assert "integration_step_s" in caplog.text
    time = swarm.facts.time_s.copy()
    swarm.step(action)
    assert (swarm.facts.time_s > time).tolist() == [False] + [True] * (worlds - 1), "a diverged world stays as it is"
    swarm.reset(0)
    assert (swarm.facts.diverged == -1).all()


def test_divergence_truncates_an_episode_with_finite_numbers(runaway):
    env = uuv_marl.parallel_env(runaway)
    env.reset(seed=0)
    rewards = []
    while env.agents:
        observations, reward, terminated, truncated, _ = env.step({agent: [1.0, 0.0] for agent in env.agents})
        rewards += list(reward.values())
        assert all(np.isfinite(observation).all() for observation in observations.values())
    assert all(truncated.values())
    assert not any(terminated.values())
    assert np.isfinite(rewards).all()


def test_divergence_never_becomes_a_row_of_results(runaway):
    events = episodes(runaway, "bio_inspired", range(3))
    with pytest.raises(DivergenceError, match="seed 0: vehicle"):
        assert not list(events)


def commands(group, name=""):
    """Every command below a group, with its whole name."""
    for word, command in group.commands.items():
        below = commands(command, f"{name}{word} ") if hasattr(command, "commands") else [(f"{name}{word}", command)]
        yield from below


COMMANDS = dict(commands(typer.main.get_command(app)))


@pytest.fixture
def home(tmp_path, monkeypatch):
    """The home folder, while the work goes on in another."""
    (tmp_path / "home").mkdir()
    (tmp_path / "here").mkdir()
    monkeypatch.chdir(tmp_path / "here")
    monkeypatch.setenv("HOME", str(tmp_path / "home"))
    monkeypatch.setenv("USERPROFILE", str(tmp_path / "home"))
    yield tmp_path / "home"
    assert not list((tmp_path / "here").iterdir()), "~ was taken for the name of a folder"


@pytest.mark.parametrize("name", COMMANDS)
def test_every_path_of_a_command_may_begin_with_the_home_folder(name, home, monkeypatch):
    command, given = COMMANDS[name], {}
    hints = get_type_hints(command.callback)
    paths = [option for option in command.params if "Path" in str(hints.get(option.name))]
    assert {"output"} & hints.keys() <= {option.name for option in paths}
    monkeypatch.setattr(command, "callback", lambda **values: given.update(values))
    options = [f"{option.opts[0]}=~/x" for option in paths if option.param_type_name == "option"]
    wanted = [option for option in command.params if option in paths or option.required]
    positional = ["~/x" for option in wanted if option.param_type_name == "argument"]
    command.main([*options, *positional], standalone_mode=False)
    for option in paths:
        assert given[option.name] in (home / "x", [home / "x"]), option.name


def test_every_door_of_a_path_in_python_knows_the_home_folder(home):
    shipped = Path(load_scenario.__code__.co_filename).parent
    shutil.copy(VEHICLES / "lauv.toml", home / "v.toml")
    (home / "base.toml").write_text(f"extends = '{shipped / 'starter.toml'}'", encoding="utf-8")
    slow = {"trajectory.speed_mps": 1.0, "start.speed_max_mps": 1.0}
    mine = "\n".join(["extends = '~/base.toml'", "vehicle = '~/v.toml'", *(f"{k} = {v}" for k, v in slow.items())])
    (home / "mine.toml").write_text(mine, encoding="utf-8")
    assert load_scenario("~/mine.toml").vehicle.name == "lauv"
    assert load_scenario(Path("~/mine.toml")) == load_scenario("~/mine.toml")
    assert load_scenario("starter", overrides={"vehicle": "~/v.toml", **slow}).vehicle.name == "lauv"
    assert "lauv" in show("~/mine.toml")
    assert "lauv" in show_vehicle("~/v.toml")
    for arguments in (["list", "--show", "~/mine.toml"], ["list", "vehicles", "--show", "~/v.toml"]):
        succeeds(*arguments)
    trained = POLICIES["mappo"]
    (home / "best").mkdir()
    save_checkpoint("~/best/policy.safetensors", trained.checkpoint.card, trained.checkpoint.tensors)
    for name in ("~/best", "~/best,safety_filter=true", "~/best/policy.safetensors"):
        assert make_policy(name, with_policy_requirements(name, load_scenario("starter")))
    assert load_checkpoint("~/best").card == trained.checkpoint.card


def test_results_and_replays_go_to_the_home_folder(home):
    scenario = load_scenario("starter", overrides={"time_limit.factor": 0.02, "swarm.num_vehicles": 2})
    results = Results("~/results", [scenario])
    results.use("idle")
    for run in episodes(scenario, "idle", [0]):
        results.add("starter", "idle", run)
    assert load_trace("~/results/traces/starter.idle.0.npz")["time_s"].size
    write_page([record(scenario, "idle", 0)], "~/episode.html")
    assert (home / "episode.html").is_file()


@pytest.mark.needs("torch")
def test_trainings_and_recipes_in_the_home_folder(home):
    from uuv_marl.train.run import train
    from uuv_marl.train.training import Training, recipe_fields

    (home / "r.toml").write_text('scenario = "starter"\ntitle = "mine"', encoding="utf-8")
    assert recipe_fields("~/r.toml") == {"scenario": "starter", "title": "mine"}
    few = {"validations": 1, "validation_episodes": 1, "overrides": {"time_limit.factor": 0.02}, "ppo": {"horizon": 2}}
    list(train("~/runs", Training(scenario="starter", steps=1, sizes=((2, 2),), **few)))
    assert (home / "runs" / "best").is_dir()


def test_what_names_no_known_home_stays_as_it_is(monkeypatch):
    assert user_path("~nobody-has-this-name/x") == Path("~nobody-has-this-name/x")
    monkeypatch.setattr("os.path.expanduser", lambda path: path)  # as where neither HOME nor passwd knows one
    assert user_path("~/x") == Path("~/x")


QUICK = (
    "benchmark", "--scenario=starter", "--set=time_limit.factor=0.02", "--set=swarm.num_vehicles=2", "--policy=idle",
    "--seeds=1",
)  # fmt: skip


@pytest.fixture
def printed(monkeypatch):
    """What the command line prints, with its exit status, where both streams have an encoding and are strict."""

    def run(arguments, encoding):
        streams = [io.TextIOWrapper(io.BytesIO(), encoding, errors="strict") for _ in range(2)]
        monkeypatch.setattr(sys, "argv", ["uuv-marl", *arguments])
        monkeypatch.setattr(sys, "stdout", streams[0])
        monkeypatch.setattr(sys, "stderr", streams[1])
        with pytest.raises(SystemExit) as ended:
            main()
        for stream in streams:
            stream.flush()
        return ended.value.code or 0, *(stream.buffer.getvalue().decode(encoding) for stream in streams)

    return run


def test_lists_help_and_errors_can_be_printed_in_any_encoding(printed):
    encoding = "ascii"
    for name in COMMANDS:
        assert printed([*name.split(), "--help"], encoding)[0] == 0, name
    for arguments, word in (("list policies", "scout"), ("list scenarios", "starter"), ("list vehicles", "remus100")):
        status, text, _ = printed(arguments.split(), encoding)
        assert status == 0
        assert word in text
    status, _, error = printed(["benchmark", "--policy=μ–→"], encoding)
    assert status == 2
    assert "is unknown" in error


def test_a_benchmark_that_has_finished_is_printed_in_any_encoding(printed, tmp_path):
    (tmp_path / "größe–μ").mkdir()
    status, text, _ = printed([*QUICK, f"--output={tmp_path / 'größe–μ'}"], "cp932")
    assert status == 0
    assert "results.json" in text
    assert "0/1" in text


def test_a_table_fits_a_notebook(printed, tmp_path, monkeypatch):
    monkeypatch.setenv("JPY_PARENT_PID", "1")
    monkeypatch.setattr(console, "width", _width())
    _, text, _ = printed([*QUICK, f"--output={tmp_path}"], "utf-8")
    assert 60 < max(len(line) for line in text.splitlines() if "│" in line) <= 88


def test_commands_work_without_docstrings(tmp_path):
    """``python -OO`` drops them, and every assert."""
    lines = [["list"], ["list", "--show=lauv"], ["train", "--help"]]
    code = f"""import sys
from uuv_marl.cli import main
for arguments in {lines!r}:
    sys.argv = ["uuv-marl", *arguments]
    try:
        main()
    except SystemExit as ended:
        if ended.code:
            sys.exit(f"{{arguments}} ended with {{ended.code}}")
"""
    python("-OO", "-c", code, folder=tmp_path)
