"""Delays and errors of sonar and navigation: properties, and distributions over 10^5 samples."""

import itertools
import math

import numpy as np
import pytest
from scipy.stats import kstest, norm

import uuv_marl
from tests import contract
from tests.swarms import started
from uuv_marl import load_scenario
from uuv_marl.scenario import sonar_is_ideal
from uuv_marl.sim.disturbances.noise import is_silent
from uuv_marl.sim.disturbances.schedule import Reading, control_step_of, due, latest

CHANNELS = {"sonar.channels": ["compass", "link", "age", "ranged"]}
SONAR = ("detected", "neighbour", "echo", "echo_range", "echo_position", "link_identity")
LATE = {"latency.processing_s": 0.3}
CARRIED = {"latency.processing_s": 0.5, "latency.compensated": True}
PINGS = {"latency.active_period_s": 0.25, "latency.passive_period_s": 0.7}
TRAVEL = {"latency.travel_time": True, "latency.sound_speed_mps": 100.0}
BLUR = {"noise.bearing_deg": 5.0, "noise.range_m": 0.5, "noise.range_share": 0.05}
FACTOR = {"noise.passive_range_log_sd": 0.3}
BEARINGS = {"noise.passive_ranges": False}
DETECTION = {"noise.active_r50_m": 40.0, "noise.passive_r50_m": 60.0}
SILENCE = {"noise.silence_probability": 0.1, "noise.silence_readings": 5}
FALSE = {"noise.false_echo_probability": 0.1}
DRIFT = {"navigation.drift_share": 0.1}
COMPASS = {"navigation.compass_bias_deg": 10.0}
DEAD = {"faults": [{"kind": "array", "array": "bow", "share": 0.5, "onset_s": 1.0, "duration_s": 1.0}]}
ERRORS = BLUR | FACTOR | DETECTION | SILENCE | FALSE | DRIFT | COMPASS | DEAD
EVERYTHING = CARRIED | PINGS | {"latency.travel_time": True} | ERRORS
CURRENT = {"current.speed_mps": 2.0, "current.variation_mps": 1.0, "current.eddies": 16, "current.eddy_speed_mps": 2.0}
EVERY_CHANNEL = {"sonar.channels": ["compass", "link", "current", "age", "ranged", "modem"]}
HOLD = 0.1
SIGMAS = 5.0  # no seed misses these


def near_obstacles(swarm):
    """Vehicles on a grid around the first obstacle, at every heading."""
    n = swarm.num_vehicles
    for w in range(swarm.num_worlds):
        rng, (x, y, radius) = np.random.default_rng(w), swarm.world_map.obstacles[w, 0]
        angle, away = rng.uniform(-math.pi, math.pi, n), radius + rng.uniform(20.0, 90.0, n)
        swarm.state.eta[w] = np.stack(
            [x + away * np.cos(angle), y + away * np.sin(angle), angle + rng.normal(0, 3, n)], 1
        )
        swarm.state.eta[w, :, 2] = (swarm.state.eta[w, :, 2] + math.pi) % (2.0 * math.pi) - math.pi
    swarm.state.before[...] = swarm.state.eta[..., :2]
    swarm.observe()


def swim(overrides, decisions=40, num_vehicles=12, scenario="single_obstacle", idle=False):
    """A run with actions that don't depend on disturbances: observed and true values at every decision."""
    swarm = started(scenario, CHANNELS | overrides, seed=3, n=num_vehicles)
    if swarm.world_map.num_obstacles[0]:
        near_obstacles(swarm)
    rng, frames = np.random.default_rng(7), []
    for _ in range(decisions + 1):
        frames.append(frame(swarm))
        action = rng.uniform(-1.0, 1.0, (1, num_vehicles, 2))
        swarm.step(0.0 * action if idle else action)
    return swarm, frames


def frame(swarm):
    percept = swarm.percept
    known = {name: percept[name][0].copy() for name in percept.names}
    return known | {
        "who": swarm.detected_index[0].copy(),
        "eta": swarm.state.eta[0].copy(),
        "l": swarm.facts.reference[0, 0].copy(),
    }


def arrays_of(swarm):
    """Sub-sectors of each array, and their indices among the active ones."""
    first, active = 0, 0
    for array in swarm.scenario.sonar.arrays:
        own = array.sub_sectors if array.kind == "active" else 0
        yield array, slice(first, first + array.sub_sectors), slice(active, active + own)
        first, active = first + array.sub_sectors, active + own


