"""A recording as compact JSON with stated resolutions, which ``decode.js`` decodes in the browser.

Arrays become integers, integers become differences from the sample before, and deflate compresses the differences, of
which most are small. Series and the map are exact: they keep all bits of their float32.
"""

import math
from collections.abc import Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from uuv_marl import __version__
from uuv_marl.envs.drawing.camera import shown_speed
from uuv_marl.replay.html import deflated
from uuv_marl.replay.recording import Recording
from uuv_marl.scenario import conditions, growth
from uuv_marl.types import Float32, Int32

SCHEMA = 2
_MISSING = -(2**31)
"""The integer that stands for NaN."""
_TURN = 2 * math.pi
UNITS = {
    "reference": 0.03,
    "position": 0.12,
    "heading": _TURN / 64,
    "speed": 0.2,
    "force": 0.2,
    "spacing": 0.5,
    "sending": 1.0,
    "inspected_heading": _TURN / 1024,
    "neighbour": 0.25,
    "echo_range": 0.25,
    "echo_position": 0.25,
    "action": 0.02,
    "drift": 0.01,
    "traffic": 0.12,
}
"""Resolutions [m, rad, m/s, shares of full force]. A hull is 2 m wide, and a pixel of a map about 1 m; the sonar of
inspected vehicles uses a finer heading."""


def payload(recordings: Sequence[Recording]) -> dict[str, Any]:
    """Episodes as plain values for a page; ``decode.js`` decodes their ``arrays``."""
    return {"schema": SCHEMA, "uuv_marl": __version__, "episodes": [_episode(recording) for recording in recordings]}


def _episode(recording: Recording) -> dict[str, Any]:
    scenario, water, groups = recording.scenario, recording.scenes[0].water, recording.scenes[0].groups
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
        "current": None if water is None else {"core_m": current.eddy_core_m, "shown_mps": shown_speed(scenario)},
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
    scenes, groups = recording.scenes, recording.scenes[0].groups
    discs = np.array([scene.obstacles for scene in scenes], np.float32)
    most = max(len(scene.marks) for scene in scenes)
    marks = [np.pad(scene.marks, ((0, most - len(scene.marks)), (0, 0))) for scene in scenes]
    references = np.array([scene.references for scene in scenes], np.float32)[:, list(groups.paths)]
    rounded = {
        "reference": references.reshape(len(scenes), -1),
        "position": recording.position,
        "heading": unwrapped(recording.heading),
        "speed": recording.speed,
        "force": recording.force,
        "spacing": recording.spacing,
    }
    if recording.scenario.modem.message_entries:
        rounded["sending"] = np.array([scene.sending for scene in scenes], np.float32)
    exact = {**recording.series, "obstacles": discs[-1], "marks": np.array(marks, np.float32)}
    if np.ptp(discs, axis=0).any():
        rounded["traffic"] = discs[:, :, :2]
    if (water := scenes[0].water) is not None:
        exact["eddies"] = water.eddies.astype(np.float32)
        rounded["drift"] = np.array([scene.water.drift for scene in scenes if scene.water], np.float32)
    if sonars := list(recording.inspections.values()):
        exact["detected_index"] = np.stack([sonar.detected_index for sonar in sonars], axis=1)
        rounded["inspected_heading"] = unwrapped(recording.heading[:, list(recording.inspections)])
        for name in ("neighbour", "echo_range", "echo_position", "action"):
            rounded[name] = np.stack([getattr(sonar, name) for sonar in sonars], axis=1)
    return {
        "time_s": _coded(recording.time_s, recording.scenario.timing.control_step_s),
        **{name: _coded(values) for name, values in exact.items()},
        **{name: _coded(values, UNITS[name]) for name, values in rounded.items()},
    }


def unwrapped(heading: Float32) -> Float32:
    """Headings without jumps by a full turn, for interpolation, shape (time, vehicle)."""
    step = np.diff(heading, axis=0, prepend=heading[:1])
    turns = np.cumsum(np.nan_to_num(np.rint(step / _TURN)), axis=0)
    return (heading - _TURN * turns).astype(np.float32)


def _coded(values: NDArray[Any], unit: float | None = None) -> dict[str, Any]:
    """An array for ``decode.js``, in integers of this unit, or without one by all its 32 bits."""
    if unit is None:
        whole = values.view(np.int32)
    else:
        whole = np.where(np.isnan(values), _MISSING, np.rint(np.nan_to_num(values) / unit)).astype(np.int32)
    steps = np.diff(whole, axis=0, prepend=np.zeros_like(whole[:1]))
    data = pack(np.moveaxis(steps, 0, -1).ravel())
    return {"shape": list(values.shape), "dtype": str(values.dtype), "unit": unit, "data": data}


def pack(values: Int32) -> str:
    """Integers as text: compressed, in base64.

    Small numbers of either sign become small unsigned ones, stored as planes of bytes, the lowest bytes first.
    """
    unsigned = ((values << 1) ^ (values >> 31)).view(np.uint32)
    planes = max(1, math.ceil(int(unsigned.max(initial=0)).bit_length() / 8))
    rows = unsigned.astype("<u4").view(np.uint8).reshape(-1, 4).T[:planes]
    return deflated(rows.tobytes())
