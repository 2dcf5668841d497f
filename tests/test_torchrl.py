"""TorchRL itself: its checks, its collector, its PPO loss, on our environment."""

import warnings

import pytest
import torch
from tensordict.nn import TensorDictModule
from tensordict.nn.distributions import NormalParamExtractor

with warnings.catch_warnings():
    warnings.simplefilter("ignore")  # TorchRL 0.14 deprecates parts of itself as it is imported.
    import torchrl.envs as rl
    from torchrl.collectors import Collector
    from torchrl.envs.utils import check_env_specs
    from torchrl.modules import MultiAgentMLP, ProbabilisticActor, TanhNormal
    from torchrl.objectives import ClipPPOLoss, ValueEstimators

import uuv_marl
from tests import contract
from uuv_marl.envs.torchrl import SwarmEnv

SHORT = {"time_limit.factor": 0.01, "time_limit.extra_s": 5.0}
LOSSES = {**SHORT, "losses.times_s": [1.0, 2.0]}
GROUP_DONE = {"reward": ("uuv", "reward"), "done": ("uuv", "done"), "terminated": ("uuv", "terminated")}


def swarm(num_worlds=3, scenario="random_field", overrides=SHORT, **kwargs):
    return SwarmEnv(num_worlds, scenario, num_vehicles=4, decision_period=0.5, overrides=overrides, **kwargs)


def network(outputs, centralised):
    return MultiAgentMLP(
        n_agent_inputs=98, n_agent_outputs=outputs, n_agents=4, centralized=centralised, share_params=True, depth=1,
        num_cells=16,
    )  # fmt: skip


@pytest.fixture
def actor():
    torch.manual_seed(0)
    net = torch.nn.Sequential(network(4, centralised=False), NormalParamExtractor())
    keys = {"in_keys": [("uuv", "observation")], "out_keys": [("uuv", "loc"), ("uuv", "scale")]}
    return ProbabilisticActor(
        TensorDictModule(net, **keys), in_keys=keys["out_keys"], out_keys=[("uuv", "action")],
        distribution_class=TanhNormal, return_log_prob=True, log_prob_key=("uuv", "sample_log_prob"),
    )  # fmt: skip


def test_specs_hold(scenario_name):
    check_env_specs(SwarmEnv(2, scenario_name, num_vehicles=8, decision_period=0.5))


def test_a_seed_waits_for_each_worlds_next_reset():
    env = swarm()
    data = env.reset()
    env.set_seed(4)
    data["_reset"] = torch.tensor([[True], [False], [False]])
    seeded = swarm(seed=4).reset()["uuv", "observation"]
    part = env.reset(data.clone())["uuv", "observation"]
    torch.testing.assert_close(part[0], seeded[0], rtol=0, atol=0)
    torch.testing.assert_close(part[1:], data["uuv", "observation"][1:], rtol=0, atol=0)
    whole = env.reset()["uuv", "observation"]
    torch.testing.assert_close(whole[1:], seeded[1:], rtol=0, atol=0)
    assert not torch.equal(whole[0], seeded[0])


def test_the_arrival_is_paid_once_however_often_an_ended_world_is_stepped():
    returns = []
    for skip in (1, 4):
        env = rl.TransformedEnv(swarm(1, "single_obstacle", contract.ARRIVES, seed=0), rl.FrameSkipTransform(skip))
        idle = TensorDictModule(lambda o: torch.zeros(*o.shape[:-1], 2), [("uuv", "observation")], [("uuv", "action")])
        data = env.rollout(40, idle)
        assert data["next", "terminated"][0, -1]
        assert data["next", "uuv", "terminated"][0, -1].all()
        returns.append(data["next", "uuv", "reward"].sum())
    assert returns[0] > 50.0
    torch.testing.assert_close(returns[0], returns[1])


@pytest.mark.parametrize(
    ("scenario", "overrides"), [("random_field", SHORT), ("lossy", LOSSES), ("starter", contract.MEDIUM | SHORT)]
)
def test_ppo_loss_trains_with_the_collector(actor, scenario, overrides):
    env = rl.TransformedEnv(
        swarm(scenario=scenario, overrides=overrides),
        rl.Compose(rl.InitTracker(), rl.RewardSum(in_keys=[("uuv", "reward")], reset_keys=["_reset"])),
    )
    critic = TensorDictModule(network(1, centralised=True), [("uuv", "observation")], [("uuv", "state_value")])
    loss = ClipPPOLoss(actor, critic)
    loss.set_keys(
        **GROUP_DONE, action=("uuv", "action"), value=("uuv", "state_value"),
        sample_log_prob=("uuv", "sample_log_prob"),
    )  # fmt: skip
    loss.make_value_estimator(ValueEstimators.GAE, gamma=0.98, lmbda=0.95)
    optimiser = torch.optim.Adam(loss.parameters(), 1e-3)
    before = torch.nn.utils.parameters_to_vector(actor.parameters()).detach().clone()
    collector = Collector(env, actor, frames_per_batch=90, total_frames=270)
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")  # TorchRL's own, on torch 2.13
        for batch in collector:
            assert torch.isfinite(batch["next", "uuv", "episode_reward"]).all()
            with torch.no_grad():
                loss.value_estimator(batch, params=loss.critic_network_params)
            total = sum(value for key, value in loss(batch[batch["uuv", "mask"].all(-1)]).items() if "loss_" in key)
            optimiser.zero_grad()
            total.backward()
            optimiser.step()
    collector.shutdown()
    after = torch.nn.utils.parameters_to_vector(actor.parameters())
    assert torch.isfinite(after).all()
    assert not torch.equal(before, after)


@pytest.mark.parametrize("mode", ["SameStep", "Disabled"])
def test_torchrls_wrapper_of_gymnasium_environments(mode):
    options = {"num_vehicles": 4, "decision_period": 0.5, "overrides": SHORT}
    env = rl.GymWrapper(uuv_marl.vector_env(3, "random_field", autoreset_mode=mode, **options))
    check_env_specs(env)
    data = env.rollout(40, break_when_any_done=False)
    over = data["next", "done"].squeeze(-1)
    assert over.sum() >= 6
    assert data["observation"].shape == (3, 40, 4, 98)
    first, last = data["observation"][:, 1:][over[:, :-1]], data["next", "observation"][:, :-1][over[:, :-1]]
    assert not torch.equal(first, last), "the new episode's observation, and the old one's last"
    assert (data["observation"][:, 1:] == data["next", "observation"][:, :-1])[~over[:, :-1]].all()
    with pytest.raises(RuntimeError, match="must be one of SAME_STEP or DISABLED"):
        rl.GymWrapper(uuv_marl.vector_env(1, autoreset_mode="NextStep", **options))


@pytest.mark.parametrize("scenario", ["random_field", "lossy"])
def test_torchrls_wrapper_of_pettingzoo_environments(scenario):
    overrides = LOSSES if scenario == "lossy" else SHORT
    inner = uuv_marl.parallel_env(scenario, num_vehicles=4, decision_period=0.5, overrides=overrides)
    with warnings.catch_warnings():
        warnings.filterwarnings("ignore", "PettingZoo in TorchRL is tested using version")
        env = rl.PettingZooWrapper(inner, return_state=True, use_mask=True)
    check_env_specs(env)
    data = env.rollout(60, break_when_any_done=False)
    assert data["uuv", "observation"].shape == (60, 4, 98)
    assert data["state"].shape == (60, inner.state_space.shape[0])
    assert data["next", "done"].any()