def in_body(frame, north, east):
    """Points of the world (vehicle, ...) in each vehicle's body frame."""
    x, y, psi = (column.reshape(-1, *[1] * (np.ndim(north) - 1)) for column in frame["eta"].T)
    return turned(north - x, east - y, psi)


def turned(x, y, angle):
    """Vectors in axes that are turned clockwise by an angle."""
    c, s = np.cos(angle), np.sin(angle)
    return np.stack([c * x + s * y, c * y - s * x], -1)


def same(ours, theirs, names=SONAR, where=np.s_[:]):
    for name in names:
        assert ours[name][where].tobytes() == theirs[name][where].tobytes(), name


def test_readings_without_delay_and_error_change_no_bit():
    """A delay line of true values: a period of one control step, and outages that never begin."""
    _, calm = swim({})
    for overrides in ({"noise.silence_probability": 1e-300}, {"latency.passive_period_s": HOLD}):
        assert not sonar_is_ideal(load_scenario("starter", overrides=overrides))
        for ours, theirs in zip(swim(overrides)[1], calm, strict=True):
            same(ours, theirs, names=ours)


@pytest.mark.parametrize(("every", "delay", "holds"), [*itertools.product([1.0, 2.5, 7.0], [0, 1, 3, 20], [1, 5])])
def test_the_readings_taken_are_those_that_a_decision_uses(every, delay, holds):
    seen = {latest(decision - delay, every) for decision in range(0, 600, holds)} - {-1}
    taken = {due(hold, every, delay, holds) for hold in range(600)} - {-1}
    assert {m for m in seen if control_step_of(m, every) < 500} == {m for m in taken if control_step_of(m, every) < 500}


@pytest.mark.parametrize(
    "overrides", [LATE, {"latency.processing_s": 0.25}, PINGS, LATE | PINGS, {"latency.processing_s": 2.0}]
)
def test_a_delayed_reading_shows_the_past_with_its_age(overrides):
    swarm, late = swim(overrides)
    _, ideal = swim({})
    latency = swarm.scenario.latency
    delay, heard = math.ceil(latency.processing_s / HOLD - 1e-9), 0
    for t, known in enumerate(late):
        for array, sectors, active in arrays_of(swarm):
            period = latency.active_period_s if array.kind == "active" else latency.passive_period_s
            every = max(period / HOLD, 1.0)
            readings = [hold for hold in (math.floor(m * every + 0.5) for m in range(t + 2)) if hold <= t - delay]
            np.testing.assert_allclose(known["age"][:, sectors], HOLD * (t - max(readings, default=0)), rtol=1e-6)
            for names, where in ((("detected", "neighbour", "link_identity", "who"), sectors), (SONAR[2:5], active)):
                if readings:
                    same(known, ideal[max(readings)], names, np.s_[:, where])
                    heard += int((known[names[0]][:, where] > 0).sum())
                else:
                    assert not any((known[name][:, where] > 0).any() for name in names)
    assert heard > 1000


@pytest.mark.parametrize("reports", ["centre", "surface"])
def test_a_compensated_echo_is_where_the_obstacle_is(reports):
    """Obstacles are fixed and own motion is known, so that only rounding remains."""
    swarm, frames = swim(CARRIED | {"sonar.echo_reports": reports})
    _, ideal = swim({"sonar.echo_reports": reports})
    x, y, _ = swarm.world_map.obstacles[0, 0]
    for t in range(5, len(frames)):
        now, then, seen = frames[t], ideal[t - 5], frames[t]["echo"] > 0
        np.testing.assert_array_equal(now["echo"], then["echo"])
        if reports == "centre":
            points = np.broadcast_to(in_body(now, x, y)[:, None], now["echo_position"].shape)
        else:
            ahead, abeam = np.moveaxis(then["echo_position"].astype(float), -1, 0)
            places = then["eta"][:, None, :2] + turned(ahead, abeam, -then["eta"][:, 2, None])
            points = in_body(now, *np.moveaxis(places, -1, 0))
        np.testing.assert_allclose(now["echo_position"][seen], points[seen], atol=1e-4)
        moved = np.hypot(*np.moveaxis(points, -1, 0)) - np.hypot(*np.moveaxis(then["echo_position"], -1, 0))
        np.testing.assert_allclose(now["echo_range"][seen], (then["echo_range"] + moved)[seen], atol=1e-3)
    assert sum((f["echo"] > 0).sum() for f in frames) > 200


