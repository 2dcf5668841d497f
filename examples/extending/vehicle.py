"""A vehicle of your own: a file with all numbers of its hull and actuators, named by a scenario."""

import tempfile
from pathlib import Path

import uuv_marl

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
            overrides = {"vehicle": vehicle, "trajectory.speed_mps": 2.0}
            (metrics,) = uuv_marl.evaluate("bio_inspired", "starter", [0], overrides=overrides)
            time_s, collisions = metrics["task_time_s"] or float("nan"), metrics["collisions"]
            print(f"{Path(vehicle).stem}: arrived after {time_s:.1f} s, {collisions} collisions")
