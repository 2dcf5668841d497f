"""Policies: percepts in, actions out. ``make_policy(name, scenario_or_env)`` gives one; ``POLICIES`` lists them.

Arguments of compiled functions have the same names and the same meaning everywhere, beside those of ``uuv_marl.sim``:

==========================  =========================================================================================
``flat``, ``at``            Percepts in physical units, shape (world, vehicle, entry), and where their fields start.
``a``, ``d``                Index of the active sub-sector, which holds an echo; of the remembered disc.
``axis``                    0 thrust, 1 torque.
``g``, ``limits``           The law's gains; limits of the actuators, and the surge resistance.
``barrier``                 Margins and rates of the filter.
``centres``                 True if echoes report centres, False if they report points of surfaces.
``action``                  Filled with shares of full force, body frame, shape (world, vehicle, 2).
``clamps``                  Numerical bounds that bound, counted per world, shape (world,); added to.
``worlds``                  Those that run, shape (world,).
``period``, ``gain``        Time between two decisions [s]; force per velocity error [N s/m].
``own``, ``kept``           A vehicle's model of itself; what vehicles remember (``memory.surroundings``), in each one's
                            map. ``memory_s``: how long it remembers a neighbour that it hears no more [s].
``planes``, ``num``         Half-planes n_x v_x + n_y v_y <= b [m/s], a row each, shape (disc + sector, 3), and how many
                            rows count.
``u``, ``v``                Own surge and sway velocity [m/s]; ``w_x`` and ``w_y`` are parts of the wished velocity.
==========================  =========================================================================================
"""

from uuv_marl.baselines.env_policy import EnvPolicy
from uuv_marl.baselines.making import make_policy, with_policy_requirements
from uuv_marl.baselines.policy import Policy, PolicyError
from uuv_marl.baselines.registry import POLICIES

__all__ = ["POLICIES", "EnvPolicy", "Policy", "PolicyError", "make_policy", "with_policy_requirements"]
