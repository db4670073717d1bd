"""Shells that touch: themselves, planes, and as bars and hinges do."""

from __future__ import annotations

import numpy as np
import pytest

import foldyn as fd
from contact_sheets import SHEET, crossing, strip
from foldyn.checks import gradient_error, tangent_error
from foldyn.errors import CrossingWarning
from foldyn.mechanics.assembly import Assembly
from foldyn.mechanics.contact.tangent import guard_tangents
from foldyn.mechanics.contact.term import ContactTerm
from foldyn.viewer.states import fields
from pairwise import beyond

T, G = SHEET.thickness, 9.81
IMPLICIT = ["newmark", "generalized_alpha", "energy_momentum"]


def strip_shell(panels: int = 3, divisions: int = 4) -> fd.Shell:
    """The strip of the other tests of contact."""
    return fd.shell(strip(panels).pattern, SHEET, divisions=divisions, fold_law="linear")


def touching(
    shell: fd.Structure | fd.Shell, planes=(), thickness: float | None = None
) -> ContactTerm:
    return fd.Case(shell, contact=fd.Contact(thickness, planes=planes)).contact_term


THICK = 2e-3  # m: gaps that are large against rounding


def miura_stack(clamped: bool) -> fd.Shell:
    """A Miura sheet folded until it touches, clamped along an edge or free."""
    pattern = fd.patterns.miura(cells=(1, 1), a=0.02, b=0.02, panel_angle=60, dihedral=10)
    edges = [tuple(pattern.boundary[0].tolist())] if clamped else []
    return fd.shell(pattern, SHEET, divisions=3, fold_law="linear", clamped=edges)


