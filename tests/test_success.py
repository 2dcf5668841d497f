"""Success with disturbances: safe, done and counted vehicles; and episodes that arrival does not end."""

import numpy as np
import pytest

import uuv_marl
from tests.swarms import batched, run_of, started
from uuv_marl.benchmark.success import CENTRE_M, GRACE_S, SuccessRecorder

SPREAD_M = 80.0
LONG = {"arrival.ends_episode": False, "time_limit.factor": 1.0, "time_limit.extra_s": GRACE_S}
WORLD = np.ones(1, np.bool_)


class Story:
    """A hand-made episode: what each moment of it says is written, and nothing is simulated."""

    def __init__(self, n, **overrides):
        self.swarm = started("single_obstacle", overrides, n=n)
        self.recorder = SuccessRecorder(self.swarm)
        self.recorder.update(WORLD)

    def moment(self, since_s, offsets, touching=(), lost=()):
        """At ``since_s`` after l(t)'s end: offsets of all vehicles from it, new collisions, and losses."""
        swarm, facts, state = self.swarm, self.swarm.facts, self.swarm.state
        facts.time_s[0] = swarm.duration_s[0] + since_s
        state.tick[0] = round(facts.time_s[0] * 10)
        facts.reference[0, 0, :2] = 600.0
        state.eta[0, :, :2] = 600.0 + np.asarray(offsets)
        facts.vehicle_collisions[0], facts.lost[0] = 0, False
        state.collided[0, list(touching)] = True
        facts.vehicle_collisions[0, list(touching)], facts.lost[0, list(lost)] = 1, True
        state.alive[0, list(lost)] = False
        self.recorder.update(WORLD)
        return self

    @property
    def end(self):
        return self.recorder.metrics(0)


def ring(n, radius_m=30.0):
    angle = 2.0 * np.pi * np.arange(n) / n
    return radius_m * np.stack([np.cos(angle), np.sin(angle)], axis=1)


def moved(n, vehicle, radius_m):
    """All on the ring but one."""
    offsets = ring(n)
    offsets[vehicle] = radius_m, 0.0
    return offsets


def test_all_at_their_goal_and_collision_free_is_success():
    shares = dict.fromkeys(("success_share", "safe_share", "done_share"), 1.0)
    assert Story(4).moment(GRACE_S, ring(4)).end == shares | {"swarm_success": 1, "vehicles_faulty": 0}


def test_one_collision_at_any_time_makes_both_unsafe():
    for story in (
        Story(5).moment(-90.0, ring(5), touching=(1, 3)).moment(GRACE_S, ring(5)),
        Story(5).moment(GRACE_S, ring(5)).moment(GRACE_S + 1.0, ring(5), touching=(1, 3)),
    ):
        end = story.end
        assert (end["safe_share"], end["done_share"], end["success_share"]) == (0.6, 1.0, 0.6)
        assert end["swarm_success"] == 0


@pytest.mark.parametrize(("away", "done"), [(SPREAD_M - 0.01, 1.0), (SPREAD_M + 0.01, 0.75)])
def test_done_is_the_place_sixty_seconds_after_the_reference(away, done):
    offsets = moved(4, 2, away)
    early = Story(4).moment(GRACE_S - 0.1, ring(4, 500.0)).moment(GRACE_S, offsets).moment(90.0, ring(4, 500.0))
    assert early.end["done_share"] == done
    assert early.end["safe_share"] == 1.0


def test_the_spread_grows_with_large_swarms():
    assert Story(216).moment(GRACE_S, ring(216, 2.0 * SPREAD_M - 0.01)).end["done_share"] == 1.0
    assert Story(216).moment(GRACE_S, ring(216, 2.0 * SPREAD_M + 0.01)).end["done_share"] == 0.0


def test_a_swarm_may_miss_one_of_twenty_and_stand_off_a_little():
    assert Story(20).moment(GRACE_S, moved(20, 0, 100.0)).end["swarm_success"] == 1
    two = moved(20, 0, 100.0)
    two[10] = -100.0, 0.0
    assert Story(20).moment(GRACE_S, two).end["swarm_success"] == 0
    for aside, succeeds in ((CENTRE_M - 0.01, 1), (CENTRE_M + 0.01, 0)):
        assert Story(20).moment(GRACE_S, ring(20) + np.array([aside, 0.0])).end["swarm_success"] == succeeds