def test_a_compensated_neighbour_is_where_it_was():
    """Its own motion since is unknown: its position at reception, in the present body frame."""
    _, frames = swim(CARRIED)
    for t in range(5, len(frames)):
        now, then = frames[t], frames[t - 5]
        i, k = np.nonzero(now["detected"])
        j = now["who"][i, k]
        expected = in_body(now, then["eta"][None, :, 0], then["eta"][None, :, 1])[i, j]
        np.testing.assert_allclose(now["neighbour"][i, k], expected, atol=1e-4)


def test_sound_shows_vehicles_where_they_were():
    """R / c before, interpolated between control steps, and before the reset the initial position."""
    _, frames = swim(TRAVEL)
    for t, now in enumerate(frames):
        i, k = np.nonzero(now["detected"])
        j = now["who"][i, k]
        ago = np.hypot(*(now["eta"][i, :2] - now["eta"][j, :2]).T) / (100.0 * HOLD)
        whole = ago.astype(int)
        places = [
            np.stack([frames[max(t - m, 0)]["eta"][n, :2] for m, n in zip(whole + later, j, strict=True)])
            for later in (0, 1)
        ]
        was = places[0] + (ago - whole)[:, None] * (places[1] - places[0])
        expected = turned(*(was - now["eta"][i, :2]).T, now["eta"][i, 2])
        np.testing.assert_allclose(now["neighbour"][i, k], expected, atol=1e-3)
    _, ideal = swim({})
    same(frames[-1], ideal[-1], ("detected", "echo", "echo_range", "echo_position", "who"))
    assert np.abs(frames[-1]["neighbour"] - ideal[-1]["neighbour"]).max() > 0.5


def polar(points):
    points = points.astype(np.float64)
    return np.hypot(points[..., 0], points[..., 1]), np.arctan2(points[..., 1], points[..., 0])


def pairs(overrides, field, flag):
    """Measured and true positions, where both are detected, of vehicles that come to rest; some 10^5."""
    decisions = 300 if flag == "detected" else 1700
    runs = (swim(change, decisions, num_vehicles=54, idle=True)[1] for change in (overrides, {}))
    both = [(a[field], b[field], (a[flag] > 0) & (b[flag] > 0)) for a, b in zip(*runs, strict=True)]
    return tuple(np.concatenate([pair[part][pair[2]] for pair in both]) for part in range(2))


def is_normal(values, num):
    """Mean, deviation and shape of a standard normal sample of at least this size."""
    assert len(values) >= num
    assert abs(values.mean()) < SIGMAS / math.sqrt(len(values))
    assert abs(values.std() - 1.0) < SIGMAS / math.sqrt(2.0 * len(values))
    assert kstest(values, "norm").pvalue > 1e-6


@pytest.mark.parametrize(
    ("field", "flag", "num"), [("neighbour", "detected", 100_000), ("echo_position", "echo", 90_000)]
)
def test_errors_of_bearings_and_ranges_are_as_given(field, flag, num):
    heard, true = pairs(BLUR, field, flag)
    (away, bearing), (r, psi) = polar(heard), polar(true)
    turn = np.remainder(bearing - psi + math.pi, 2.0 * math.pi) - math.pi
    reach = r if flag == "detected" else pairs(BLUR, "echo_range", "echo")[1].astype(float)
    far = reach > 20.0  # where no range falls below 0
    is_normal(turn[far] / math.radians(5.0), num)
    is_normal(((away - r) / (0.5 + 0.05 * reach))[far], num)


def test_an_echo_s_position_moves_as_far_as_its_range():
    heard, true = pairs(BLUR, "echo_position", "echo")
    reach, truth = pairs(BLUR, "echo_range", "echo")
    np.testing.assert_allclose(polar(heard)[0] - polar(true)[0], reach.astype(float) - truth, atol=1e-3)


def test_a_passive_range_has_a_factor_that_lasts():
    swarm, wrong = swim(FACTOR)
    _, true = swim({})
    factor = swarm._disturbances.sensor_errors.factor[0]
    for ours, theirs in zip(wrong, true, strict=True):
        same(ours, theirs, ("detected", "echo", "echo_range", "echo_position", "who"))
        for array, sectors, _ in arrays_of(swarm):
            scale = factor[:, None, None] if array.kind == "passive" else 1.0
            expected = scale * theirs["neighbour"][:, sectors]
            np.testing.assert_allclose(ours["neighbour"][:, sectors], expected, rtol=1e-5)
    drawn = started("single_obstacle", FACTOR, worlds=200)
    is_normal(np.log(drawn._disturbances.sensor_errors.factor.ravel()) / 0.3, 10_000)


