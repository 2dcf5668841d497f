"""``curve.png``: validations and reward of a training."""

# pyright: reportUnknownMemberType=false
# Matplotlib leaves the types of its keyword arguments open.

from collections.abc import Sequence
from pathlib import Path

from uuv_marl.benchmark.style import house_style, panels, save
from uuv_marl.train.folder import Record

_SHOWN = {
    "share of validation episodes": {"swarm_success": "swarm success", "share": "success of vehicles"},
    "collisions per validation episode": {"collisions": ""},
    "reward per decision, with noise\nand the cost of collisions": {"reward": ""},
}


def draw_curve(rows: Sequence[Sequence[str]], path: Path, title: str) -> None:
    """Draw validations and reward over processor time."""
    with house_style():
        figure, axes = panels(len(_SHOWN), 3, (4.2, 3.2))
        for ax, (what, columns) in zip(axes, _SHOWN.items(), strict=True):
            for name, label in columns.items():
                points = [(float(row[2]) / 60.0, float(row[Record._fields.index(name)])) for row in rows
                        if row[Record._fields.index(name)]]  # fmt: skip
                ax.plot(*zip(*points, strict=True), "." if len(points) == 1 else "-", label=label)
            ax.set(xlabel="processor time [min]", ylabel=what)
        axes[0].set_ylim(-0.02, 1.02)
        axes[0].legend()
        figure.suptitle(title, parse_math=False)
        save(figure, path)
