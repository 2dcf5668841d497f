"""Policies: percepts in, actions out. ``make_policy(name, scenario_or_env)`` makes one; ``POLICIES`` lists them.

Arguments of compiled functions have the same names everywhere, beside those of ``uuv_marl.sim``:

==========================  =========================================================================================
``flat``, ``at``            Percepts in physical units, shape (world, vehicle, entry), and the start of each field.
``a``, ``d``                Index of an active sub-sector with an echo; of a remembered disc.
``axis``                    0 thrust, 1 torque.
``g``, ``limits``           Gains of the controller; actuator limits and surge resistance.
``barrier``                 Margins and rates of the safety filter.
``centres``                 True if echoes report centres, False if they report points of surfaces.
``action``                  Filled with shares of full force, body frame, shape (world, vehicle, 2).
``clamps``                  Active numerical bounds, counted per world, shape (world,); added to.
``worlds``                  Worlds to run, a mask of shape (world,).
``period``, ``gain``        Decision period [s]; force per velocity error [N s/m].
``own``, ``memory``         A vehicle's model of itself; memory of all vehicles (``memory.table``), each in its own map.
``memory_s``                Time for which an undetected neighbour is remembered [s].
``planes``, ``num``         Half-planes n_x v_x + n_y v_y <= b [m/s], a row each, shape (disc + sector, 3), and the
                            number of rows that count.
``u``, ``v``                Own surge and sway velocity [m/s]; ``w_x`` and ``w_y`` are the desired velocity.
==========================  =========================================================================================
"""

from uuv_marl.baselines.env_policy import EnvPolicy
from uuv_marl.baselines.making import make_policy, with_policy_requirements
from uuv_marl.baselines.policy import Policy, PolicyError
from uuv_marl.baselines.registry import POLICIES
from uuv_marl.baselines.requirements import PolicyRequirements

__all__ = [
    "POLICIES", "EnvPolicy", "Policy", "PolicyError", "PolicyRequirements", "make_policy", "with_policy_requirements",
]  # fmt: skip
