"""Added mass in motions: momentum, energy, acceleration, frequency."""

import numpy as np
import pytest
from numpy.testing import assert_allclose

import foldyn as fd
from foldyn.cases.added_mass import fluid_at
from foldyn.dynamics.gpu.checks import lacking
from foldyn.dynamics.system import pack
from foldyn.errors import ComputationError, InputError
from named_models import named

SIDE = 0.1
FLUID = {"density": 100.0, "drag": False}
EXPLICIT = ("rk4", "central_difference", "dormand_prince")


def plate(modulus=1e8, thickness=0.01):
    corners = SIDE * np.array([(0, 0), (1, 0), (1, 1), (0, 1)])
    sheet = fd.Sheet(modulus, 0.3, thickness, density=100.0)
    return fd.discretize(fd.Pattern(corners, [(0, 1, 2, 3)]), sheet, preset="plate")


def folded(**changes):
    pattern = fd.patterns.miura(cells=(1, 1), a=SIDE, b=SIDE, panel_angle=60, dihedral=120)
    return fd.discretize(pattern, fd.Sheet(5e6, 0.3, 1e-3, density=300.0), **named(changes))


def momenta(case, motion, sample):
    """Linear and angular momentum (6,) of sheet and fluid, kg m/s and kg m2/s."""
    moved, v = (motion[name].values[sample] for name in ("displacement", "velocity"))
    x = case.structure.nodes + moved
    p = case.mass @ v + (fluid_at(case, moved).on(x) @ v.ravel()).reshape(-1, 3)
    return np.concatenate([p.sum(axis=0), np.cross(x, p).sum(axis=0)])


@pytest.mark.parametrize("added_mass", [True, "local"])
def test_the_energy_of_the_fluid_is_that_of_the_added_mass(added_mass):
    pattern = fd.patterns.miura(cells=(2, 2), a=SIDE, b=SIDE, panel_angle=60, dihedral=100)
    structure = fd.discretize(pattern, fd.Sheet(5e6, 0.3, 1e-3, density=300.0), preset="plate")
    fluid = fd.Air(density=100.0, drag=False, added_mass=added_mass, resolution=2)
    case, random = fd.Case(structure, air=fluid), np.random.default_rng(5)
    moved, v = 0.01 * SIDE * random.random((2, *structure.nodes.shape))
    start = fd.State(displacement=moved, velocity=v)
    motion = fd.simulate(case, 1e-6, method="rk4", dt=1e-6, initial=start)
    whole = case.added_mass(start) @ v.ravel() + (case.mass @ v).ravel()
    assert_allclose(motion.kinetic[0], 0.5 * v.ravel() @ whole, rtol=1e-12)


def last_place(turned=None, shift=0.0, first=0, held=None):
    """Last displacement of a sheet that folds, as seen before it is turned and shifted.

    first : number of the corner with which faces begin.
    """
    turned = np.eye(3) if turned is None else turned
    pattern = folded().pattern
    faces = [face[first:] + face[:first] for face in pattern.faces]
    placed = fd.Pattern(pattern.vertices @ turned.T + shift, faces)
    sheet = fd.discretize(placed, fd.Sheet(5e6, 0.3, 1e-3, density=300.0), preset="plate")
    push = fd.Force([6, 8], turned @ (0.01, 0.02, 0.05))
    case = fd.Case(sheet, [held or fd.Fix([0, 1, 2])], [push], air=fd.Air(**FLUID, resolution=2))
    motion = fd.simulate(case, 0.05, method="rk4", interval=0.05)
    assert motion.attrs["flows"] > 1
    return motion.displacement.values[-1] @ turned


@pytest.mark.matrix
def test_a_sheet_that_folds_moves_alike_wherever_it_stands():
    """Rounding must not choose the triangle under an element on the line between two."""
    turn = np.linalg.qr(np.random.default_rng(2).standard_normal((3, 3)))[0]
    turn *= np.linalg.det(turn)
    there = last_place(turn, np.array([1.0, 2.0, 3.0]))
    assert_allclose(there, last_place(), atol=1e-10 * SIDE)
    # supports along an axis hold dofs, others tie them to each other
    tied = last_place(turn, held=fd.Fix([0, 1, 2], direction=turn[:, 2]))
    assert_allclose(tied, last_place(held=fd.Fix([0, 1, 2], "z")), atol=1e-10 * SIDE)


@pytest.mark.matrix
@pytest.mark.parametrize("first", [1, 2, 3])
def test_a_sheet_moves_alike_whatever_the_first_corner_of_its_panels(first):
    """Of two triangles that share an element the first one must not have it alone."""
    assert_allclose(last_place(first=first)[:9], last_place()[:9], atol=1e-10 * SIDE)


