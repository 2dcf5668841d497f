"""Fair tuning: the same optimiser, evaluations, seeds and objective for every controller with free gains."""

import json
import logging
import tomllib
import warnings
from collections.abc import Callable, Mapping, Sequence
from functools import partial
from pathlib import Path
from typing import Any, NamedTuple

from uuv_marl.atomic import write_text
from uuv_marl.baselines import with_policy_requirements
from uuv_marl.baselines.bug.gains import BUG_BARRIER, BugGains
from uuv_marl.baselines.comparators import apf, leader_follower, olfati_saber, orca
from uuv_marl.baselines.paper import bio_inspired, sdc, sff
from uuv_marl.baselines.safety.barrier import Barrier, with_numbers
from uuv_marl.baselines.scout import seeker
from uuv_marl.baselines.scout.gains import ScoutGains
from uuv_marl.benchmark.evaluate import Run, episodes
from uuv_marl.extras import silenced
from uuv_marl.paths import UserPath, user_path
from uuv_marl.scenario import Scenario, load_scenario

TRIALS = 300
SEEDS = (10_000, 10_001, 10_002, 10_003)
"""Seeds of the tuning range 10,000-99,999; the benchmark never uses them."""
SCENARIO = "single_obstacle"
WALLS, GAP, FEW, SILENT = "hard_water", "two_swarms", "few_informed", "silent_targets"
"""Tasks that policies are tuned for."""
MAPS = tuple(range(10_000, 10_024))
"""Tuning seeds of the other tasks, each with its own map."""
FEWER = {GAP: 4, SILENT: 8}
"""Number of these seeds for tasks with more vehicles or longer episodes."""
_FAILURE_COST_S = 1000.0
_COLLISION_COST_S = 50.0
_CLEARANCE_COST_S_PER_M = 20.0
OBJECTIVES = (
    "mean task time [s] over seeds, plus costs of collisions and of clearance below s_o",
    "mean time [s] over seeds, plus 1000 s for the share of vehicles that do not succeed",
    "mean over seeds of 1000 s times the share of the last half in which targets are not held",
)
"""Objectives of the paper's task, of tasks with goals, and of the task with targets."""


_RANGES: dict[str, dict[str, Any]] = tomllib.loads(Path(__file__).with_name("spaces.toml").read_text(encoding="utf-8"))


class Space(NamedTuple):
    """A search space, and its scenario."""

    free: dict[str, Any]
    """Ranges of the free parameters: keyword arguments of Optuna's ``suggest_float``."""
    gains: Callable[..., Any]
    """From their values to the policy's gains."""
    scenario: str = SCENARIO
    barrier: Barrier | None = None
    """Safety filter, whose parameters may be free too; None for a policy without one."""
    chosen: Mapping[str, object] = {}
    """Fixed keyword arguments of the policy."""

    def parameters(self, drawn: dict[str, float]) -> dict[str, object]:
        """The policy's keyword arguments: gains, safety filter, and others."""
        if self.barrier is None:
            return {"gains": self.gains(**drawn)}
        gains, barrier = with_numbers(drawn, self.gains(), self.barrier)
        own = {name: value for name, value in drawn.items() if name not in (*gains._fields, *barrier._fields)}
        return {"gains": gains, "barrier": barrier, **own, **self.chosen}


SPACES: dict[str, Space] = {
    "bio_inspired_plus": Space(
        _RANGES["bio_inspired"], partial(bio_inspired.BioInspiredGains, feed_forward=bio_inspired.FEED_FORWARD)
    ),
    "sff": Space(_RANGES["sff"] | _RANGES["obstacle"] | _RANGES["sff_drag"], sff.SffGains),
    "sdc": Space(_RANGES["sdc"] | _RANGES["obstacle"] | _RANGES["sdc_reference"], sdc.SdcGains),
    "apf": Space(_RANGES["apf"], apf.ApfGains),
    "olfati_saber": Space(_RANGES["olfati_saber"], olfati_saber.OlfatiSaberGains),
    "olfati_saber_informed": Space(_RANGES["olfati_saber"] | _RANGES["alignment"], olfati_saber.OlfatiSaberGains),
    "orca_informed": Space(_RANGES["orca"], orca.OrcaGains),
    "apf.two_swarms": Space(_RANGES["apf"], apf.ApfGains, GAP),
    "orca_informed.two_swarms": Space(_RANGES["orca"] | _RANGES["orca_at_a_gap"], orca.OrcaGains, GAP),
    "carrot": Space(_RANGES["carrot"] | _RANGES["filter_at_a_gap"], ScoutGains, GAP, Barrier()),
    "scout": Space(_RANGES["scout"] | _RANGES["filter"] | _RANGES["gaps"], ScoutGains, WALLS, Barrier()),
    "tangent_bug": Space(_RANGES["tangent_bug"] | _RANGES["filter"], BugGains, WALLS, BUG_BARRIER),
    "tangent_bug.two_swarms": Space(_RANGES["tangent_bug"] | _RANGES["filter"], BugGains, GAP, BUG_BARRIER),
    "nearest_target": Space(_RANGES["nearest_target"], seeker.SeekerGains, SILENT, Barrier()),
    "nearest_target.lanes": Space(_RANGES["nearest_target"], seeker.SeekerGains, SILENT, Barrier(), {"lanes": True}),
    "leader_follower": Space(
        _RANGES["leader_follower"] | _RANGES["filter"], leader_follower.LeaderFollowerGains, FEW, Barrier()
    ),
    "leader_broadcast": Space(
        _RANGES["leader_follower"] | _RANGES["filter"], leader_follower.LeaderFollowerGains, FEW, Barrier()
    ),
}
"""Search spaces of all tuned policies. ``POLICY.TASK`` are gains for a task, which ``tuned_for`` selects."""


