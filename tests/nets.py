"""Checkpoints with random weights, and which policies fly anywhere."""

import numpy as np

from uuv_marl import load_scenario
from uuv_marl.baselines import POLICIES
from uuv_marl.baselines.learned.checkpoint import WEIGHTS_FILE, card_of, card_rows, save_checkpoint
from uuv_marl.baselines.learned.layers import Architecture, shapes
from uuv_marl.baselines.learned.trained import Trained

ANYWHERE = [
    name
    for name, policy in POLICIES.items()
    if "path" not in policy.requirements.channels
    and name != "nearest_target"  # which needs a box
    and not (isinstance(policy, Trained) and policy.checkpoint.card.percept != card_rows(load_scenario("starter")))
]
"""Policies that fly in any scenario; the others need a channel, or a row of the observation, that few tasks have."""


def tensors(card, scale=0.3, seed=0):
    """Random ones, as a card says."""
    rng = np.random.default_rng(seed)
    return {
        name: (scale * rng.standard_normal(shape)).astype(np.float32)
        for name, shape in shapes(card.network, card.sizes, 2 + card.message_entries).items()
    }


def card_for(scenario, kind="mlp", memory=False, hidden=(16, 16), **more):
    return card_of(scenario, network=Architecture(kind=kind, memory=memory, hidden=hidden), **more)


def saved(folder, scenario, scale=0.3, **more):
    """A checkpoint for a scenario; the path of its folder."""
    card = card_for(scenario, **more)
    save_checkpoint(folder / WEIGHTS_FILE, card, tensors(card, scale))
    return str(folder)
