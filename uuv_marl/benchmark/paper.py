"""Numbers stated in the paper (Wang et al., J. Mar. Sci. Eng. 2024, 12, 489), presumably of single runs."""

from typing import NamedTuple


class PaperFigure(NamedTuple):
    """The paper's numbers for a policy on a scenario; None if it states none."""

    task_time_s: float | None = None
    min_obstacle_distance_m: tuple[float, ...] | None = None
    min_spacing_m: float | None = None
    mean_min_spacing_m: float | None = None
    source: str = ""

    def values(self, metric: str) -> tuple[float, ...]:
        """The paper's values of a metric: none, one or two."""
        stated: float | tuple[float, ...] | None = getattr(self, metric, None)
        return stated if isinstance(stated, tuple) else () if stated is None else (stated,)


PAPER: dict[tuple[str, str], PaperFigure] = {
    ("tracking", "bio_inspired"): PaperFigure(min_spacing_m=10.03, mean_min_spacing_m=12.29, source="section 5.1"),
    ("single_obstacle", "bio_inspired"): PaperFigure(
        task_time_s=205.0, min_obstacle_distance_m=(10.48, 12.63), source="Table 2; section 5.2.1"
    ),
    ("single_obstacle", "sff"): PaperFigure(task_time_s=208.0, min_obstacle_distance_m=(3.7,), source="Table 2"),
    ("single_obstacle", "sdc"): PaperFigure(task_time_s=206.0, min_obstacle_distance_m=(4.2,), source="Table 2"),
    ("multi_obstacle", "bio_inspired"): PaperFigure(
        task_time_s=527.0, min_obstacle_distance_m=(6.34,), source="section 5.2.2"
    ),
}
"""The paper's numbers by scenario and policy."""
