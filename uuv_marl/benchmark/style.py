"""Shared parts of all pictures: style, panels with one legend, obstacles and trajectories, and saving."""

# pyright: reportUnknownMemberType=false
# Matplotlib leaves the types of its keyword arguments open.

from contextlib import AbstractContextManager
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from uuv_marl.atomic import replacing
from uuv_marl.extras import pictures

with pictures():
    import matplotlib.style
    from matplotlib.artist import Artist
    from matplotlib.axes import Axes
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from matplotlib.figure import Figure
    from matplotlib.patches import Circle
    from PIL import Image

COLOURS = ("#0072B2", "#D55E00", "#009E73", "#CC79A7", "#E69F00", "#56B4E9", "#000000", "#999999")
"""Okabe and Ito's palette, as in ``house.mplstyle``."""
BLUE, ORANGE, GREEN, PINK, AMBER, SKY, BLACK, GREY = COLOURS


def house_style() -> AbstractContextManager[None]:
    """A context with ``house.mplstyle``; Matplotlib's settings are restored afterwards."""
    return matplotlib.style.context(["default", "uuv_marl.benchmark.house"])


def panels(
    num: int, columns: int = 4, size: tuple[float, float] = (5.2, 4.4), **options: Any
) -> tuple[Figure, list[Axes]]:
    """A figure with at least ``num`` panels, row by row; further ones are empty."""
    rows = -(-num // columns)
    across = -(-num // rows)
    figure = Figure(figsize=(size[0] * across, size[1] * rows))
    axes: list[Axes] = figure.subplots(rows, across, squeeze=False, **options).ravel().tolist()
    for ax in axes[num:]:
        ax.set_axis_off()
    return figure, axes


def legend(figure: Figure, into: Axes | None = None, columns: int = 5) -> Figure:
    """Add one legend for all panels, below them or in an empty panel; return the figure."""
    handles: dict[str, Artist] = {}
    for ax in figure.axes:
        for handle, label in zip(*ax.get_legend_handles_labels(), strict=True):
            handles.setdefault(label, handle)
    if into is None:
        figure.legend(handles.values(), handles.keys(), loc="outside lower center", ncols=columns)
    else:
        into.legend(handles.values(), handles.keys(), loc="center", fontsize=9)
    return figure


def draw_map(ax: Axes, waypoints: NDArray[Any], obstacles: Any, team: str | None = None) -> None:
    """Draw waypoints (point, 2), the last as the goal, and obstacles (across, up, radius) [m]; in a team's colour."""
    name, size = ("trajectory of l(t)", 11) if len(waypoints) > 1 else ("", 5)
    ax.plot(*waypoints.T, "--", color=team or BLACK, linewidth=1.0, zorder=3, label=name)
    ax.plot(
        *waypoints[-1], "*", color=team or AMBER, mec=team or BLACK, mew=0.6, ms=size, zorder=5, ls="", label="goal"
    )
    for k, (across, up, radius) in enumerate(obstacles):
        ax.add_patch(Circle((across, up), radius, color="0.45", zorder=2, label="" if k else "obstacle"))
    ax.set_aspect("equal")


def save(figure: Figure, path: Path) -> Path:
    """Save a figure as PNG in 256 colours, with the same bytes for the same picture."""
    path.parent.mkdir(parents=True, exist_ok=True)
    canvas = FigureCanvasAgg(figure)
    canvas.draw()
    picture = Image.fromarray(np.asarray(canvas.buffer_rgba())).convert("RGB").quantize(256)
    with replacing(path) as partial:
        picture.save(partial, "PNG", optimize=True, dpi=(figure.dpi, figure.dpi))
    return path
