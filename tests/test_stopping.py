"""Collisions that stop: properties of a hull that has hit something."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from tests.swarms import started
from uuv_marl.sim.vehicle import Plant

STOPS = {"collision.stops": True, "obstacles": [{"centre_m": [0.0, 0.0], "radius_m": 20.0}]}
STOPS |= {"trajectory.waypoints_m": [[200.0, 0.0], [400.0, 0.0]]}
NOTHING = np.zeros((1, 2, 2))


def two(first, second, *, nu=((0.0, 0.0, 0.0),) * 2, **changes):
    """Two vehicles at these poses, the disc of 20 m around the origin."""
    swarm = started("single_obstacle", {**STOPS, **changes}, n=2)
    swarm.state.eta[0], swarm.state.nu[0] = np.array([first, second]), np.array(nu)
    swarm.observe()
    return swarm


def with_and_without(*start, **changes):
    """The same vehicles where collisions stop them and where they do not."""
    return (two(*start, **changes, **{"collision.stops": stops}) for stops in (True, False))


def energy(swarm):
    """Kinetic energy relative to the water [J]."""
    m_11, m_22, m_23, m_33 = swarm.scenario.vehicle.inertia
    u, v, r = np.moveaxis(swarm.state.nu[0], -1, 0)
    return 0.5 * float((m_11 * u * u + m_22 * v * v + 2 * m_23 * v * r + m_33 * r * r).sum())


def test_a_hull_that_pushes_on_stays_at_the_wall_in_one_collision():
    """Full thrust at a wall for 10 s: no further than a millimetre in, and one collision."""
    swarm = two((-30.0, 0.0, 0.0), (300.0, 0.0, 0.0))
    contacts = 0
    for _ in range(100):
        swarm.step(np.array([[[1.0, 0.0], [0.0, 0.0]]]))
        contacts += int(swarm.facts.vehicle_collisions[0, 0])
        assert swarm.facts.clearance[0, 0] >= 0.998
    assert contacts == 1
    assert swarm.state.collided[0].tolist() == [True, False]
    assert abs(swarm.state.nu[0, 0, 0]) < 1e-9
    for _ in range(50):  # and it leaves by its own thrust
        swarm.step(np.array([[[-1.0, 0.0], [0.0, 0.0]]]))
    assert swarm.facts.clearance[0, 0] > 5.0


def test_along_a_wall_a_hull_glides():
    """The impulse has no component along the surface: only drag changes that velocity."""
    nu = (4.0, 0.0, 0.0), (0.0, 0.0, 0.0)
    swarm, free = with_and_without((-8.0, -19.9, 0.1), (300.0, 0.0, 0.0), nu=nu)
    for _ in range(6):
        swarm.step(NOTHING)
        free.step(NOTHING)
    assert swarm.state.collided[0, 0]
    assert swarm.state.nu[0, 0, 0] > 0.7 * free.state.nu[0, 0, 0]


poses = st.tuples(st.floats(-3.0, 3.0), st.floats(-3.0, 3.0), st.floats(-3.1, 3.1))
speeds = st.tuples(st.floats(-5.0, 5.0), st.floats(-3.0, 3.0), st.floats(-1.0, 1.0))


def momentum(swarm):
    """Momentum of all vehicles in still water, north and east [N s]."""
    m_11, m_22, *_ = swarm.scenario.vehicle.inertia
    (u, v, _), psi = np.moveaxis(swarm.state.nu[0], -1, 0), swarm.state.eta[0, :, 2]
    c, s = np.cos(psi), np.sin(psi)
    return np.array([(c * m_11 * u - s * m_22 * v).sum(), (s * m_11 * u + c * m_22 * v).sum()])


@settings(max_examples=40, deadline=None)
@given(pose=poses, first=speeds, second=speeds, x_g=st.sampled_from([0.0, 0.1]))
def test_energy_never_rises_and_two_hulls_keep_their_momentum(pose, first, second, x_g):
    """Against the same hulls without collisions: after a control step only the impulse differs."""
    start = (300.0 + pose[0], pose[1], pose[2]), (300.0, 0.0, 0.0)
    on, off = with_and_without(*start, nu=(first, second), **{"vehicle.x_G_m": x_g})
    for swarm in (on, off):
        swarm.step(NOTHING)
    assert energy(on) <= energy(off) * (1.0 + 1e-9) + 1e-9
    if x_g == 0.0:  # else a push at the origin also turns the hull
        np.testing.assert_allclose(momentum(on), momentum(off), atol=1e-6)
    assert on.facts.spacing[0, 0] >= min(off.facts.spacing[0, 0], 1.998)


def test_hulls_of_other_masses_than_the_nominal_one_share_their_momentum_too():
    """Masses are random (mismatch); against the same hulls without collisions, as above. Both go on as one."""
    start, nu = ((300.0, 0.0, 0.0), (302.02, 0.0, 0.0)), ((1.0, 0.0, 0.0), (0.0, 0.0, 0.0))
    drawn = {"mismatch.mass": 0.8, "mismatch.added_mass": 0.8, "timing.integration_step_s": 0.00625}
    on, off = with_and_without(*start, nu=nu, **drawn)
    mass = 1.0 / on._disturbances.hull.plants[0, :, Plant._fields.index("inverse_11")]
    assert mass.max() > 1.2 * mass.min()
    for swarm in (on, off):
        swarm.step(NOTHING)
    u_on, u_off = on.state.nu[0, :, 0], off.state.nu[0, :, 0]
    assert on.facts.vehicle_collisions[0].all()
    assert mass @ u_on == pytest.approx(mass @ u_off, abs=1e-9)
    assert u_on[0] == pytest.approx(u_on[1], abs=1e-9)
    assert mass @ u_on**2 < mass @ u_off**2


def test_off_is_as_before():
    on, off = with_and_without((-30.0, 1.0, 0.0), (300.0, 0.0, 0.0))
    for k in range(100):
        for swarm in (on, off):
            swarm.step(np.array([[[0.7, 0.0], [0.3, 0.1]]]))
        if off.facts.vehicle_collisions[0].any():
            assert k > 5
            break
        np.testing.assert_array_equal(on.state.eta, off.state.eta)
    else:
        pytest.fail("nothing was touched")