def states(body: Assembly, count: int = 3):
    rng = np.random.default_rng(5)
    u = 1e-4 * rng.standard_normal((count, (body.size - len(body.hidden)) // 3, 3))
    return [np.append(each, np.zeros(len(body.hidden))) for each in u]


def test_forces_are_the_gradient_and_tangents_exact():
    shell = miura_stack(clamped=True)
    ground = fd.Plane((0, 0, shell.nodes[:, 2].min() - 0.3 * THICK), (0, 0, 1))
    stack = touching(shell, [ground], THICK)
    body = shell.body.with_terms(stack)

    def contact(q):
        return np.append(stack.contact(q)[1], np.zeros(len(body.hidden)))

    for q in states(body):
        energy = stack.contact(q)[0]
        assert energy == body.energies(q)[-1] > 0.0
        assert np.abs(stack.plane_forces(q)).max() > 0.0
        blocks = np.zeros((len(stack.tables.hinge_limit), 4, 3, 4, 3))
        assert guard_tangents(stack.tables, stack.tables.rest, blocks).any()
        size = 3e-5
        assert gradient_error(lambda q: stack.contact(q)[0], contact, at=q, size=size) < 1e-10
        assert tangent_error(contact, stack.tangent, at=q, size=size) < 1e-8
        assert tangent_error(body.internal, body.tangent, at=q, size=size) < 1e-8


@pytest.mark.parametrize("divisions", [2, 5])
def test_a_crease_is_guarded_from_where_its_panels_meet(divisions):
    """Whatever the mesh: at the dihedral 2 t / w, as stiff as that of bars and hinges."""
    whole = touching(strip()).tables
    creases = np.isin(whole.hinges[:, :2], [2, 3, 4, 5]).all(axis=1)  # centers are their wings
    shell = strip_shell(divisions=divisions)
    own, pieces = touching(shell).tables, slice(len(shell.sides.piece_crease))
    assert whole.hinge_limit[creases] == pytest.approx(2.0 * T / 0.04)
    assert own.hinge_limit[pieces] == pytest.approx(2.0 * T / 0.04)
    of = np.bincount(shell.sides.piece_crease, own.hinge_stiffness[pieces])
    np.testing.assert_allclose(of, whole.hinge_stiffness[creases])


def test_an_edge_between_elements_cannot_turn_inside_out():
    """Nothing else keeps two triangles of one panel from folding onto each other."""
    square = fd.Pattern([[0, 0], [1, 0], [1, 1], [0, 1]], [[0, 1, 2, 3]])
    shell = fd.shell(square, fd.Sheet(1e6, 0.25, 0.01, density=1.0), divisions=1)
    body, dofs = touching(shell), shell.body.dofs
    axis, (free,) = shell.sides.hinges[0, :2], shell.sides.hinges[:, 2]
    x = body.tables.rest
    along = x[axis[1]] - x[axis[0]]
    arm = x[free] - x[axis[0]]
    across = arm - (arm @ along) / (along @ along) * along
    energies = []
    for turn in (170.0, 179.5):  # degrees, against the other triangle
        u = np.zeros_like(x)
        up = np.linalg.norm(across) * np.array([0.0, 0.0, np.sin(np.radians(turn))])
        u[free] = (np.cos(np.radians(turn)) - 1.0) * across + up
        energies.append(body.contact(dofs(u))[0])
        back = u.copy()
        back[free, 2] *= -1.0
        assert body.clear(dofs(u), dofs(back) - dofs(u), np.zeros((0, 3))) < 1.0
    assert energies[0] == 0.0 < energies[1]


# ------------------------------------------------------------------ paths
def folded(structure, contact=True, steps=4):
    case = fd.Case(
        structure, [fd.Fix([2, 3, 4, 5])], [fd.Actuate([0, 1], (8.0, 25.0))],
        contact=fd.Contact() if contact else None,
    )  # fmt: skip
    return case, fd.trace(case, "newton", steps=steps)


def push_of_panels(case: fd.Case, path) -> np.ndarray:
    """Force (3,) of the last panel of the strip on the first one, N."""
    force = -case.contact_term.contact(case.body.dofs(path.displacement.values[-1]))[1]
    return force[case.structure.nodes[:, 0] < 0.04 - 1e-9].sum(axis=0)


@pytest.mark.matrix
def test_a_strip_folded_onto_itself_rests_as_bars_and_hinges_do():
    pytest.importorskip("ipctk")
    push, ends = [], []
    plates = fd.discretize(strip().pattern, SHEET, scheme="n5b8e", fold_law="linear")
    for structure in (strip(), plates, strip_shell()):
        case, path = folded(structure)
        assert path.attrs["crossing_samples"] == 0
        assert crossing(structure, path.displacement.values) == 0
        assert float(path.contact[-1]) > 0.0 == float(path.contact[0])
        push.append(push_of_panels(case, path))
        ends.append(path.displacement.values[-1, [0, 1, 6, 7]])
    for own, end in zip(push[:2], ends[:2], strict=True):
        assert np.linalg.norm(own - push[2]) < 0.04 * np.linalg.norm(push[2])
        assert np.abs(end - ends[2]).max() < 0.02 * np.abs(ends[2]).max()


def test_without_contact_it_crosses_itself():
    with pytest.warns(CrossingWarning):
        case, path = folded(strip_shell(divisions=2), contact=False)
    assert path.attrs["crossing_samples"] > 0
    assert crossing(case.structure, path.displacement.values) > 0


def test_a_path_finds_a_sheet_that_lies_on_the_ground():
    shell = strip_shell(2, divisions=2)
    ground = fd.Plane((0, 0, -0.49 * T), (0, 0, 1))
    hardly = fd.Spring(1e-9, nodes=list(range(len(shell.nodes))))
    case = fd.Case(
        shell, [hardly], [fd.Gravity((0, 0, -G))],
        contact=fd.Contact(panels=False, planes=[ground]),
    )  # fmt: skip
    path = fd.trace(case, "newton", steps=2)
    weight = case.total_mass * G
    np.testing.assert_allclose(path.plane_force.values[-1, 0], [0, 0, weight], atol=1e-9 * weight)
    height = path.displacement.values[-1, :, 2] + 0.49 * T
    assert 0.48 * T < height.min() < height.max() < 0.5 * T


# ------------------------------------------------------------------ motions
def lying(angle: float, friction: float, alpha: float = 0.0) -> fd.Case:
    """A flat strip on a slope of some degrees, which is the x-y plane."""
    a = np.radians(angle)
    plane = fd.Plane((0, 0, -0.4965 * T), (0, 0, 1), friction=friction)
    return fd.Case(
        strip_shell(1, divisions=2), [], [fd.Gravity((G * np.sin(a), 0, -G * np.cos(a)))],
        fd.Rayleigh(alpha=alpha), contact=fd.Contact(panels=False, planes=[plane]),
    )  # fmt: skip


@pytest.mark.matrix
def test_a_shell_slides_above_the_angle_of_friction():
    case, a = lying(20.0, 0.3), np.radians(20.0)
    run = fd.simulate(case, 0.1, method="generalized_alpha", dt=2e-4, interval=2e-3)
    distance = run.displacement.values[-1, :, 0].mean()
    expected = 0.5 * G * (np.sin(a) - 0.3 * np.cos(a)) * 0.1**2
    assert distance == pytest.approx(expected, rel=0.02)
    taken = 0.3 * case.total_mass * G * np.cos(a) * distance
    assert float(run.dissipated[-1]) == pytest.approx(taken, rel=2e-3)
    assert run.attrs["energy_error"] < 1e-3


@pytest.mark.matrix
def test_a_shell_sticks_below_the_angle_of_friction():
    case = lying(15.0, 0.3, alpha=200.0)
    run = fd.simulate(case, 0.2, method="generalized_alpha", dt=2e-4, interval=2e-3)
    along = run.displacement.values[:, :, 0].mean(axis=1)
    assert abs(along[-1] - along[60]) < 1e-12
    assert along[-1] < 1e-3 and run.attrs["energy_error"] < 1e-2
    normal = case.total_mass * G * np.cos(np.radians(15.0))
    assert float(run.plane_force[-1, 0, 2]) == pytest.approx(normal, rel=1e-3)


def thrown(method: str, **options):
    """A shell of one panel flies at another one, askew, with 2 m/s."""
    square = np.array([[0, 0, 0], [0.04, 0, 0], [0.04, 0.04, 0], [0, 0.04, 0]])
    turned = square @ np.array([[0.8, 0.6, 0], [-0.6, 0.8, 0], [0, 0, 1]]).T + [0.01, -0.01, 0.002]
    turned[:, 2] += 0.02 * turned[:, 0]
    pattern = fd.Pattern(np.vstack([square, turned]), [(0, 1, 2, 3), (4, 5, 6, 7)])
    shell = fd.shell(pattern, SHEET, divisions=3)
    v = np.zeros_like(shell.nodes)
    v[shell.nodes[:, 2] > 1e-3, 2] = -2.0
    case = fd.Case(shell, contact=fd.Contact())
    return case, fd.simulate(case, 0.01, method=method, initial=fd.State(velocity=v), **options)


@pytest.mark.matrix
@pytest.mark.parametrize("method", [*IMPLICIT[:1], *beyond([*IMPLICIT[1:], "dormand_prince"])])
def test_colliding_shells_keep_momentum_and_energy(method):
    pytest.importorskip("ipctk")
    explicit = method not in IMPLICIT
    steps = {"interval": 2e-4} if explicit else {"dt": 1e-5, "every_steps": 20}
    case, run = thrown(method, **steps)
    shell = case.structure
    momentum = np.einsum("nm,tmc->tnc", shell.mass.toarray(), run.velocity.values)
    x = shell.nodes + run.displacement.values
    linear, angular = momentum.sum(axis=1), np.cross(x, momentum).sum(axis=1)
    assert np.abs(linear - linear[0]).max() < 1e-12 * np.abs(linear[0]).max()
    assert np.abs(angular - angular[0]).max() < 1e-3 * np.abs(angular[0]).max()
    assert run.attrs["energy_error"] < 3e-3
    assert float(run.contact.max()) > 0.0 == float(run.contact[0])
    assert crossing(shell, run.displacement.values) == run.attrs["crossing_samples"] == 0
    assert run.attrs["crossing_looks"] == len(run.time)
    force = run.contact_force.values
    assert ((force > 0.0).any(axis=1) == (run.contact.values > 0.0)).all()
    shown = fields(case, run, run.displacement.values)["contact"]
    assert shown.on == "node" and shown.values.shape == (len(run.time), len(shell.nodes))


def test_auto_takes_a_method_that_shells_have():
    case = fd.Case(strip_shell(2, divisions=1), contact=fd.Contact())
    run = fd.simulate(case, 1e-4, method="auto", interval=1e-4)
    assert run.attrs["method"] == "generalized_alpha"
