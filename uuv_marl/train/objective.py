"""The objective of a training as text: rewards with their terms and weights, and additional costs."""

import re

from uuv_marl.scenario import Scenario
from uuv_marl.train.training import Training


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
    """Name of a reward, and lines for its weights and terms; no lines for a function of the user."""
    if name is not None and ":" in name:
        return name, ""
    task, first = scenario.task_class, next(iter(scenario.task_class.rewards))
    formulas = task.rewards.get(name or first, task.rewards[first])
    words = {*formulas, *(word.removeprefix("w_") for word in re.findall(r"\w+", " ".join(formulas.values())))}
    used = {weight: value for weight, value in scenario.reward.model_dump().items() if weight in words}
    weights = ", ".join(f"{weight} {value:g}" for weight, value in used.items())
    lines = [f"weights w: {weights}"] * bool(weights) + [f"{term}: {formula}" for term, formula in formulas.items()]
    return f"{name or first} of task {scenario.task.name}", "".join(f"\n  {line}" for line in lines)