@pytest.mark.parametrize("method", EXPLICIT)
def test_a_body_keeps_its_momenta_and_its_energy(method):
    """Kirchhoff's equations: a plate that turns and drifts, with the moment m_a v_n v_t (Munk)."""
    case = fd.Case(plate(), air=fd.Air(**FLUID))
    spin = np.cross((3.0, 5.0, -2.0), case.structure.nodes - case.center_of_mass)
    start = fd.State(velocity=spin + np.array([0.2, 0.1, 0.3]))
    motion = fd.simulate(case, 0.1, method=method, interval=0.05, initial=start)
    before, after = momenta(case, motion, 0), momenta(case, motion, -1)
    assert motion.attrs["flows"] == 1
    assert_allclose(after[:3], before[:3], atol=1e-5 * np.linalg.norm(before[:3]))
    assert_allclose(after[3:], before[3:], atol=1e-5 * np.linalg.norm(before[3:]))
    assert motion.attrs["energy_error"] < 1e-4
    x = case.structure.nodes + motion.displacement.values[-1]
    normals = np.cross(*(x[[1, 3]] - x[0])) / SIDE**2
    assert normals[2] < 0.96  # it has turned by 16 degrees


@pytest.mark.parametrize("method", EXPLICIT)
def test_a_pressed_plate_accelerates_with_the_added_mass(method):
    force, span = 0.02, 0.05
    case = fd.Case(plate(), loads=[fd.Pressure(force / SIDE**2)], air=fd.Air(**FLUID))
    mass = case.total_mass + case.added_mass().todense()[2::3, 2::3].sum()
    motion = fd.simulate(case, span, method=method, interval=span)
    moved = case.mass.sum(axis=1) @ motion.displacement.values[-1, :, 2] / case.total_mass
    assert mass > 4.0 * case.total_mass
    assert_allclose(moved, 0.5 * force / mass * span**2, rtol=1e-4)
    assert_allclose(motion.kinetic[-1], 0.5 * (force * span) ** 2 / mass, rtol=1e-4)


@pytest.mark.matrix
def test_small_vibrations_have_the_frequencies_of_modes_in_the_fluid():
    held = [fd.Fix(nodes="xmin", axes="xyz")]
    case = fd.Case(folded(), held, air=fd.Air(density=50.0, drag=False))
    modes = fd.modes(case, count=1)
    shape, period = modes.shape.values[0], 1.0 / float(modes.frequency[0])
    dry = float(fd.modes(case.altered(air=None), count=1).frequency[0])
    assert dry * period > 1.3
    start = fd.State(displacement=1e-5 * SIDE / np.abs(shape).max() * shape)
    whole = np.kron(case.mass.toarray(), np.eye(3)) + case.added_mass().todense()
    along = whole @ shape.ravel()
    motion = fd.simulate(
        case, 1.25 * period, method="dormand_prince", interval=0.05 * period, initial=start
    )
    amplitude = motion.displacement.values.reshape(len(motion.time), -1) @ along
    exact = np.cos(2.0 * np.pi * motion.time.values / period)
    assert_allclose(amplitude / amplitude[0], exact, atol=2e-3)


@pytest.mark.matrix
@pytest.mark.parametrize("method", EXPLICIT)
def test_a_sheet_that_folds_gets_new_flows_whose_energies_are_audited(method):
    case = fd.Case(
        folded(mass="mixed_voronoi"),
        loads=[fd.Actuate("all", fraction=0.7, history=fd.Ramp(duration=0.1)), fd.Gravity("-z")],
        air=fd.Air(density=20.0, velocity=(1.0, 0.0, 0.5)),
    )
    motion = fd.simulate(case, 0.1, method=method, interval=0.01)
    assert motion.attrs["flows"] > 5
    assert motion.attrs["energy_error"] < (4e-3 if method == "central_difference" else 1e-4)
    assert motion.attrs["flow_energy"] < 1e-3 * float(motion.work[-1])


@pytest.mark.matrix
def test_new_flows_converge(monkeypatch):
    """Two panels that close on dense gas: half as much turn between two flows, less error."""
    pattern = fd.patterns.simple_fold(a=SIDE, b=SIDE, dihedral=120)
    sheet, crease = fd.Sheet(2e7, 0.3, 2e-3, density=300.0), {"crease_stiffness": 0.2}
    structure = fd.discretize(pattern, sheet, crease_rest=220.0, **named(crease))
    monkeypatch.setattr("foldyn.dynamics.motion.LOOK_EVERY", 2)
    moved = {}
    for turn in (4.0, 2.0, 0.5, None):
        monkeypatch.setattr("foldyn.dynamics.added_mass.TURN", np.radians(turn or 1.0))
        air = fd.Air(density=20.0, drag=False) if turn else None
        x = fd.simulate(
            fd.Case(structure, air=air), 0.04, method="rk4", interval=0.04
        ).displacement.values[-1]
        moved[turn] = x[0, 0] - x[4, 0]
    assert abs(moved[None] / moved[0.5] - 1.0) > 0.2
    assert_allclose(moved[4.0], moved[0.5], rtol=5e-4)
    assert_allclose(moved[2.0], moved[0.5], rtol=1.5e-4)


