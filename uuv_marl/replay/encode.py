"""A recording as compact JSON with stated resolutions, which ``decode.js`` decodes in the browser.

Arrays become integers, integers become differences from a prediction, and deflate compresses the differences, of which
most are zero. Motion is smooth, so an array is encoded from coarse to fine: every ``stride``-th sample by its second
differences, then repeatedly the samples halfway between by their difference from a cubic through the four around them.
Series and the map are exact: they keep all bits of their float32.
"""

import math
from collections.abc import Sequence
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from uuv_marl import __version__
from uuv_marl.envs.drawing.camera import shown_speed
from uuv_marl.replay.html import deflated
from uuv_marl.replay.recording import Recording
from uuv_marl.scenario import conditions, growth
from uuv_marl.types import Bool, Float32, Float64, Int32, Int64

SCHEMA = 1


class Coding(NamedTuple):
    """Conversion of an array to integers."""

    unit: float
    """Value of the integer 1."""
    slack: float = 0.5
    """Largest error in units between every ``stride``-th sample, where it is half a unit."""
    stride: int = 16
    """Coarsest step of an array that is smooth in time, a power of two; 1 for one that is not."""
    order: int = 2
    """Order of the differences of every ``stride``-th sample."""

    @property
    def resolution(self) -> float:
        """Largest error of a decoded value, except for the last bit of a float32."""
        return self.unit * max(self.slack, 0.5)


_TURN = 2 * math.pi
CODINGS = {
    "reference": Coding(0.03),
    "position": Coding(0.03, 2),
    "heading": Coding(_TURN / 64, 2),
    "speed": Coding(0.1, 4),
    "force": Coding(0.05, 4),
    "spacing": Coding(0.25, 2),
    "inspected_heading": Coding(_TURN / 1024),
    "neighbour": Coding(0.25, stride=1, order=1),
    "echo_range": Coding(0.25, stride=1, order=1),
    "echo_position": Coding(0.25, stride=1, order=1),
    "action": Coding(0.02, stride=1, order=1),
    "drift": Coding(0.01),
    "traffic": Coding(0.03, 2),
}
"""Units are m, rad, m/s and shares of full force. A hull is 2 m wide, and a pixel of a map about 1 m; the sonar of
inspected vehicles uses a finer heading."""


def payload(recordings: Sequence[Recording]) -> dict[str, Any]:
    """Episodes as plain values for a page; ``decode.js`` decodes their ``arrays``."""
    return {"schema": SCHEMA, "uuv_marl": __version__, "episodes": [_episode(recording) for recording in recordings]}


def _episode(recording: Recording) -> dict[str, Any]:
    scenario, groups = recording.scenario, recording.groups
    arrival, limits, current = scenario.arrival, scenario.constraints, scenario.current
    return {
        "scenario": scenario.name,
        "version": scenario.version,
        "policy": recording.policy,
        "seed": recording.seed,
        "vehicles": scenario.swarm.num_vehicles,
        "period_s": scenario.timing.decision_period_s,
        "metrics": recording.metrics,
        "constraints": limits.model_dump(),
        "hull_radius_m": scenario.collision.hull_radius_m,
        "arrival": {
            "radius_m": arrival.radius_m,
            "spread_m": arrival.spread_m * growth(scenario.swarm.num_vehicles),
            "dwell_s": arrival.dwell_s,
        },
        "conditions": conditions(scenario),
        "current": recording.water and {"core_m": current.eddy_core_m, "shown_mps": shown_speed(scenario)},
        "paths": [{"team": team, "corners": path.round(2).ravel().tolist()} for team, path in groups.paths.values()],
        "team": groups.team.tolist(),
        "uninformed": np.flatnonzero(~groups.informed).tolist(),
        "sonar": [
            {
                "name": array.name,
                "axis_rad": math.radians(array.mounting_deg),
                "aperture_rad": math.radians(array.aperture_deg),
                "range_m": array.range_m,
                "active": array.kind == "active",
                "bounds_rad": array.bounds_rad.tolist(),
            }
            for array in scenario.sonar.arrays
        ],
        "events": [event._asdict() for event in recording.events],
        "inspected": list(recording.inspections),
        "arrays": _arrays(recording),
    }


