"""What a training optimises, in words: each reward with its terms and weights, and all that is added."""

import re
from collections.abc import Mapping

from uuv_marl.scenario import Scenario
from uuv_marl.train.training import Training

_WEIGHT = re.compile(r"\bw_(\w+)|\bw\b|\b(progress(?:_far)?_m)\b")
"""Where a term's formula names a number of the scenario's table ``reward``."""


def objective(training: Training) -> str:
    """The whole objective, a reward that several scenarios share once."""
    scenarios_of: dict[tuple[str, str], dict[str, None]] = {}
    for part in training.parts:
        scenarios_of.setdefault(_reward(training.reward, part.scenario), {})[part.name] = None
    lines = [f"Reward {name} on {', '.join(scenarios)}{terms}" for (name, terms), scenarios in scenarios_of.items()]
    ppo, expert, weight = training.ppo, training.expert, training.imitation_weight
    start, end = ppo.collision_cost or (0.0, 0.0)
    cost = f"a contact that begins costs {start:g} at the start and {end:g} at the end (ppo.collision_cost)"
    added = f"In addition {cost}" if start or end else "Nothing is added to the reward"
    lines.append(f"{added}; discount {ppo.gamma:g} a decision.")
    if expert:
        lines.append(
            f"For {training.imitation_share:.0%} of the budget the network first imitates {expert}, whatever is paid."
        )
    if weight:
        lines.append(f"Then {weight:g} times the mean squared distance from what it would do is added to PPO's loss.")
    return "\n".join(lines)


def _reward(name: str | None, scenario: Scenario) -> tuple[str, str]:
    """A reward, and a line for each of the task's terms, of which it is made where it is not a function."""
    if name is not None and ":" in name:
        return name, ""
    task, weights = scenario.task_class, scenario.reward.model_dump()
    first = next(iter(task.rewards))
    formulas = task.rewards.get(name or first, task.rewards[first])
    terms = [f"\n  {term}: {_with_numbers(term, formula, weights)}" for term, formula in formulas.items()]
    return f"{name or first} of task {scenario.task.name}", "".join(terms) or ": nothing is paid"


def _with_numbers(term: str, formula: str, weights: Mapping[str, float]) -> str:
    """A formula with the numbers of its weights in place of their names."""

    def number(found: re.Match[str]) -> str:
        value = weights.get(found[1] or found[2] or term)
        return found[0] if value is None else f"{value:g}{' m' * bool(found[2])}"

    return _WEIGHT.sub(number, formula)
