"""``Team``: a swarm in which some vehicles run another policy than the others."""

import dataclasses
from collections.abc import Mapping, Sequence

import numpy as np

from uuv_marl.baselines.policy import Policy
from uuv_marl.baselines.requirements import PolicyRequirements
from uuv_marl.baselines.team_names import TeamName
from uuv_marl.errors import PolicyError
from uuv_marl.percept import Clock, Percept, PerceptLayout
from uuv_marl.scenario import Scenario, load_scenario
from uuv_marl.types import Bool, Float32, Int64, UInt64

_LINKS = {"link", "modem"}


class Team(Policy):
    """Policies for one swarm, each of which acts for some of the vehicles.

    Each member decides for all vehicles, from the percepts that they would have if all ran it (``narrowed``); its
    actions count for its own vehicles. So the members' clamps include those in vehicles that run another.

    Args:
        scenario: of the swarm, with what all members require (``shared_scenario``).
        num_worlds: first axis of the percepts.
        team: says which vehicles run which member; shares are drawn by the episode's seed (0 without a clock).
        members: the policies, in the order of ``team.members``, each for ``member_scenario``.

    Raises:
        PolicyError: a vehicle does not exist, or has no policy.
    """

    def __init__(self, scenario: Scenario, num_worlds: int, *, team: TeamName, members: Sequence[Policy]) -> None:
        self.name, self.parts = team.name, {str(k): member for k, member in enumerate(members)}
        self.requirements = members[0].requirements._replace(outputs_force=False)
        super().__init__(scenario, num_worlds)
        self._team = team
        first = team.assigned(scenario.swarm.num_vehicles, 0)
        self._runs, self._seed = np.tile(first, (num_worlds, 1)), np.zeros(num_worlds, np.uint64)

    def running(self, member: str, clock: Clock | None) -> Bool:
        """Vehicles that run a member, by its name, in the episodes of a clock, shape (world, vehicle)."""
        return self._members(clock) == self._team.members.index(member)

    def _members(self, clock: Clock | None) -> Int64:
        """Index of the member that each vehicle runs, shape (world, vehicle)."""
        seeds: UInt64 = np.zeros_like(self._seed) if clock is None else clock.seed
        for w in np.flatnonzero(seeds != self._seed):
            self._runs[w] = self._team.assigned(self._runs.shape[1], int(seeds[w]))
            self._seed[w] = seeds[w]
        return self._runs

    def decide(self, percept: Percept) -> Float32:
        """Actions of shape (world, vehicle, ``scenario.action_size``)."""
        self.flat(percept)
        runs = self._members(percept.clock)
        action = np.zeros((*runs.shape, self.scenario.action_size), np.float32)
        for k, member in enumerate(self.parts.values()):
            member.active = self.active
            decided, own = member.act(narrowed(percept, member.layout)), runs == k
            action[own, : decided.shape[2]] = decided[own]
        self.clamps[...] = sum(member.clamps for member in self.parts.values())
        return action


def narrowed(percept: Percept, layout: PerceptLayout) -> Percept:
    """The percept with the fields of ``layout`` alone, all of which it must have."""
    if percept.layout == layout:
        return percept
    return dataclasses.replace(percept, flat=percept.flat[..., field_entries(percept.layout, layout)], layout=layout)


def field_entries(whole: PerceptLayout, part: PerceptLayout) -> Int64:
    """Entries of the flat vector ``whole`` that make up ``part``, shape (entry,)."""
    return np.concatenate([whole.starts[field.name] + np.arange(field.size) for field in part.table])


def shared_scenario(name: str, suited: Mapping[str, Scenario]) -> Scenario:
    """One scenario for a team: with the channels and messages of all members, and their common clock.

    Args:
        name: the team's.
        suited: the scenario that each member would have alone, by its name.

    Raises:
        PolicyError: decision periods, yaw dampings, messages, or the source of neighbours' velocities differ.
    """
    channels = dict.fromkeys(channel for each in suited.values() for channel in each.sonar.channels)
    modems = {member: each.modem for member, each in suited.items()}
    remedy = "set timing.fixed, timing.decision_period_s and actuators.yaw_damping_nms in the scenario, for all alike"
    _check_equal(name, "decision period [s]", {m: s.timing.decision_period_s for m, s in suited.items()}, remedy)
    _check_equal(name, "yaw damping [N m s]", {m: s.actuators.yaw_damping_nms for m, s in suited.items()}, remedy)
    sizes = {m: (modem.message_entries, modem.message_vectors) for m, modem in modems.items() if modem.message_entries}
    _check_equal(name, "number of entries and vectors in a message", sizes, "choose members that agree")
    if channels.keys() >= _LINKS and any(len(_LINKS & {*s.sonar.channels}) == 1 for s in suited.values()):
        raise PolicyError(f"team {name!r}: one member reads the link, another the modem; choose members that agree")
    first, fixed = next(iter(suited.values())), any(each.timing.fixed for each in suited.values())
    changes = _fields([*channels], *next(iter(sizes.values()), (0, 0))) | {"timing.fixed": fixed}
    return load_scenario(first, overrides=changes)


def member_scenario(required: PolicyRequirements, shared: Scenario) -> Scenario:
    """A team's scenario without the channels and messages that a member with these requirements does not use."""
    used = {*required.channels, *(_LINKS if "link" in required.channels else ())}
    modem = shared.modem
    sizes = (modem.message_entries, modem.message_vectors) if required.message_entries else (0, 0)
    channels = [channel for channel in shared.sonar.channels if channel in used]
    return load_scenario(shared, overrides=_fields(channels, *sizes))


def _fields(channels: list[str], entries: int, vectors: int) -> dict[str, object]:
    return {"sonar.channels": channels, "modem.message_entries": entries, "modem.message_vectors": vectors}


def _check_equal(name: str, what: str, values: Mapping[str, object], remedy: str) -> None:
    """Raise PolicyError unless all members have the same value."""
    if len({*values.values()}) > 1:
        each = ", ".join(f"{member} {value}" for member, value in values.items())
        raise PolicyError(f"team {name!r}: all members need the same {what}, got {each}; {remedy}")
