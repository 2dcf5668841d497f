"""The objective of a training as text: rewards with their terms and weights, and additional costs."""

import re
from collections.abc import Mapping

from uuv_marl.scenario import Scenario
from uuv_marl.train.training import Training

_WEIGHT = re.compile(r"\bw_(\w+)|\bw\b|\b(progress(?:_far)?_m)\b")
"""Numbers of the scenario's table ``reward`` in a term's formula."""


def objective(training: Training) -> str:
    """The objective; a reward that several scenarios share appears once."""
    scenarios_of: dict[tuple[str, str], dict[str, None]] = {}
    for part in training.parts:
        scenarios_of.setdefault(_reward(training.reward, part.scenario), {})[part.name] = None
    lines = [f"Reward {name} on {', '.join(scenarios)}{terms}" for (name, terms), scenarios in scenarios_of.items()]
    ppo, expert, weight = training.ppo, training.expert, training.imitation_weight
    start, end = ppo.collision_cost or (0.0, 0.0)
    cost = f"a collision costs {start:g} at the start and {end:g} at the end (ppo.collision_cost)"
    added = f"In addition {cost}" if start or end else "Nothing is added to the reward"
    lines.append(f"{added}; discount {ppo.gamma:g} a decision.")
    if expert:
        lines.append(f"For {training.imitation_share:.0%} of the budget the network first imitates {expert}.")
    if weight:
        lines.append(f"Then {weight:g} times the mean squared distance from its actions is added to PPO's loss.")
    return "\n".join(lines)


def _reward(name: str | None, scenario: Scenario) -> tuple[str, str]:
    """Name of a reward, and a line for each of its terms; no lines for a function of the user."""
    if name is not None and ":" in name:
        return name, ""
    task, weights = scenario.task_class, scenario.reward.model_dump()
    first = next(iter(task.rewards))
    formulas = task.rewards.get(name or first, task.rewards[first])
    terms = [f"\n  {term}: {_with_numbers(term, formula, weights)}" for term, formula in formulas.items()]
    return f"{name or first} of task {scenario.task.name}", "".join(terms) or ": none"


def _with_numbers(term: str, formula: str, weights: Mapping[str, float]) -> str:
    """A formula with the values of its weights instead of their names."""

    def number(found: re.Match[str]) -> str:
        value = weights.get(found[1] or found[2] or term)
        return found[0] if value is None else f"{value:g}{' m' * bool(found[2])}"

    return _WEIGHT.sub(number, formula)
