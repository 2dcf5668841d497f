"""Metrics of every run, of any task: names that a task's own metrics can't have."""

from typing_extensions import TypedDict


class Shares(TypedDict):
    """Shares of the samples at which Eq. 7's constraints held, each from 0 to 1."""

    all: float
    s_l: float
    s_o: float
    s_u: float


class Measures(TypedDict):
    """Metrics of the swarm; None if there was nothing to measure.

    Distances are in m and taken from the start to the episode's end; times are in s.
    """

    task_time_s: float | None
    time_within_1_m_s: float | None
    time_within_5_m_s: float | None
    time_within_10_m_s: float | None
    duration_s: float
    min_obstacle_distance_m: float | None
    min_spacing_m: float | None
    mean_min_spacing_m: float | None
    max_spacing_m: float | None
    centre_error_m: float | None
    order_parameter: float | None
    collisions: int
    constraint_share: Shares
    effort: float
    clamps: int
    saturation_share: float
    vehicles_lost: int


class Success(TypedDict, total=False):
    """What ``follow`` alone has, see ``uuv_marl.benchmark.success``.

    None if the episode ended earlier than ``GRACE_S`` after l(t) stopped, or if no vehicle stayed healthy.
    """

    success_share: float | None
    safe_share: float | None
    done_share: float | None
    swarm_success: int | None
    vehicles_faulty: int


MEASURED = frozenset({
    "scenario", "policy", "seed", "trace", "task", *Measures.__annotations__, *Success.__annotations__,
    *(f"constraint_share_{name}" for name in Shares.__annotations__),
})  # fmt: skip
"""Names that a run has as a column or in ``results.json``, which a task's own columns can't have."""
