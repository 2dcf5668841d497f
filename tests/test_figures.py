"""The benchmark's pictures show what they must, and all pictures have one style."""

from pathlib import Path
from types import SimpleNamespace

import matplotlib as mpl
import numpy as np
import pytest

from uuv_marl import load_scenario
from uuv_marl.benchmark import figures, style

POLICIES = ("bio_inspired", "sff", "sdc")


def trace(lowest=20.0, spacing=8.0, lose=False):
    """Two vehicles on a line past a disc; the second may be lost on the way."""
    time = np.arange(0.0, 10.5, 0.5, np.float32)
    position = np.stack([np.stack([10 * time, time * 0], 1), np.stack([10 * time, time * 0 + 8], 1)], 1)
    if lose:
        position[12:, 1] = np.nan
    away = np.float32(lowest + (time - 5) ** 2)
    return {
        "time_s": time,
        "route_time_s": time,
        "route_position": np.float32(position),
        "waypoints": np.float32([[0, 0], [100, 0]]),
        "obstacles": np.float32([[50, 60, 25]]),
        "obstacle_distance_m": away[:, None],
        "min_spacing_m": np.where(np.abs(time - 6) < 0.6, np.float32(spacing), np.float32(9.0)),
    }


@pytest.fixture
def results(tmp_path):
    traces = {("bio_inspired", 0): trace(), ("sff", 0): trace(-8.0, 1.0, lose=True), ("sdc", 0): trace(2.0)}
    rows = {policy: [SimpleNamespace(seed=0, metrics={"task_time_s": None, "collisions": 1})] for policy in POLICIES}
    return SimpleNamespace(
        folder=tmp_path,
        scenarios={"single_obstacle": load_scenario("single_obstacle", num_vehicles=2)},
        select=lambda scenario, policy, seeds: rows[policy],
        has=lambda scenario, policy, seed: True,
        trace=lambda scenario, policy, seed: traces[policy, seed],
    )


@pytest.fixture
def drawn(results, monkeypatch):
    """The pictures by name."""
    made = {}

    def save(figure, path):
        figure.canvas.draw()
        made[path.stem.removeprefix("single_obstacle_")] = figure
        return path

    monkeypatch.setattr(figures, "save", save)
    figures.draw_all(results, "single_obstacle", POLICIES, [0])
    return made


def test_every_policy_has_a_panel_and_the_last_is_the_legends(drawn):
    assert set(drawn) == {"routes", "obstacle_distance", "spacing"}
    for figure in drawn.values():
        titles = [ax.get_title(loc="left").split("\n")[0] for ax in figure.axes[:4]]
        assert titles == [*POLICIES, ""]
        assert figure.axes[3].get_legend() is not None
        assert "configuration" not in figure.get_suptitle()
        assert "vehicles (literature_185)" in figure.get_suptitle()


def test_distances_inside_the_obstacle_can_be_read_off(drawn):
    ax = drawn["obstacle_distance"].axes[0]
    low = ax.get_ylim()[0]
    labels = {tick.get_text() for tick, at in zip(ax.get_yticklabels(), ax.get_yticks(), strict=True) if at >= low}
    assert low < -8.0
    assert {"-5", "0", "5"} <= labels
    assert "smallest of all seeds: -8.00 m" in drawn["obstacle_distance"].axes[1].get_title(loc="left")


def test_spacing_shows_the_distance_that_is_a_collision(drawn):
    for ax in drawn["spacing"].axes[:3]:
        levels = {tuple(line.get_ydata()) for line in ax.get_lines() if len(line.get_ydata()) == 2}
        assert {(2.0, 2.0), (5.0, 5.0)} <= levels


def test_contacts_are_marked_where_they_begin_and_the_lost_do_not_matter():
    found = figures._contacts(trace(-8.0, 1.0, lose=True), 1.0)
    assert len(found) == 2
    np.testing.assert_allclose(found[0], [55.0, 0.0])  # between the two, at 5.5 s
    assert figures._contacts(trace(), 1.0).shape == (0, 2)


def test_the_style_is_left_behind_and_the_same_picture_is_the_same_file(tmp_path):
    before = dict(mpl.rcParams)

    def draw(path):
        with style.house_style():
            figure, (ax, _) = style.panels(2)
            ax.plot([0, 1], label="line")
            style.legend(figure)
            return style.save(figure, path)

    first, second = draw(tmp_path / "a" / "x.png"), draw(tmp_path / "y.png")
    assert first.read_bytes() == second.read_bytes()
    assert dict(mpl.rcParams) == before
    assert tuple(mpl.rcParams["axes.prop_cycle"].by_key()["color"]) != style.COLOURS
    with style.house_style():
        assert tuple(mpl.rcParams["axes.prop_cycle"].by_key()["color"]) == style.COLOURS


def test_the_style_is_part_of_the_package():
    assert (Path(style.__file__).parent / "house.mplstyle").exists()
