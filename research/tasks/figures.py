"""The picture of the learners' curves."""

# pyright: reportUnknownMemberType=false
# Matplotlib leaves the types of its keyword arguments open.

from collections.abc import Sequence
from pathlib import Path

from research.episodes import Row, measured, select
from uuv_marl.benchmark.style import BLUE, ORANGE, legend, panels, save


def draw_curves(curves: Sequence[Row], headline: str, path: Path) -> Path:
    """Draw the headline, a share, over the minutes of each training."""
    figure, (ax,) = panels(1, 1, (7.0, 3.6))
    for learner in dict.fromkeys(row["learner"] for row in curves):
        mine, blind = select(curves, learner=learner), learner.startswith("blind")
        ax.plot(
            measured(mine, "minutes"), measured(mine, headline), color=ORANGE if blind else BLUE,
            label="trained with echoes zeroed" if blind else "trained with its sonar",
        )  # fmt: skip
    ax.set(xlabel="minutes of one core", ylabel=headline, ylim=(0.0, 1.0), xlim=(0.0, None))
    figure.suptitle("Episodes of validation: one line a training")
    return save(legend(figure, columns=2), path)
