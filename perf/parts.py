"""What a step spends its time on: its parts, one after the other over many worlds, on one thread.

A part that needs another's result repeats that too; perf/report.py takes the difference.
"""

from typing import Any
from unittest.mock import patch

import numba
import numpy as np
from worker import Case, Maker, repeated, serve

from uuv_marl import load_scenario
from uuv_marl.sim import arrays, hearing, motion, swarm, world

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
    def run(num, action, state, course, facts, senses, plant, rules, suite, at, desk):
        for w in range(num):
            motion.load(w, state.eta, state.nu, desk[0])
            if move:
                motion.aim(w, action, desk[0])
                world.hold(w, True, state, facts, plant, rules, desk[0])
            if sort:
                grid = world.arrange(w, state, rules, desk[0], desk[1])
                if measure:
                    world.measure(w, state, course, facts, rules, desk[1], grid)
                if hear:
                    for p in range(grid.living):
                        hearing.hear(p, w, course.obstacles, course.num_obstacles[w], desk[1], grid, suite, desk[2])
                if perceive:
                    world.perceive(w, state, course, facts, suite, at, senses, desk[0], desk[1], grid, desk[2])

    return run


@compiled
def stepped(num, action, state, course, facts, senses, plant, rules, suite, at, desk):
    """The whole step."""
    for w in range(num):
        world.step_world(w, action, state, course, facts, senses, plant, rules, suite, at, desk[0], desk[1], desk[2])


def part(name: str) -> Maker:
    """A part of ``Swarm.step`` of idle vehicles on ``single_obstacle``; a unit is all worlds once."""

    def made(agents: int, worlds: int) -> Case:
        water = swarm.Swarm(load_scenario("single_obstacle", num_vehicles=agents), worlds)
        water.reset(0)
        with patch.object(swarm, "step_worlds") as step_worlds:  # what a step gives to compiled code
            water.step(np.zeros((worlds, agents, 2), np.float32))
        *given, scratch = step_worlds.call_args.args[2:]
        python: Any = arrays.desk
        desk = python.py_func(scratch, 0)
        kernel = loop(*PARTS[name]) if name in PARTS else stepped
        case = repeated(lambda _: kernel(worlds, *given, desk), agents * worlds)
        case.run(1)
        return case

    return made


CASES = {name: part(name) for name in (*PARTS, "part_stepped")}

if __name__ == "__main__":
    serve(CASES)
