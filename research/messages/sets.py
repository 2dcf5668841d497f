"""Sets of the study: numbers of bits, times of a round, and shares of lost messages."""

from research.sets import EpisodeSet

TASK, METRIC = "few_informed", "uninformed_share"
CONTROLLER, SILENT = "leader_broadcast", "leader_follower"
"""The controller that sends messages, and the best one that sends none."""
SEEDS = range(30_000, 30_100)
"""Seeds of the study, which no training, tuning or choosing used."""
BITS, PERIODS_S, LOSSES = (2, 4, 6, 8), (3.0, 5.0, 12.0, 25.0), (0.0, 0.2, 0.4, 0.6, 0.8)
"""Of a number; of a round, the first about the shortest that the speed of sound allows; of lost messages."""
USUAL = (8, 12.0)
"""Bits and time of a round with which messages are lost."""
NETWORK, EXPERT = "mappo_few_informed_messages", "velocity_broadcast"
"""The network that sends messages, and the controller that it imitated; both by the usual modem."""
USUAL_LOSSES = (0.0, 0.4, 0.8, 1.0)
"""Shares of messages that these lose; at 1 nothing is ever received."""
_MODEM = {"modem.range_m": 60.0, "modem.guard_m": 150.0, "modem.bit_rate_bps": 20_000.0}
"""Range, so that messages pass over several vehicles; and a guard and bit rate with which all rounds of the study fit
their time, so that bits and time vary alone. Assumed."""


def name(bits: int, period_s: float, loss: float) -> str:
    """Name of a set."""
    return f"{TASK}-{bits}-{period_s:g}-{loss:g}"


def usual_name(loss: float) -> str:
    """Name of a set with the usual modem."""
    return f"{TASK}-usual-{loss:g}"


def _set(bits: int, period_s: float, loss: float) -> EpisodeSet:
    modem = _MODEM | {"modem.bits_per_entry": bits, "modem.period_s": period_s, "modem.loss_probability": loss}
    return EpisodeSet(name(bits, period_s, loss), TASK, {CONTROLLER: SEEDS}, modem)


SETS = (
    EpisodeSet(TASK, TASK, {SILENT: SEEDS}),
    *(_set(bits, period_s, 0.0) for bits in BITS for period_s in PERIODS_S),
    *(_set(*USUAL, loss) for loss in LOSSES[1:]),
    *(
        EpisodeSet(usual_name(loss), TASK, {NETWORK: SEEDS, EXPERT: SEEDS}, {"modem.loss_probability": loss})
        for loss in USUAL_LOSSES
    ),
)
"""The controller without messages, all bits and times without losses, all losses, and those of the usual modem."""
