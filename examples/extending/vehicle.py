"""A vehicle of your own: its file gives all numbers of hull and actuators, and a scenario names it."""

import tempfile
from pathlib import Path

from uuv_marl import baselines, load_scenario
from uuv_marl.benchmark.evaluate import episodes

SLOW = """
[vehicle]
name = "slow"
m_kg = 400.0
I_z_kgm2 = 200.0
x_G_m = 0.0
X_udot_kg = -60.0
Y_vdot_kg = -300.0
Y_rdot_kgm = 0.0
N_rdot_kgm2 = -150.0
X_u = 140.0
Y_v = 400.0
Y_r = 0.0
N_v = 0.0
N_r = 300.0
X_uu = 150.0
Y_vv = 600.0
Y_rr = 0.0
N_rv = 0.0
N_rr = 400.0

[actuators]
max_force_n = 2500.0
max_torque_nm = 1500.0
lever_arm_m = 1.0
"""

if __name__ == "__main__":
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "slow.toml"
        path.write_text(SLOW)
        for vehicle in ("literature_185", str(path)):
            changed = load_scenario("starter", overrides={"vehicle": vehicle, "trajectory.speed_mps": 2.0})
            scenario = baselines.with_policy_requirements("bio_inspired", changed)
            (run,) = episodes(scenario, "bio_inspired", [0])
            time_s, collisions = run.metrics["task_time_s"] or float("nan"), run.metrics["collisions"]
            print(f"{scenario.vehicle.name}: arrived after {time_s:.1f} s, {collisions} collisions")