def test_bearings_alone():
    swarm, frames = swim(BEARINGS | {"noise.nominal_range_m": 30.0})
    _, ideal = swim({})
    for ours, theirs in zip(frames, ideal, strict=True):
        for array, sectors, _ in arrays_of(swarm):
            passive, heard = array.kind == "passive", ours["detected"][:, sectors] > 0
            np.testing.assert_array_equal(ours["ranged"][:, sectors], 0.0 if passive else 1.0)
            (away, bearing), (r, psi) = (polar(f["neighbour"][:, sectors][heard]) for f in (ours, theirs))
            np.testing.assert_allclose(bearing, psi, atol=1e-6)
            np.testing.assert_allclose(away, 30.0 if passive else r, rtol=1e-6)
        assert (theirs["ranged"] == 1.0).all()


def test_the_probability_of_detection_falls_with_range_as_given():
    swarm, heard = swim(DETECTION, 300, num_vehicles=54, idle=True)
    _, there = swim({}, 300, num_vehicles=54, idle=True)
    counted = 0
    for array, sectors, active in arrays_of(swarm):
        spreading, half = (40.0, 40.0) if array.kind == "active" else (20.0, 60.0)
        for flag, where in (("detected", sectors), ("echo", active)):
            present = np.concatenate([f[flag][:, where] > 0 for f in there])
            r = np.concatenate(
                [f["echo_range"][:, where] if flag == "echo" else polar(f["neighbour"][:, where])[0] for f in there]
            )
            chance = norm.cdf(spreading * np.log10(half / r[present]) / 6.0)
            found = np.concatenate([f[flag][:, where] for f in heard])
            assert not (found[~present] > 0).any()
            for low, high in itertools.pairwise(np.quantile(r[present], np.linspace(0, 1, 6)) if present.any() else []):
                inside = (r[present] >= low) & (r[present] <= high)
                spread = math.sqrt((chance * (1.0 - chance))[inside].sum()) + 1.0
                assert abs((found[present] - chance)[inside].sum()) < SIGMAS * spread
            counted += present.sum()
    assert counted > 100_000


@pytest.mark.parametrize(("probability", "length"), [(0.3, 20), (0.05, 5), (0.1, 1), (1.0, 3)])
def test_outages_have_the_given_rate_and_length(probability, length):
    overrides = {"noise.silence_probability": probability, "noise.silence_readings": length}
    swarm = started("starter", overrides, n=1)
    own, num, silent_at = swarm._disturbances, 100_000, getattr(is_silent, "py_func", is_silent)
    silent = np.array(
        [silent_at(Reading(0, 1, m, m, 0), 0, own.keys[0], own.noise_model, own.sensor_errors) for m in range(num)]
    )
    edges = np.flatnonzero(np.diff(np.concatenate([[0], silent, [0]])))
    assert ((edges[1::2] - edges[::2])[:-1] % length == 0).all()
    bursts = silent.sum() / length
    chances = num - silent.sum() + bursts  # readings at which a silence could begin
    assert abs(bursts - probability * chances) <= SIGMAS * math.sqrt(probability * (1.0 - probability) * chances) + 1.0


def test_a_silent_array_detects_nothing_and_the_others_all():
    swarm, frames = swim(SILENCE, 200)
    _, ideal = swim({}, 200)
    quiet = []
    for ours, theirs in zip(frames, ideal, strict=True):
        for _, sectors, active in arrays_of(swarm):
            for i in range(12):
                mine = np.concatenate([ours["detected"][i, sectors], ours["echo"][i, active]])
                full = np.concatenate([theirs["detected"][i, sectors], theirs["echo"][i, active]])
                assert not mine.any() or (mine == full).all()
                quiet += [not mine.any()] if full.any() else []
    # p L / (p L + 1 - p); the readings of a burst are no draws of their own
    assert abs(np.mean(quiet) - 0.5 / 1.4) < 0.06