def tuning_cost(run: Run, scenario: Scenario) -> float:
    """Cost of one seed [s]: the task time, or more than the time limit if the swarm fails.

    A collision costs more than it can save, and each metre of clearance below s_o adds to the cost. In tasks with goals
    it is the duration of the episode plus 1000 s times the share of vehicles that do not succeed; in the task with
    targets, 1000 s times the share of targets that are not held.
    """
    metrics = run.metrics
    own = metrics.get("task", {})
    if (share := own.get("held_share")) is not None:
        return _FAILURE_COST_S * (1.0 - share)
    if (share := own.get("success_share")) is not None:
        return float(run.routes.time_s[-1]) + _FAILURE_COST_S * (1.0 - share)
    time, clearance = metrics["task_time_s"], metrics["min_obstacle_distance_m"]
    if time is None:
        time = scenario.time_limit.of(metrics["duration_s"]) + (metrics["centre_error_m"] or 0.0)
    short = 0.0 if clearance is None else max(0.0, scenario.constraints.s_o_m - clearance)
    return time + _COLLISION_COST_S * metrics["collisions"] + _CLEARANCE_COST_S_PER_M * short


def search(
    output: Path,
    name: str,
    trials: int,
    objective: Callable[[Any], float | Sequence[float]],
    sampler: Callable[[int], Any],
    report: Callable[[int, float], None],
    objectives: int = 1,
    first: dict[str, Any] | None = None,
) -> Sequence[Any]:
    """Minimise with Optuna; after an interruption the same call continues with the same random numbers.

    Args:
        output: folder of the journal ``NAME.journal``, which Optuna unpickles: continue only a journal that you trust.
        name: name of the search.
        trials: number of complete trials to reach.
        objective: from a trial to its cost or costs.
        sampler: from the number of earlier trials to the sampler of the next one.
        report: called with the number of complete trials and the smallest maximum of their costs.
        objectives: number of costs.
        first: parameters of the first trial.

    Returns:
        All complete trials.
    """
    import optuna  # noqa: PLC0415 - an extra
    from optuna.storages.journal import JournalFileBackend  # noqa: PLC0415
    from optuna.trial import TrialState  # noqa: PLC0415

    with silenced("optuna", logging.WARNING):
        output.mkdir(parents=True, exist_ok=True)
        storage = optuna.storages.JournalStorage(JournalFileBackend(str(output / f"{name}.journal")))
        directions = [optuna.study.StudyDirection.MINIMIZE] * objectives
        study = optuna.create_study(storage=storage, study_name=name, directions=directions, load_if_exists=True)
        while (done := len(study.get_trials(states=(TrialState.COMPLETE,)))) < trials:
            if first and not done and not study.get_trials(states=(TrialState.WAITING,)):
                study.enqueue_trial(first)
            with warnings.catch_warnings():
                warnings.simplefilter("ignore", optuna.exceptions.ExperimentalWarning)
                study.sampler = sampler(done)
            study.optimize(objective, n_trials=1)
            report(done + 1, min(max(trial.values) for trial in study.get_trials(states=(TrialState.COMPLETE,))))
    return study.get_trials(states=(TrialState.COMPLETE,))


def tune(policy: str, output: UserPath, trials: int, report: Callable[[int, float], None]) -> Path:
    """Search a policy's parameters; after an interruption the same call continues. Needs the extra ``tune``.

    Writes ``output/POLICY.json`` with the best parameters and ``POLICY.csv`` with every trial, and keeps Optuna's
    journal beside them, which Optuna unpickles: continue only a journal that you trust.

    Args:
        policy: a name of ``SPACES``.
        output: folder of the files.
        trials: total number to reach.
        report: called with the number of trials done and the best cost [s].
    """
    import optuna  # noqa: PLC0415 - an extra

    output = user_path(output)
    space, name, policy = SPACES[policy], policy, policy.partition(".")[0]
    where, own_task = space.scenario, space.scenario != SCENARIO
    scenario = with_policy_requirements(policy, load_scenario(where))
    seeds = SEEDS if not own_task else MAPS[: FEWER.get(where, len(MAPS))]

    def objective(trial: optuna.Trial) -> float:
        drawn = {name: trial.suggest_float(name, **bounds) for name, bounds in space.free.items()}
        runs = [*episodes(scenario, policy, seeds, **space.parameters(drawn))]
        return sum(tuning_cost(run, scenario) for run in runs) / len(runs)

    def sampler(seed: int) -> optuna.samplers.BaseSampler:
        return optuna.samplers.CmaEsSampler(seed=seed, n_startup_trials=0, warn_independent_sampling=False)

    finished = search(output, name, trials, objective, sampler, report)
    best = min(finished, key=lambda trial: trial.values)
    result = {
        "policy": policy,
        "objective": OBJECTIVES[own_task + (where == SILENT)],
        "scenario": where,
        "seeds": list(seeds),
        "optimiser": f"Optuna {optuna.__version__}, CmaEsSampler, seeded by the number of trials before",
        "space": space.free,
        "best": best.params,  # in full: rounded parameters can give another run, with a collision
        "best_cost_s": round(best.values[0], 3),
    }
    path = output / f"{name}.json"
    rows = [[f"{trial.values[0]:.3f}", *(trial.params[free] for free in space.free)] for trial in finished]
    lines = [",".join(map(str, row)) for row in [["cost_s", *space.free], *rows]]
    write_text(path.with_suffix(".csv"), "\n".join(lines) + "\n")
    write_text(path, json.dumps(result, indent=1) + "\n")
    return path