def test_reactions_carry_the_fluid():
    """The support of a plate that starts to fall about its edge bears what does not accelerate."""
    held = [fd.Fix(nodes=[0, 3], axes="xyz")]
    gravity, alpha = fd.Gravity((0, 0, -9.81)), 20.0
    case = fd.Case(plate(), held, [gravity], fd.Rayleigh(alpha), air=fd.Air(**FLUID))
    motion = fd.simulate(case, 0.01, method="rk4", every_steps=1)
    up = motion.reaction.values[:, motion.support_axis.values == "z"].sum(axis=1)
    moved = fluid_at(case, 0.0 * case.structure.nodes).on(case.structure.nodes)
    v = motion.velocity.values.reshape(len(motion.time), -1)
    p = motion.velocity.values[:, :, 2] @ case.mass.sum(axis=0) + (moved @ v.T)[2::3].sum(axis=0)
    up = up - case.total_mass * 9.81 - alpha * motion.velocity.values[:, :, 2] @ case.nodal_mass
    given = (np.diff(motion.time) * 0.5 * (up[1:] + up[:-1])).sum()
    assert_allclose(p[-1], given, rtol=1e-3)


@pytest.mark.parametrize("method", EXPLICIT)
def test_alpha_damps_the_mass_of_the_sheet_alone(method):
    """(m + m_a) v' = -alpha m v."""
    alpha, span = 40.0, 0.05
    case = fd.Case(plate(1e9), damping=fd.Rayleigh(alpha), air=fd.Air(**FLUID))
    mass = case.total_mass + case.added_mass().todense()[2::3, 2::3].sum()
    start = fd.State(velocity=np.tile([0.0, 0.0, 1.0], (5, 1)))
    motion = fd.simulate(case, span, method=method, interval=span, initial=start)
    left = np.exp(-2.0 * alpha * case.total_mass / mass * span)
    assert_allclose(motion.kinetic, 0.5 * mass * np.array([1.0, left]), rtol=2e-3)
    assert_allclose(motion.dissipated[-1], 0.5 * mass * (1.0 - left), rtol=2e-3)


def test_what_does_not_take_added_mass_says_so():
    case = fd.Case(plate(), air=fd.Air(**FLUID))
    for method in ("newmark", "generalized_alpha", "energy_momentum"):
        with pytest.raises(InputError, match="added_mass = false"):
            fd.simulate(case, 0.01, method=method, dt=1e-3)
    moving = [fd.Fix(nodes=[0, 1], axes="xyz"), fd.BaseMotion("z", fd.Harmonic(1.0))]
    with pytest.raises(InputError, match="moving supports cannot include added mass"):
        fd.simulate(fd.Case(plate(), moving, air=fd.Air(**FLUID)), 0.01, method="rk4")
    with pytest.raises(InputError, match="resolution = 80: the flow has 6241 unknowns"):
        fd.simulate(fd.Case(plate(), air=fd.Air(**FLUID, resolution=80)), 0.01, method="rk4")
    assert fd.simulate(case, 1e-3, method="auto", interval=1e-3).attrs["method"] == "dormand_prince"
    with pytest.raises(InputError, match=r"air\.added_mass: the exponent needs a constant mass"):
        fd.lyapunov_exponent(case, 1.0)
    voronoi = fd.discretize(
        case.structure.pattern, case.structure.sheet, mass="mixed_voronoi", preset="plate"
    )
    blown = fd.Case(voronoi, air=fd.Air(added_mass=False))
    assert lacking(blown, pack(blown, 1.0)) == "air of the case"  # on a GPU
    shell = fd.shell(
        fd.patterns.simple_fold(), fd.Sheet(1e7, 0.3, 0.02, density=300.0), divisions=2
    )
    blown = fd.simulate(fd.Case(shell, air=fd.Air()), 0.01, method="auto", interval=0.01)
    assert blown.attrs["method"] == "dormand_prince"


@pytest.mark.matrix
def test_panels_that_close_on_each_other_end_the_motion():
    pattern = fd.patterns.simple_fold(a=SIDE, b=SIDE, dihedral=60)
    sheet, crease = fd.Sheet(2e7, 0.3, 2e-3, density=300.0), {"crease_stiffness": 0.5}
    fluid = fd.Air(density=20.0, drag=False)
    case = fd.Case(fd.discretize(pattern, sheet, crease_rest=358.0, **named(crease)), air=fluid)
    with pytest.raises(ComputationError, match="the flow about the sheet is lost: air: panels 0"):
        fd.simulate(case, 0.1, method="central_difference", interval=0.002)
