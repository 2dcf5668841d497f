"""A model of Stable-Baselines3 as a checkpoint. Needs ``sb3``."""

from typing import Any

from uuv_marl.baselines.learned.checkpoint import card_of, save_checkpoint
from uuv_marl.baselines.learned.layers import Architecture
from uuv_marl.envs.sb3 import SwarmVecEnv
from uuv_marl.errors import PolicyError
from uuv_marl.extras import extra
from uuv_marl.paths import UserPath

with extra("sb3", "training with Stable-Baselines3"):
    from stable_baselines3 import PPO
    from stable_baselines3.common.torch_layers import FlattenExtractor
    from torch import nn


def save_sb3(model: PPO, path: UserPath) -> None:
    """Write the actor of a model as a checkpoint, which ``make_policy`` and the benchmark run without torch.

    Args:
        model: PPO with ``MlpPolicy``, trained on ``SwarmVecEnv(..., observe="closeness")``.
        path: of the file, ``policy.safetensors`` in a folder of its own.

    Raises:
        PolicyError: the model has another environment or network; the message names the remedy.
    """
    env: Any = model.get_env()
    normalised = model.get_vec_normalize_env()
    while env is not None and not isinstance(env, SwarmVecEnv):
        env = getattr(env, "venv", None)
    changed = normalised is not None and normalised.norm_obs
    if env is None or env.observes_positions or changed or model.observation_space != env.observation_space:
        raise PolicyError(
            "the model must see what a checkpoint's network sees; train on SwarmVecEnv(..., observe='closeness'), "
            "without normalised observations and VecFrameStack"
        )
    policy: Any = model.policy
    hidden = list(policy.mlp_extractor.policy_net)
    plain = type(policy.features_extractor) is FlattenExtractor and not policy.squash_output
    if not plain or not hidden or [type(layer) for layer in hidden] != [nn.Linear, nn.Tanh] * (len(hidden) // 2):
        raise PolicyError(
            f"a checkpoint's network has tanh layers before its last, and nothing else, got {model.policy_kwargs}; "
            "leave activation_fn, features_extractor_class, squash_output and net_arch=[] out"
        )
    layers = [*hidden[::2], policy.action_net]
    tensors = {f"{k}.weight": layer.weight.detach().cpu().numpy().T for k, layer in enumerate(layers)}
    tensors |= {f"{k}.bias": layer.bias.detach().cpu().numpy() for k, layer in enumerate(layers)}
    architecture = Architecture(hidden=tuple(layer.out_features for layer in layers[:-1]))
    training = {"algorithm": "PPO of Stable-Baselines3", "agent_steps": model.num_timesteps, "seed": model.seed}
    save_checkpoint(path, card_of(env.scenario, network=architecture, training=training), tensors)
