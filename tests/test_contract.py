"""One contract over every API of the base environment; RLlib's and BenchMARL's own environments run theirs."""

import functools

import pytest

from tests import contract

EVERY = {case.name: case for case in contract.cases()}


@pytest.fixture(params=EVERY.values(), ids=EVERY.keys())
def case(request):
    return request.param


@functools.cache
def reference(name):
    return contract.parallel(EVERY[name])


def test_the_cases_show_every_ending(case):
    run = reference(case.name)
    assert run.over.any(axis=0).all(), "each world ends at least once"
    if case.overrides is contract.TIMES_OUT:
        assert run.truncated.any()
    if case.overrides is contract.ARRIVES:
        assert (run.terminated.sum(axis=2) >= 2).any(), "those who are left arrive together"
        assert not run.truncated.any()
    if case.scenario == "lossy" or case.name in ("sea-loses", "talk-loses"):
        assert (run.terminated.any(axis=2) & ~run.terminated.all(axis=2)).any(), "a vehicle is lost alone"
    if case.name == "sinks":
        assert (run.over & run.terminated.any(axis=2) & ~run.truncated.any(axis=2)).any(), "the last are lost"


@pytest.mark.parametrize("api", ["aec", "vector", pytest.param("torchrl", marks=pytest.mark.needs("torchrl"))])
def test_every_api_gives_the_same_run(case, api):
    getattr(contract, api)(case).equals(reference(case.name))


@pytest.mark.needs("stable_baselines3")
def test_sb3_gives_the_same_run_or_refuses_losses(case):
    if case.scenario == "lossy" or case.name in ("sinks", "sea-loses", "talk-loses"):
        with pytest.raises(ValueError, match="SwarmVecEnv can't represent the loss of a vehicle"):
            contract.sb3(case)
    else:
        contract.sb3(case).equals(reference(case.name))


def test_the_comparison_can_fail():
    run = reference(next(iter(EVERY)))
    for field in run._fields:
        values = getattr(run, field).copy()
        values.flat[-1] = not values.flat[-1] if values.dtype == bool else values.flat[-1] + 0.5
        changed = run._replace(**{field: values})
        with pytest.raises(AssertionError, match=f"{field} differs"):
            changed.equals(run)
