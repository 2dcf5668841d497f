"""What Python calls of the compiled simulation: one world or a batch, calm or disturbed.

Numba compiles ``uuv_marl.sim.world`` once without a sea and once with one, so that calm worlds hold nothing of it.
"""

import numba
import numpy as np
from numpy.typing import NDArray

from uuv_marl.sim.arrays import Course, Facts, Senses, State, World
from uuv_marl.sim.compiled import compiled, compiled_inner, compiled_parallel
from uuv_marl.sim.model import Model, Rules
from uuv_marl.sim.sea.actuation import Actuation, Hull
from uuv_marl.sim.sea.current import Flow, Water
from uuv_marl.sim.sea.modem import Mail, Modem
from uuv_marl.sim.sea.navigation import Navigation, Track
from uuv_marl.sim.sea.noise import Ears, Noise
from uuv_marl.sim.sea.readings import Hits, Readings
from uuv_marl.sim.sea.schedule import Listening
from uuv_marl.sim.sea.sea import Sea
from uuv_marl.sim.sonar import Suite
from uuv_marl.sim.vehicle import Plant
from uuv_marl.sim.views import Starts
from uuv_marl.sim.workspace import Scratch, workspace
from uuv_marl.sim.world import observe_world, step_world

Float32 = NDArray[np.float32]
Bool = NDArray[np.bool_]
UInt64 = NDArray[np.uint64]


@compiled
def observe(w: int, world: World, model: Model, room: Scratch) -> None:
    """Facts and percepts of a world that has just been reset.

    Args:
        w: index of the world.
        world: the arrays; facts, senses and ``state.dwell`` are written.
        model: the scenario's numbers.
        room: to work in; the first thread's is used.
    """
    observe_world(w, world, model, workspace(room, 0), None)


@compiled
def observe_at_sea(w: int, world: World, model: Model, room: Scratch, sea: Sea) -> None:
    """Facts and percepts of a disturbed world that has just been reset.

    Args:
        w: index of the world.
        world: the arrays; facts, senses and ``state.dwell`` are written.
        model: the scenario's numbers.
        room: to work in; the first thread's is used.
        sea: what disturbs it.
    """
    observe_world(w, world, model, workspace(room, 0), sea)


@compiled
def step_alone(action: Float32, world: World, model: Model, room: Scratch) -> bool:
    """One decision period of the only world; whether it has diverged.

    Args:
        action: shares of full force, body frame, shape (1, vehicle, 2).
        world: the arrays.
        model: the scenario's numbers.
        room: to work in; the first thread's is used.
    """
    step_world(0, action, world, model, workspace(room, 0), None)
    return world.facts.diverged[0] >= 0


@compiled
def step_alone_at_sea(action: Float32, world: World, model: Model, room: Scratch, sea: Sea) -> bool:
    """One decision period of the only world, disturbed; whether it has diverged.

    Args:
        action: shares of full force, body frame, shape (1, vehicle, 2).
        world: the arrays.
        model: the scenario's numbers.
        room: to work in; the first thread's is used.
        sea: what disturbs it.
    """
    step_world(0, action, world, model, workspace(room, 0), sea)
    return world.facts.diverged[0] >= 0


@compiled_parallel
def step_worlds(
    threads: int, active: Bool, action: Float32, state: State, course: Course, facts: Facts, senses: Senses,
    plant: Plant, suite: Suite, rules: Rules, at: Starts, room: Scratch,
) -> bool:  # fmt: skip
    """One decision period of every active world, a run of worlds for each thread; whether any has diverged.

    World and model come in parts, since Numba hands no tuples of tuples to threads.

    Args:
        threads: how many work at once.
        active: worlds to step, shape (world,); the others stay as they are.
        action: shares of full force, body frame, shape (world, vehicle, 2).
        state: what a step changes.
        course: trajectories, obstacles and losses.
        facts: what is true of the step, which is written.
        senses: what is heard and known, which is written.
        plant: the scenario's vehicle.
        suite: the scenario's sonar.
        rules: the scenario's clocks and thresholds.
        at: where each field starts in a flat percept.
        room: to work in, a part for each thread.
    """
    share = (action.shape[0] + threads - 1) // threads
    for t in numba.prange(threads):
        own, world, model = workspace(room, t), World(state, course, facts, senses), Model(plant, suite, rules, at)
        for w in range(t * share, min((t + 1) * share, action.shape[0])):
            if active[w]:
                step_world(w, action, world, model, own, None)
    return any_diverged(facts)


@compiled_parallel
def step_worlds_at_sea(
    threads: int, active: Bool, action: Float32, state: State, course: Course, facts: Facts, senses: Senses,
    plant: Plant, suite: Suite, rules: Rules, at: Starts, room: Scratch, keys: UInt64,
    water: Water, flow: Flow, actuation: Actuation, hull: Hull, listening: Listening, readings: Readings,
    hits: Hits, noise: Noise, ears: Ears, navigation: Navigation, track: Track, modem: Modem, mail: Mail,
) -> bool:  # fmt: skip
    """One decision period of every active disturbed world, a run of worlds for each thread; whether any has diverged.

    World, model and sea come in parts, since Numba hands no tuples of tuples to threads.

    The arguments up to ``room`` are those of ``step_worlds``; then come the parts of ``Sea``, in its order.
    """
    share = (action.shape[0] + threads - 1) // threads
    for t in numba.prange(threads):
        own, world, model = workspace(room, t), World(state, course, facts, senses), Model(plant, suite, rules, at)
        sea = Sea(
            keys, water, flow, actuation, hull, listening, readings, hits, noise, ears, navigation, track, modem, mail
        )
        for w in range(t * share, min((t + 1) * share, action.shape[0])):
            if active[w]:
                step_world(w, action, world, model, own, sea)
    return any_diverged(facts)


@compiled_inner
def any_diverged(facts: Facts) -> bool:
    """Whether any world has diverged."""
    diverged = False
    for w in range(facts.diverged.shape[0]):
        diverged = diverged or facts.diverged[w] >= 0
    return diverged