def test_nothing_is_judged_before_its_time():
    end = Story(3).moment(GRACE_S - 0.1, ring(3)).end
    assert end == {**dict.fromkeys(end), "vehicles_faulty": 0}


def test_faulty_vehicles_count_only_in_the_collisions_of_others():
    broken = {"kind": "yaw", "share": 0.3, "onset_s": 5.0}
    story = Story(10, faults=[broken])
    faulty = np.flatnonzero(story.swarm._disturbances.hull.broken[0, :, 0, 0] == 50)
    assert len(faulty) == 3
    offsets = ring(10)
    offsets[faulty] = 5000.0
    healthy = np.setdiff1d(np.arange(10), faulty)
    end = story.moment(GRACE_S, offsets, touching=(faulty[0], healthy[0])).end
    assert end["vehicles_faulty"] == 3
    assert end["done_share"] == 1.0
    assert end["safe_share"] == end["success_share"] == pytest.approx(6 / 7)


def test_a_fault_counts_from_the_hold_in_which_it_acts():
    fault = {"kind": "array", "array": "bow", "share": 0.1, "onset_s": 0.3}
    swarm = started("single_obstacle", {"faults": [fault]})
    counts = []
    for _ in range(6):
        counts.append(int(swarm.faulty.sum()))
        swarm.step(np.zeros((1, 54, 2), np.float32))
    assert counts == [0, 0, 0, 0, 6, 6]


def test_lost_vehicles_are_excused_unless_a_collision_lost_them():
    end = Story(4).moment(10.0, ring(4), lost=(1,)).moment(GRACE_S, ring(4)).end
    assert (end["vehicles_faulty"], end["success_share"], end["swarm_success"]) == (1, 1.0, 1)
    end = Story(4).moment(10.0, ring(4), touching=(1,), lost=(1,)).moment(GRACE_S, ring(4)).end
    assert (end["vehicles_faulty"], end["success_share"], end["swarm_success"]) == (0, 0.75, 0)
    end = Story(3).moment(10.0, ring(3), touching=(0, 1, 2), lost=(0, 1, 2)).end
    assert (end["success_share"], end["done_share"]) == (0.0, 0.0)
    end = Story(3).moment(10.0, ring(3), lost=(0, 1, 2)).end
    assert (end["success_share"], end["vehicles_faulty"]) == (None, 3)


def test_an_episode_that_arrival_does_not_end_goes_on_as_it_was():
    """The same run to arrival, with the same arrival, and then to the time limit."""
    short, long = (run_of("bio_inspired_plus", "starter", changes, 3) for changes in ({}, LONG))
    assert long.metrics["task_time_s"] == short.metrics["task_time_s"]
    assert short.metrics["success_share"] is None
    assert long.metrics["success_share"] == 1.0
    steps = len(short.series["time_s"])
    np.testing.assert_array_equal(long.series["centre_error_m"][:steps], short.series["centre_error_m"])
    assert long.series["time_s"][-1] == pytest.approx(long.metrics["duration_s"] + GRACE_S)


def test_arrival_is_rewarded_once_and_is_in_the_last_info():
    quick = {**LONG, "trajectory.speed_mps": 40.0, "arrival.radius_m": 5e3, "arrival.spread_m": 2e4}
    quick |= {"time_limit.extra_s": 6.0, "timing.decision_period_s": 0.5, "arrival.dwell_s": 0.7}
    batch = batched("starter", quick)
    rewards = []
    while not batch.over.all():
        result = batch.step(np.zeros((1, 5, 2), np.float32))
        rewards.append(float(result.terms["arrival"][0, 0]))
        assert not result.terminated.any()
    assert result.world_truncated.all()
    assert np.count_nonzero(rewards) == 1
    assert batch.swarm.arrived[0]
    env = uuv_marl.parallel_env("starter", overrides=quick)
    env.reset(seed=0)
    infos = {}
    while env.agents:
        *_, infos = env.step({agent: np.zeros(2, np.float32) for agent in env.agents})
    told = infos["uuv_0"]
    assert (told["ending"], told["is_success"], told["arrived"]) == ("time_limit", True, True)
