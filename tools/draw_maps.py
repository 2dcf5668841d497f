"""Draw docs/figures/hard_water.png: one map of each kind, with start, goal and a shortest path."""

from pathlib import Path

import numpy as np
from matplotlib.patches import Circle

from uuv_marl import load_scenario
from uuv_marl.benchmark.style import BLUE, ORANGE, house_style, panels, save
from uuv_marl.sim.swarm import Swarm
from uuv_marl.tasks.maps.grid_paths import CELL_M, distances, free_cells
from uuv_marl.tasks.maps.kinds import KINDS

ROOT = Path(__file__).resolve().parent.parent
SEED = 10_000
"""Seed of the maps: a tuning seed, so that no reported map is shown."""


def shortest_path(discs: np.ndarray, length: float, task: object) -> np.ndarray:
    """A shortest path from the start to the goal that keeps the clearance, shape (point, 2) [m]."""
    numbers = task.numbers
    grid = numbers.grid()
    goal = grid.cell(length, 0.0)
    far = distances(free_cells(discs, grid, numbers.clearance_m), *goal)
    at = [grid.cell(0.0, 0.0)]
    while at[-1] != goal:
        r, c = at[-1]
        near = [(r + i, c + k) for i in range(-2, 3) for k in range(-2, 3)]
        at.append(
            min(
                near,
                key=lambda cell: (
                    far[cell] + CELL_M * np.hypot(cell[0] - r, cell[1] - c)
                    if 0 <= cell[0] < grid.rows and 0 <= cell[1] < grid.columns and cell != (r, c)
                    else np.inf
                ),
            )
        )
    return np.array([(grid.x + CELL_M * r, grid.y + CELL_M * c) for r, c in at])


def main() -> None:
    """Write the picture."""
    with house_style():
        figure, axes = panels(len(KINDS) + 1, 4, (2.6, 1.6), sharex=True, sharey=True)
        for kind, ax in zip(KINDS, axes, strict=False):
            swarm = Swarm(load_scenario("hard_water", overrides={"task.kinds": [kind]}))
            sampled = swarm.task.sample_map(np.random.default_rng(SEED))
            for x, y, radius in sampled.discs:
                ax.add_patch(Circle((x, y), radius, color="0.55"))
            ax.plot(*shortest_path(sampled.discs, sampled.length, swarm.task).T, color=BLUE)
            ax.plot([0.0, sampled.length], [0.0, 0.0], "o", color=ORANGE)
            ax.set(title=kind, xlim=(-100.0, 490.0), ylim=(-130.0, 130.0), aspect="equal")
        for ax in axes[len(KINDS) :]:
            ax.set_axis_off()
        figure.supxlabel("along the path to the goal [m]")
        save(figure, ROOT / "docs" / "figures" / "hard_water.png")


if __name__ == "__main__":
    main()
