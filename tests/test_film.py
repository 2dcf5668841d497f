"""Films and stills of recordings: what they show, how they are written, and what is refused."""

import av
import numpy as np
import pytest
from PIL import Image

from tests.golden import STARTER
from uuv_marl import load_scenario
from uuv_marl.envs.drawing import ink
from uuv_marl.envs.drawing.scene import TRAIL_S
from uuv_marl.errors import ReplayError, ResultsError
from uuv_marl.replay.film import write_film
from uuv_marl.replay.record import record


@pytest.fixture(scope="module")
def starter():
    return [record(load_scenario(STARTER), policy, 0, inspect=(1,)) for policy in ("bio_inspired", "sff")]


@pytest.fixture(scope="module")
def lossy():
    short = load_scenario("lossy", num_vehicles=8, overrides={"losses.times_s": [5.0, 9.0]})
    return record(short, "bio_inspired", 0)


def test_a_scene_is_the_sample_of_its_time(starter):
    recording = starter[0]
    k = int(np.searchsorted(recording.time_s, 30.0 - 1e-3))
    scene = recording.scene_at(30.04, 1)
    assert scene.time_s == pytest.approx(30.0)
    np.testing.assert_array_equal(scene.position.astype(np.float32), recording.position[k])
    np.testing.assert_array_equal(scene.heading.astype(np.float32), recording.heading[k])
    assert np.float32(scene.min_spacing_m) == recording.series["min_spacing_m"][k]
    assert np.float32(scene.clearance_m) == recording.series["obstacle_clearance_m"][k]
    assert len(scene.trail) == TRAIL_S
    np.testing.assert_array_equal(scene.trail[0], recording.position[k - 190])
    np.testing.assert_array_equal(scene.trail[-1], recording.position[k])
    heard = recording.inspections[1].detected_index[k]
    assert len(scene.sonar.neighbour) == (heard >= 0).sum() > 0
    assert scene.arrival_s is None
    assert recording.scene_at(1e6).arrival_s == recording.metrics["task_time_s"]


def test_the_lost_stay_where_they_were_lost(lossy):
    scene = lossy.scene_at(20.0)
    assert (~scene.alive).sum() == 2
    assert np.isfinite(scene.position).all()
    gone = int(np.flatnonzero(~scene.alive)[0])
    last = int(np.flatnonzero(np.isfinite(lossy.position[:, gone, 0]))[-1])
    np.testing.assert_allclose(scene.position[gone], lossy.position[last, gone], atol=1.0)
    np.testing.assert_array_equal(scene.position[gone], lossy.scene_at(15.0).position[gone])


def test_a_gif_is_small_and_lasts_as_long_as_it_says(starter, tmp_path):
    shares = []
    write_film(starter, tmp_path / "a.gif", progress=shares.append)
    with Image.open(tmp_path / "a.gif") as film:
        assert film.size == (828, 554)
        assert film.info["loop"] == 0
        assert 70 <= film.n_frames <= 90
        seconds, shown = 0.0, []
        for k in range(film.n_frames):
            film.seek(k)
            seconds += film.info["duration"] / 1000
            shown.append(np.asarray(film.convert("RGB")))
    assert seconds == pytest.approx(12.0, abs=1.0)
    assert (np.diff(shares) > 0).all()
    assert shares[-1] == 1.0
    assert not np.array_equal(shown[0], shown[-1])
    colours = {tuple(colour) for colour in np.unique(shown[40].reshape(-1, 3), axis=0).tolist()}
    assert colours <= set(ink.palette())
    assert {ink.BLUE, ink.DISC, ink.GREEN} <= colours


def test_an_mp4_plays(starter, tmp_path):
    write_film(starter[:1], tmp_path / "a.mp4", speed=10.0, size=(640, 480), sonar_of=1, camera="map")
    with av.open(str(tmp_path / "a.mp4")) as film:
        stream = film.streams.video[0]
        frames = [frame.to_ndarray(format="rgb24") for frame in film.decode(stream)]
        assert stream.codec_context.name == "h264"
        assert stream.average_rate == 20
        assert stream.codec_context.pix_fmt == "yuv420p"
    assert frames[0].shape == (480, 640, 3)
    seconds = float(starter[0].time_s[-1])
    assert len(frames) == pytest.approx(seconds / 10 * 20 + 40, abs=3)
    pink = [(np.abs(frame.astype(int) - ink.PINK).max(axis=2) < 30).sum() for frame in (frames[0], frames[-1])]
    assert min(pink) > 10
    assert not np.array_equal(frames[0], frames[len(frames) // 2])


def test_what_can_not_be_filmed_is_refused_before_anything_is_written(starter, tmp_path):
    for arguments, message in (
        ({"recordings": starter * 3}, "a film shows 1 to 4 recordings side by side, got 6"),
        ({"path": tmp_path / "a.avi"}, r"a.avi must end in .mp4, .gif or .png"),
        ({"camera": "fly"}, "camera must be one of"),
        ({"speed": 0.0}, "speed must be positive, got 0.0"),
        ({"sonar_of": 3}, "holds no sonar of vehicle 3, only of: 1; name the vehicle when you record"),
        ({"size": (640, 481), "path": tmp_path / "a.mp4"}, r"size must be .* even .* got \(640, 481\)"),
    ):
        given = {"recordings": starter, "path": tmp_path / "a.gif", **arguments}
        with pytest.raises(ReplayError, match=message):
            write_film(**given)
    assert not list(tmp_path.iterdir())


def test_a_film_is_written_whole_or_not_at_all(starter, tmp_path):
    old = tmp_path / "a.gif"
    old.write_bytes(b"old")

    def stop(share):
        if share > 0.2:
            raise KeyboardInterrupt

    for suffix in (".gif", ".mp4"):
        with pytest.raises(KeyboardInterrupt):
            write_film(starter, old.with_suffix(suffix), progress=stop)
    assert old.read_bytes() == b"old"
    assert [path.name for path in tmp_path.iterdir()] == ["a.gif"]
    for suffix in (".gif", ".mp4", ".png"):
        with pytest.raises(ResultsError, match="can't be written"):
            write_film(starter, old / f"b{suffix}")
