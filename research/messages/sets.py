"""Sets of the study: numbers of bits and periods, shares of lost messages."""

from collections.abc import Iterator
from typing import NamedTuple

from research.sets import EpisodeSet

SEEDS = range(30_000, 30_100)
"""Seeds of the study, which no training, tuning or choosing used."""
BITS, PERIODS_S, LOSSES = (2, 4, 6, 8), (3.0, 5.0, 12.0, 25.0), (0.0, 0.2, 0.4, 0.6, 0.8)
"""Of a number; of a round, the first about the shortest that the speed of sound allows; of lost messages."""
USUAL = (8, 12.0)
"""Bits and period with which messages are lost, and with which networks run."""
_FAST_BPS = 20_000.0
"""Bit rate with which all rounds of the study fit their period, so that bits and period vary alone. Assumed."""


class Talk(NamedTuple):
    """A task, its policies that send messages, and its modem."""

    task: str
    metric: str
    """The task's main metric."""
    policy: str
    """The controller, in all sets."""
    silent: str
    """The best controller without messages."""
    range_m: float
    """Range of the modem."""
    guard_m: float
    """Length that sound crosses in a slot."""
    networks: tuple[str, ...] = ()
    """Trained policies that send messages, which run at ``USUAL`` without losses and with the third of them."""

    def modem(self, bits: int, period_s: float, loss: float) -> dict[str, object]:
        """Changed fields of the scenario."""
        modem = {
            "bits_per_entry": bits, "period_s": period_s, "loss_probability": loss, "bit_rate_bps": _FAST_BPS,
            "range_m": self.range_m, "guard_m": self.guard_m,
        }  # fmt: skip
        return {f"modem.{name}": value for name, value in modem.items()}

    def name(self, bits: int, period_s: float, loss: float) -> str:
        """Name of a set."""
        return f"{self.task}-{bits}-{period_s:g}-{loss:g}"

    def sets(self) -> Iterator[EpisodeSet]:
        """All bits and periods without losses, then all losses; the silent controller has the task's own scenario."""
        yield EpisodeSet(self.task, self.task, {self.silent: SEEDS})
        pairs = [(bits, period_s, 0.0) for bits in BITS for period_s in PERIODS_S]
        for point in pairs + [(*USUAL, loss) for loss in LOSSES[1:]]:
            for_networks = point[:2] == USUAL and point[2] in (LOSSES[0], LOSSES[2])
            policies = (self.policy, *(self.networks if for_networks else ()))
            yield EpisodeSet(self.name(*point), self.task, dict.fromkeys(policies, SEEDS), self.modem(*point))


TASKS = (
    Talk("few_informed", "uninformed_share", "leader_broadcast", "leader_follower", 60.0, 150.0),
    Talk("silent_targets", "held_share", "search_broadcast", "nearest_target,lanes=true", 500.0, 500.0),
)
