"""Checkpoints with random weights."""

import numpy as np

from uuv_marl.baselines.learned.checkpoint import WEIGHTS_FILE, card_of, save_checkpoint
from uuv_marl.baselines.learned.layers import Architecture, shapes


def tensors(card, scale=0.3, seed=0):
    """Random ones, as a card says."""
    rng = np.random.default_rng(seed)
    return {
        name: (scale * rng.standard_normal(shape)).astype(np.float32)
        for name, shape in shapes(card.network, card.sizes).items()
    }


def card_for(scenario, kind="mlp", memory=False, hidden=(16, 16), **more):
    return card_of(scenario, network=Architecture(kind=kind, memory=memory, hidden=hidden), **more)


def saved(folder, scenario, scale=0.3, **more):
    """A checkpoint for a scenario; the path of its folder."""
    card = card_for(scenario, **more)
    save_checkpoint(folder / WEIGHTS_FILE, card, tensors(card, scale))
    return str(folder)