def _arrays(recording: Recording) -> dict[str, Any]:
    smooth = {
        "reference": np.concatenate([recording.references[:, g] for g in recording.groups.paths], axis=1),
        "position": recording.position,
        "heading": unwrapped(recording.heading),
        "speed": recording.speed,
        "force": recording.force,
        "spacing": recording.spacing,
        "traffic": recording.traffic,
    }
    exact = {
        **recording.series,
        "waypoints": recording.waypoints,
        "obstacles": recording.obstacles,
        "marks": recording.marks,
    }
    if recording.water is not None:
        smooth["drift"], exact["eddies"] = recording.water.drift, recording.water.eddies.astype(np.float32)
    arrays = {"time_s": _coded(recording.time_s, Coding(recording.scenario.timing.control_step_s, stride=1))}
    arrays |= {name: _exact(values, 2) for name, values in exact.items()}
    if sonars := list(recording.inspections.values()):
        arrays["detected_index"] = _exact(np.stack([sonar.detected_index for sonar in sonars], axis=1), 1)
        smooth["inspected_heading"] = unwrapped(recording.heading[:, list(recording.inspections)])
        for name in ("neighbour", "echo_range", "echo_position", "action"):
            smooth[name] = np.stack([getattr(sonar, name) for sonar in sonars], axis=1)
    return arrays | {name: _coded(values, CODINGS[name]) for name, values in smooth.items() if values is not None}


def unwrapped(heading: Float32) -> Float32:
    """Headings without jumps by a full turn, for interpolation, shape (time, vehicle)."""
    step = np.diff(heading, axis=0, prepend=heading[:1])
    turns = np.cumsum(np.nan_to_num(np.rint(step / _TURN)), axis=0)
    return (heading - _TURN * turns).astype(np.float32)


def _coded(values: Float32, coding: Coding) -> dict[str, Any]:
    """An array in units of a coding, NaN for missing values."""
    missing = np.isnan(values)
    scaled = _filled(values.astype(np.float64), missing) / coding.unit
    whole = np.rint(scaled).astype(np.int32)
    data = _smooth(scaled, coding) if coding.stride > 1 else _differences(whole, coding.order)
    mask = pack(_differences(missing.astype(np.int32), 1)) if missing.any() else None
    return _entry(values, data, coding.unit, coding.stride, coding.order, mask)


def _exact(values: NDArray[Any], order: int) -> dict[str, Any]:
    """An array of 32 bits with all of them, by differences of this order."""
    return _entry(values, _differences(values.view(np.int32), order), order=order)


def _entry(
    values: NDArray[Any], data: Int32, scale: float | None = None, stride: int = 1, order: int = 2,
    missing: str | None = None,
) -> dict[str, Any]:  # fmt: skip
    """An array for ``decode.js``: ``data`` are differences of integers in units of ``scale``."""
    return {
        "shape": list(values.shape), "dtype": str(values.dtype), "scale": scale, "stride": stride, "order": order,
        "missing": missing, "data": pack(data),
    }  # fmt: skip


def _filled(values: Float64, missing: Bool) -> Float64:
    """The values, with the previous value in place of each missing one, or zero without one."""
    if not missing.any():
        return values
    time = np.arange(len(values)).reshape(-1, *[1] * (values.ndim - 1))
    last = np.maximum.accumulate(np.where(missing, -1, time), axis=0)
    return np.where(last >= 0, np.take_along_axis(values, np.maximum(last, 0), axis=0), 0.0)


def _differences(values: Int32, order: int) -> Int32:
    """Differences in time of this order, modulo 2^32, sorted by vehicle, then by time; shape (value,)."""
    for _ in range(order):
        values = np.diff(values, axis=0, prepend=np.zeros_like(values[:1]))
    return np.moveaxis(values, 0, -1).ravel()


def _smooth(scaled: Float64, coding: Coding) -> Int32:
    """Differences from coarse to fine, each level sorted by vehicle, then by time."""
    whole = np.zeros(scaled.shape, np.int32)
    whole[:: coding.stride] = np.rint(scaled[:: coding.stride])
    levels = [_differences(whole[:: coding.stride], coding.order)]
    half = coding.stride // 2
    while half:
        now = np.arange(half, len(whole), 2 * half)
        guess = _between(whole, now, half)
        whole[now] = np.where(np.abs(guess - scaled[now]) <= coding.slack, guess, np.rint(scaled[now]))
        levels.append(_differences(whole[now] - guess, 0))
        half //= 2
    return np.concatenate(levels)


def _between(whole: Int32, now: Int64, half: int) -> Int32:
    """Prediction of samples ``now`` from those ``half`` and three times as far before and after; as ``whole[now]``."""
    after = np.where(now + half < len(whole), now + half, now - half)
    guess = (whole[now - half] + whole[after]) >> 1
    inner = (now >= 3 * half) & (now + 3 * half < len(whole))
    t = now[inner]
    near, far = whole[t - half] + whole[t + half], whole[t - 3 * half] + whole[t + 3 * half]
    guess[inner] = (9 * near - far + 8) >> 4
    return guess


def pack(values: Int32) -> str:
    """Integers as text: compressed, in base64.

    Small numbers of either sign become small unsigned ones, stored as planes of bytes, the lowest bytes first.
    """
    unsigned = ((values << 1) ^ (values >> 31)).view(np.uint32)
    planes = max(1, math.ceil(int(unsigned.max(initial=0)).bit_length() / 8))
    rows = unsigned.astype("<u4").view(np.uint8).reshape(-1, 4).T[:planes]
    return deflated(rows.tobytes())
