"""Scenes of a recording, for the environments' renderer."""

import numpy as np

from uuv_marl.envs.drawing.scene import TRAIL_S, Scene, SonarView
from uuv_marl.errors import ReplayError
from uuv_marl.replay.recording import Recording
from uuv_marl.sim.disturbances.current import FlowField


class Scenes:
    """Scenes of a recording at any time, optionally with trails and the sonar of one inspected vehicle.

    Raises:
        ReplayError: the recording has no sonar of that vehicle.
    """

    def __init__(self, recording: Recording, sonar_of: int | None = None, *, trails: bool = True) -> None:
        self.recording = recording
        if sonar_of is not None and sonar_of not in recording.inspections:
            held = ", ".join(map(str, sorted(recording.inspections))) or "none"
            raise ReplayError(
                f"the recording holds no sonar of vehicle {sonar_of}, only of: {held}; "
                "name the vehicle when you record the episode"
            )
        self._sonar_of, self._back_s = sonar_of, np.linspace(TRAIL_S, 1.0, round(TRAIL_S)) if trails else np.zeros(0)
        self._alive = np.isfinite(recording.position[:, :, 0])
        last = np.maximum.accumulate(np.where(self._alive, np.arange(len(recording.time_s))[:, None], 0), axis=0)
        vehicles = np.arange(recording.scenario.swarm.num_vehicles)
        self._position = recording.position[last, vehicles]
        self._heading = recording.heading[last, vehicles]
        self._hits = np.array(
            [
                [*self._position[np.searchsorted(recording.time_s, time_s), list(vehicles)].mean(axis=0), time_s]
                for time_s, kind, vehicles in recording.events
                if kind in ("collision", "obstacle")
            ]
        ).reshape(-1, 3)

    def at(self, time_s: float) -> Scene:
        """The scene of the latest sample up to this time [s]."""
        recording, limits = self.recording, self.recording.scenario.constraints
        k = max(int(np.searchsorted(recording.time_s, time_s + 1e-6, side="right")) - 1, 0)
        now, alive = float(recording.time_s[k]), self._alive[k]
        past = np.unique(np.searchsorted(recording.time_s, now - self._back_s))
        series = {name: float(values[k]) for name, values in recording.series.items()}
        arrival_s = recording.metrics["task_time_s"]
        water, core_m = recording.water, recording.scenario.current.eddy_core_m
        return Scene(
            scenario=recording.scenario,
            waypoints=recording.waypoints,
            obstacles=recording.discs(k),
            groups=recording.groups,
            marks=recording.marks[k],
            time_s=now,
            references=recording.references[k],
            position=self._position[k],
            heading=self._heading[k],
            alive=alive,
            near=alive & ((recording.spacing[k] < limits.s_u_m) | (recording.clearance[k] < limits.s_o_m)),
            trail=self._position[past],
            hits=self._hits[self._hits[:, 2] <= now],
            arrival_s=arrival_s if arrival_s is not None and arrival_s <= now else None,
            collisions=round(series["collisions"]),
            min_spacing_m=float(np.nan_to_num(series["min_spacing_m"], nan=np.inf)),
            clearance_m=float(np.nan_to_num(series["obstacle_clearance_m"], nan=np.inf)),
            centre_error_m=series["centre_error_m"],
            sonar=self._sonar(k),
            water=water and FlowField(water.drift[k].astype(np.float64), water.eddies, core_m),
        )

    def _sonar(self, k: int) -> SonarView | None:
        i = self._sonar_of
        if i is None or not self._alive[k, i]:
            return None
        inspection = self.recording.inspections[i]
        return SonarView(i, inspection.neighbour[k][inspection.detected_index[k] >= 0], inspection.echo_range[k])
