"""What a step spends its time on: its parts, one after the other over many worlds, on one thread.

A part that needs another's result repeats that too; perf/report.py takes the difference.
"""

from typing import Any, cast
from unittest.mock import patch

import numba
import numpy as np
from worker import Case, Maker, repeated, serve

from uuv_marl import load_scenario
from uuv_marl.sim import engine, hearing, motion, swarm, world
from uuv_marl.sim.arrays import World
from uuv_marl.sim.model import Model
from uuv_marl.sim.workspace import workspace

PARTS = {
    "part_moved": (True, False, False, False, False),
    "part_sorted": (False, True, False, False, False),
    "part_measured": (False, True, True, False, False),
    "part_heard": (False, True, False, True, False),
    "part_perceived": (False, True, False, False, True),
}
"""Actions, forces, Runge-Kutta; the living in the order of cells; spacing, clearance, contacts; the nearest vehicle of
every sub-sector; hearing, echoes, percepts."""


_njit: Any = numba.njit
compiled = _njit(error_model="numpy", _nrt=False)  # as the package compiles


def loop(move: bool, sort: bool, measure: bool, hear: bool, perceive: bool) -> Any:
    """These parts of ``world.step_world``, compiled, over many worlds."""

    @compiled
    def run(num, action, water, model, workspace):
        for w in range(num):
            motion.load(w, water.state, workspace.now)
            if move:
                motion.load_action(w, action, workspace.now)
                world.control_hold(w, True, water, model, workspace.now, None)
            if sort:
                grid = world.sort_into_cells(w, water, model, workspace)
                if measure:
                    world.measure(w, water, model, workspace, grid)
                if hear:
                    for p in range(grid.living):
                        hearing.hear(p, w, water.course, model.suite, workspace, grid)
                if perceive:
                    world.perceive(w, water, model, workspace, grid)

    return run


@compiled
def stepped(num, action, water, model, workspace):
    """The whole step."""
    for w in range(num):
        world.step_world(w, action, water, model, workspace, None)


def part(name: str) -> Maker:
    """A part of ``Swarm.step`` of idle vehicles on ``single_obstacle``; a unit is all worlds once."""

    def made(agents: int, worlds: int) -> Case:
        water = swarm.Swarm(load_scenario("single_obstacle", num_vehicles=agents), worlds)
        water.reset(0)
        with patch.object(engine, "step_worlds") as step_worlds:  # what a step gives to compiled code
            water.step(np.zeros((worlds, agents, 2), np.float32))
        _, _, action, *parts, scratch = step_worlds.call_args.args
        given = action, World(*parts[:4]), Model(*parts[4:])
        own = cast(Any, workspace).py_func(scratch, 0)
        kernel = loop(*PARTS[name]) if name in PARTS else stepped
        case = repeated(lambda _: kernel(worlds, *given, own), agents * worlds)
        case.run(1)
        return case

    return made


CASES = {name: part(name) for name in (*PARTS, "part_stepped")}

if __name__ == "__main__":
    serve(CASES)
