"""What a step spends its time on: its parts, one after the other over many worlds, on one thread.

A part that needs another's result repeats that too; perf/report.py takes the difference.
"""

from typing import Any

import numba
import numpy as np
from worker import Case, Maker

from uuv_marl import load_scenario
from uuv_marl.sim import arrays, hearing, motion, world
from uuv_marl.sim.swarm import Swarm


@numba.njit(error_model="numpy", _nrt=False)
def moved(num: int, action: Any, state: Any, course: Any, facts: Any, senses: Any, fixed: Any, desk: Any) -> None:
    """Actions, forces, Runge-Kutta, heading."""
    plant, rules, _, _ = fixed
    for w in range(num):
        motion.load(w, state.eta, state.nu, desk[0])
        motion.aim(w, action, desk[0])
        world.hold(w, True, state, facts, plant, rules, desk[0])


@numba.njit(error_model="numpy", _nrt=False)
def sorted_(num: int, action: Any, state: Any, course: Any, facts: Any, senses: Any, fixed: Any, desk: Any) -> None:
    """The living in the order of cells."""
    for w in range(num):
        motion.load(w, state.eta, state.nu, desk[0])
        world.arrange(w, state, fixed[1], desk[0], desk[1])


@numba.njit(error_model="numpy", _nrt=False)
def measured(num: int, action: Any, state: Any, course: Any, facts: Any, senses: Any, fixed: Any, desk: Any) -> None:
    """Cells, then spacing, clearance, contacts, extent."""
    for w in range(num):
        motion.load(w, state.eta, state.nu, desk[0])
        grid = world.arrange(w, state, fixed[1], desk[0], desk[1])
        world.measure(w, state, course, facts, fixed[1], desk[1], grid)


@numba.njit(error_model="numpy", _nrt=False)
def heard(num: int, action: Any, state: Any, course: Any, facts: Any, senses: Any, fixed: Any, desk: Any) -> None:
    """Cells, then the nearest vehicle of every sub-sector."""
    for w in range(num):
        motion.load(w, state.eta, state.nu, desk[0])
        grid = world.arrange(w, state, fixed[1], desk[0], desk[1])
        for p in range(grid.living):
            hearing.hear(p, w, course.obstacles, course.num_obstacles[w], desk[1], grid, fixed[2], desk[2])


@numba.njit(error_model="numpy", _nrt=False)
def perceived(num: int, action: Any, state: Any, course: Any, facts: Any, senses: Any, fixed: Any, desk: Any) -> None:
    """Cells, hearing, echoes, percepts."""
    for w in range(num):
        motion.load(w, state.eta, state.nu, desk[0])
        grid = world.arrange(w, state, fixed[1], desk[0], desk[1])
        world.perceive(w, state, course, facts, fixed[2], fixed[3], senses, desk[0], desk[1], grid, desk[2])


@numba.njit(error_model="numpy", _nrt=False)
def stepped(num: int, action: Any, state: Any, course: Any, facts: Any, senses: Any, fixed: Any, desk: Any) -> None:
    """The whole step."""
    plant, rules, suite, at = fixed
    for w in range(num):
        world.step_world(w, action, state, course, facts, senses, plant, rules, suite, at, desk[0], desk[1], desk[2])


PARTS = {"part_moved": moved, "part_sorted": sorted_, "part_measured": measured, "part_heard": heard}
PARTS |= {"part_perceived": perceived, "part_stepped": stepped}


def part(name: str) -> Maker:
    """A part of ``Swarm.step`` of idle vehicles on ``single_obstacle``; a unit is all worlds once."""

    def made(agents: int, worlds: int) -> Case:
        swarm: Any = Swarm(load_scenario("single_obstacle", num_vehicles=agents), worlds)
        swarm.reset(0)
        action = np.zeros((worlds, agents, 2), np.float32)
        fixed = swarm._plant, swarm._rules, swarm._suite, swarm.layout.offsets
        desk = arrays.desk.py_func(swarm._scratch, 0)  # type: ignore[attr-defined]
        given = worlds, action, swarm.state, swarm.course, swarm.facts, swarm._senses, fixed, desk

        def run(units: int) -> None:
            for _ in range(units):
                PARTS[name](*given)

        return Case(run, agents * worlds)

    return made