@pytest.mark.parametrize("probability", [0.02, 0.2])
def test_false_echoes_have_their_rate_and_fill_their_sub_sectors(probability):
    overrides = CHANNELS | {"obstacles": [], "noise.false_echo_probability": probability}
    swarm = started("starter", overrides, n=1)
    frames = []
    for _ in range(5000):
        swarm.step(np.zeros((1, 1, 2)))
        frames.append(frame(swarm))
    for array, sectors, active in arrays_of(swarm):
        echoes = array.kind == "active"
        flag, field, where = ("echo", "echo_position", active) if echoes else ("detected", "neighbour", sectors)
        found = np.concatenate([f[flag][:, where] for f in frames]) > 0
        spread = math.sqrt(probability * (1.0 - probability) * found.size)
        assert abs(found.sum() - probability * found.size) < SIGMAS * spread
        assert (np.abs(found.sum(0) - found.sum() / 7) < SIGMAS * spread / math.sqrt(7)).all()
        away, bearing = polar(np.concatenate([f[field][:, where] for f in frames]))
        assert kstest(away[found] / array.range_m, "uniform").pvalue > 1e-6
        edge = math.radians(array.mounting_deg - array.aperture_deg / 2)
        share = np.remainder(bearing - edge, 2.0 * math.pi) / math.radians(array.aperture_deg) * 7 - np.arange(7)
        assert kstest(share[found], "uniform").pvalue > 1e-6
        if echoes:
            np.testing.assert_allclose(np.concatenate([f["echo_range"] for f in frames])[found], away[found], rtol=1e-5)
            assert not any(f["detected"][:, sectors].any() for f in frames)
    assert all((f["who"] == -1).all() and not f["link_identity"].any() for f in frames)


def test_a_false_echo_is_detected_only_where_nothing_is_nearer():
    _, ours = swim(FALSE)
    _, theirs = swim({})
    phantoms = 0
    for false, true in zip(ours, theirs, strict=True):
        for flag, reach in (
            ("detected", polar(true["neighbour"])[0] - polar(false["neighbour"])[0]),
            ("echo", true["echo_range"] - false["echo_range"]),
        ):
            there, changed = true[flag] > 0, reach != 0.0
            assert (false[flag][there] > 0).all()
            assert (reach[there] >= 0.0).all()
            phantoms += (there & changed).sum()
        stays = (true["detected"] > 0) & (false["who"] >= 0)
        np.testing.assert_array_equal(false["neighbour"][stays], true["neighbour"][stays])
    assert phantoms > 20


def test_an_array_with_a_fault_detects_nothing():
    swarm, frames = swim(DEAD | FALSE)
    _, others = swim(FALSE)
    hit = {i for i in range(12) if swarm._disturbances.hull.broken[0, i, 0, 0] < 2**62}
    assert len(hit) == 6
    for t, (ours, theirs) in enumerate(zip(frames, others, strict=True)):
        for i in range(12):
            dead = i in hit and 10 <= t < 20
            same(ours, theirs, ("detected", "neighbour", "who"), np.s_[i, 7:])
            if dead:
                assert not any(ours[name][i].any() for name in SONAR[2:5])
                assert not ours["detected"][i, :7].any()
            else:
                same(ours, theirs, where=np.s_[i])


@pytest.mark.parametrize(
    "other", [DETECTION, SILENCE, DRIFT, COMPASS, DEAD, {"current.variation_mps": 0.0, "current.velocity": "water"}]
)
def test_one_disturbance_changes_no_error_of_bearings_and_ranges(other):
    alone, among = (swim(BLUR | FACTOR | change)[1] for change in ({}, other))
    for flag, field in (("detected", "neighbour"), ("echo", "echo_position")):
        both = [((a[flag] > 0) & (b[flag] > 0), a[field], b[field]) for a, b in zip(alone, among, strict=True)]
        assert sum(mask.sum() for mask, *_ in both) > 20
        for mask, ours, theirs in both:
            assert ours[mask].tobytes() == theirs[mask].tobytes()


@pytest.mark.parametrize("own", [DETECTION, SILENCE, DEAD])
@pytest.mark.parametrize("other", [BLUR | FACTOR | DRIFT | COMPASS, BEARINGS])
def test_one_disturbance_changes_no_missed_detection(own, other):
    for ours, theirs in zip(swim(own)[1], swim(own | other)[1], strict=True):
        same(ours, theirs, ("detected", "echo", "who"))


def drift_of(frame):
    """Each vehicle's position error, from its vector to l(t); shape (vehicle, 2)."""
    return frame["l"][:2] - turned(*frame["reference"].astype(float).T, -frame["eta"][:, 2]) - frame["eta"][:, :2]


def test_position_drifts_by_a_share_of_the_distance_travelled():
    _, frames = swim(DRIFT, 100, scenario="tracking")
    way = np.zeros(12)
    for before, now in itertools.pairwise(frames):
        way += np.hypot(*(now["eta"][:, :2] - before["eta"][:, :2]).T)
        np.testing.assert_allclose(np.hypot(*drift_of(now).T), 0.1 * way, atol=1e-3)
    halfway, end = (drift_of(frames[t]) @ [1, 1j] for t in (50, 100))
    np.testing.assert_allclose(np.angle(end / halfway), 0.0, atol=1e-2)
    assert np.ptp(np.angle(end)) > 2.0
    _, calm = swim({}, 100, scenario="tracking")
    same(frames[-1], calm[-1], [name for name in calm[-1] if name != "reference"])


def test_a_compass_has_a_constant_bias():
    _, frames = swim(COMPASS, 50)
    _, calm = swim({}, 50)
    angles = []
    for ours, theirs in zip(frames, calm, strict=True):
        true, known = (f["compass"].astype(float) @ [1, 1j] for f in (theirs, ours))
        bias = known / true
        angles.append(np.angle(bias))
        for name in ("reference", "reference_velocity"):
            expected = theirs[name].astype(float) @ [1, 1j] / bias
            np.testing.assert_allclose(ours[name].astype(float) @ [1, 1j], expected, atol=1e-4)
        same(ours, theirs)
    np.testing.assert_allclose(angles, np.broadcast_to(angles[0], np.shape(angles)), atol=1e-6)
    drawn = started("single_obstacle", COMPASS, worlds=200)
    bias = polar(drawn._disturbances.navigation_errors.bias)[1]
    is_normal(bias.ravel() / math.radians(10.0), 10_000)


def test_drift_displaces_compensated_readings():
    """Own motion is estimated by navigation: readings are displaced by the drift since their reception."""
    _, frames = swim(CARRIED | DRIFT, 60)
    _, true = swim(CARRIED, 60)
    for t in range(5, 61):
        i, k = np.nonzero(frames[t]["detected"])
        drift = (drift_of(frames[t]) - drift_of(frames[t - 5]))[i]
        off = frames[t]["neighbour"].astype(float)[i, k] - true[t]["neighbour"][i, k]
        np.testing.assert_allclose(off, -turned(*drift.T, frames[t]["eta"][i, 2]), atol=2e-3)


HARSH = {
    "noise.range_share": 1.0, "noise.range_m": 1e6, "noise.passive_range_log_sd": 3.0, "noise.bearing_deg": 180.0,
    "noise.false_echo_probability": 1.0, "latency.compensated": True, "latency.processing_s": 2.0,
    "navigation.drift_share": 1.0, "navigation.compass_bias_deg": 180.0,
}  # fmt: skip
FAR = {"noise.silence_probability": 1.0, "noise.nominal_range_m": 4096.0, "noise.passive_ranges": False}


@pytest.mark.parametrize("harsh", [EVERYTHING, HARSH, FAR], ids=["everything", "harsh", "far"])
@pytest.mark.parametrize("more", [{}, CURRENT, contract.MEDIUM], ids=["sonar", "current", "medium"])
def test_observations_stay_within_their_space(more, harsh):
    changes = more | harsh | EVERY_CHANNEL
    env = uuv_marl.vector_env(8, "random_field", num_vehicles=5, overrides=changes)
    observations, _ = env.reset(seed=0)
    for _ in range(200):
        assert env.observation_space.contains(observations)
        observations, rewards, *_ = env.step(env.action_space.sample())
        assert np.isfinite(rewards).all()


def test_odometry_is_the_motion_since_the_start_with_drift_in_the_frame_of_the_compass():
    overrides = {"sonar.channels": ["odometry", "compass"], "obstacles": []}
    for errors in ({}, DRIFT | COMPASS):
        swarm = started("starter", overrides | errors, 2, 3)
        start, rng = swarm.state.eta[:, :, :2].copy(), np.random.default_rng(0)
        for _ in range(60):
            swarm.step(rng.uniform(-1.0, 1.0, (2, swarm.num_vehicles, 2)))
        moved = swarm.state.eta[:, :, :2] + swarm._disturbances.navigation_errors.position_error - start
        told = swarm.percept["odometry"].astype(float) @ [1, 1j] * (swarm.percept["compass"].astype(float) @ [1, 1j])
        np.testing.assert_allclose(told, moved @ [1, 1j], atol=1e-4)
        assert np.abs(moved).max() > 1.0
