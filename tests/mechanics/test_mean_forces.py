"""Mean forces in a step: their work, their resultant and moment, their limit, their gradients."""

from __future__ import annotations

from functools import cached_property
from itertools import product
from typing import Any, NamedTuple

import numpy as np
import pytest
from scipy.spatial.transform import Rotation
from springs import Net

import foldyn as fd
from custom_laws import CUBIC
from foldyn.checks import observed_order
from foldyn.dynamics.system import pack
from foldyn.jit.compiled import kernel
from foldyn.jit.context import Context, numbers_at, rows_at, run_at
from foldyn.mechanics import angles
from foldyn.mechanics.assembly import Assembly
from foldyn.mechanics.discrete_gradient import discrete_gradient, mean_moment, mean_stress
from foldyn.mechanics.inelastic import HingeMemory
from foldyn.mechanics.mean_forces import MeanForces
from foldyn.mechanics.term import FORCES, MEAN_FORCES, CompiledTerm, Term, forces
from pairwise import in_pairs

SHEET = fd.Sheet(youngs_modulus=1e6, poissons_ratio=0.3, thickness=0.01, density=1.0)
FOLD = fd.patterns.simple_fold(a=1.0, b=1.3, dihedral=100)
MODELS = ("plate", "herkal", "n5b8e", "shell")
OTHER_LAWS = {
    "superlinear": {"fold_law": "superlinear", "bend_law": "superlinear"},
    "locking": {"fold_law": fd.EnhancedLinear(110, 285), "bend_law": "linear"},
    "custom": {"bar_law": "linear", "fold_law": CUBIC, "bend_law": CUBIC},
}
ELASTIC = (*MODELS, *OTHER_LAWS)
FREE = [
    fd.Spring(40.0, between=[(0, 2), (1, 3)]),
    fd.Spring(25.0, between=[(3, 0)], rest_length=0.4),
    fd.Spring(35.0, between=[(1, 2)], rest_length=0.0),
]
GROUNDED = [
    fd.Spring(300.0, nodes=[0, 2]),
    fd.Spring(70.0, nodes=[1], direction=(1, 2, -1)),
    fd.Spring(55.0, between=[(0, 3)], direction="-y"),
]
LAWS = {
    "prony": fd.Prony([0.5, 0.2], [0.02, 0.3], law="linear"),
    "plastic": fd.Plastic(0.01, isotropic=0.1, kinematic=0.2, law="linear"),
    "eyring": fd.Eyring(0.02, 1e-2, law="linear"),
}
NO_POWERS = np.zeros(2)


def structure(model: str, **options: Any) -> Any:
    if model == "shell":
        return fd.shell(FOLD, SHEET, divisions=1, **options)
    if model in OTHER_LAWS:
        return fd.discretize(FOLD, SHEET, preset="herkal", **OTHER_LAWS[model])
    return fd.discretize(FOLD, SHEET, preset=model, **options)


@kernel
def _call(function, context, u0, u1, before, h, force, powers):
    run_at(function, (context, u0, u1, before, h, 0.0, force, powers))


def mean_forces(
    body: Assembly, q0: np.ndarray, q1: np.ndarray, h: float = 1.0, powers: np.ndarray = NO_POWERS
) -> np.ndarray:
    """Mean forces (m,) of all terms from q0 to q1, and their powers."""
    part = body.thread_parts(1)[0]
    terms, out = MeanForces(body, part), np.zeros((body.rows, 3))
    ends = body.in_rows(q0), body.in_rows(q1)
    for function, context in zip(terms.kernel, terms.context, strict=True):
        _call(function, context, *ends, body.angles(q0), h, out, powers)
    np.testing.assert_allclose(part.angle, body.angles(q1), atol=1e-14)
    return out.ravel()[: body.size]


def halfway(body: Assembly) -> Assembly:
    """The same with a sheet whose mean forces are made of its forces and energies."""

    class Sheet(type(body.sheet)):
        def compiled(self, part: Any, kept: Any, group: int) -> CompiledTerm:
            own = super().compiled(part, kept, group)
            kernels = {k: v for k, v in own.kernels.items() if k != MEAN_FORCES}
            return own._replace(kernels=kernels)

    body.sheet.__class__ = Sheet
    return body


def states(body: Assembly, deform: float, turn: float) -> list[np.ndarray]:
    """Dofs of a deformed sheet, and of one deformed a little more, turned and shifted."""
    rng, rest = np.random.default_rng(3), nodes(body)
    one, more = 0.03 * rng.standard_normal((2, body.size))
    more = one + deform / 0.03 * more
    turned = Rotation.from_rotvec(turn * np.array([0.48, -0.6, 0.64])).as_matrix()
    x = (rest + more[: rest.size].reshape(-1, 3)) @ turned.T + np.array([0.3, -1.0, 2.0])
    return [one, np.append(x - rest, more[rest.size :])]


def nodes(body: Assembly) -> np.ndarray:
    sheet: Any = body.sheet.model
    rest = sheet.rest if hasattr(sheet, "rest") else sheet.bars.rest
    return rest[: (body.size - len(body.hidden)) // 3]


def assert_no_resultant(body: Assembly, force: np.ndarray, q0: np.ndarray, q1: np.ndarray) -> None:
    """Neither a force nor a moment about the mean positions."""
    rest, scale = nodes(body), np.abs(force).max()
    own = force[: rest.size].reshape(-1, 3)
    middle = rest + 0.5 * (q0 + q1)[: rest.size].reshape(-1, 3)
    assert np.abs(own.sum(axis=0)).max() < 1e-12 * scale
    assert np.abs(np.cross(middle, own).sum(axis=0)).max() < 1e-11 * scale


HELD = [*product(ELASTIC, ([],)), *product(MODELS, (FREE, GROUNDED))]


@pytest.mark.parametrize(
    ("held", "deform", "turn"), in_pairs(HELD, [1e-9, 1e-4, 0.02], [0.0, 1e-3, 0.3, 1.5])
)
def test_work_is_the_change_of_the_energy(held, deform, turn):
    """However far the step goes; without resultant and moment where nothing holds the sheet."""
    model, supports = held
    body = fd.Case(structure(model), supports).body
    q0, q1 = states(body, deform, turn)
    force, before = mean_forces(body, q0, q1), body.energies(q0).sum()
    change = body.energies(q1).sum() - before
    assert force @ (q1 - q0) == pytest.approx(change, abs=4e-13 * (before + abs(change)))
    if supports is not GROUNDED:
        assert_no_resultant(body, force, q0, q1)


@pytest.mark.parametrize("model", ["herkal", *OTHER_LAWS])
def test_a_rigid_motion_turns_the_forces_with_the_body(model):
    """Half turned, they are the internal forces, but for the mean positions being nearer."""
    body = fd.Case(structure(model)).body
    q0, q1 = states(body, 0.0, 0.4)
    middle = Rotation.from_rotvec(0.2 * np.array([0.48, -0.6, 0.64])).as_matrix()
    turned = body.internal(q0).reshape(-1, 3) @ middle.T
    # bars along the axis keep their force, those across act along directions cos(0.2) as long
    w = 2.0 * np.tan(0.2) * np.array([0.48, -0.6, 0.64])
    values, vectors = np.linalg.eigh(np.eye(3) * (1.0 + w @ w / 4.0) - np.outer(w, w) / 4.0)
    expected = turned @ (vectors / np.sqrt(values)) @ vectors.T
    found = mean_forces(body, q0, q1).reshape(-1, 3)
    np.testing.assert_allclose(found, expected, atol=1e-12 * np.abs(turned).max())


@pytest.mark.parametrize("deform", [1e-6, 0.02])
@pytest.mark.parametrize("model", ["herkal", "shell"])
def test_clamped_edges_do_the_work_of_their_energy(model, deform):
    closes(fd.Case(structure(model, clamped=[(0, 1)]), FREE).body, deform)


@pytest.mark.parametrize("deform", [1e-6, 0.02])
@pytest.mark.parametrize("model", MODELS)
def test_so_does_what_has_no_mean_forces_of_its_own(model, deform):
    closes(halfway(fd.Case(structure(model)).body), deform)


def closes(body: Assembly, deform: float) -> None:
    """Work and energies of a step that turns and deforms are the same."""
    q0, q1 = states(body, deform, 0.1)
    before = body.energies(q0).sum()
    change = body.energies(q1).sum() - before
    work = mean_forces(body, q0, q1) @ (q1 - q0)
    assert work == pytest.approx(change, abs=4e-13 * (before + abs(change)))


@pytest.mark.parametrize(("model", "own"), [*product(ELASTIC, (True,)), *product(MODELS, (False,))])
def test_small_steps_give_the_force_in_the_middle(model, own):
    """The difference falls with the square of the step, and nothing breaks without one."""
    body = fd.Case(structure(model), FREE + GROUNDED).body
    body = body if own else halfway(body)
    rng = np.random.default_rng(5)
    middle, step = 0.02 * rng.standard_normal(body.size), rng.standard_normal(body.size)
    sizes, errors = np.array([4e-3, 2e-3, 1e-3]), []
    for h in sizes:
        found = mean_forces(body, middle - h * step, middle + h * step)
        errors.append(np.abs(found - body.internal(middle)).max())
    assert observed_order(sizes, errors) == pytest.approx(2.0, abs=0.1)
    still, scale = body.internal(middle), np.abs(body.internal(middle)).max()
    np.testing.assert_allclose(mean_forces(body, middle, middle), still, atol=1e-12 * scale)
    near = mean_forces(body, middle, middle * (1.0 + 1e-15))
    np.testing.assert_allclose(near, still, atol=1e-9 * scale)


@pytest.mark.parametrize(
    ("model", "law"), [*product(MODELS, ("elastic", *LAWS)), *product(OTHER_LAWS, ("elastic",))]
)
def test_the_tangent_is_the_derivative_to_first_order(model, law):
    made = structure(model, fold_law=LAWS[law]) if law in LAWS else structure(model)
    case = fd.Case(made, FREE + GROUNDED)
    body = remembering(case) if law in LAWS else case.body
    rng, blocks = np.random.default_rng(7), body.blocks()
    q0, step, along = rng.standard_normal((3, body.size)) * [[0.02], [1.0], [1.0]]
    sizes, errors = np.array([4e-3, 2e-3, 1e-3]), []
    out, pattern = np.zeros((len(blocks.pattern.indices), 3, 3)), blocks.pattern
    for size in sizes:
        q1 = q0 + size * step
        mean_forces(body, q0, q1)
        u0, u1 = body.in_rows(q0), body.in_rows(q1)
        blocks.put_mean(body, pattern, u0, u1, body.angles(q0), u1, True, out)
        row = np.repeat(np.arange(body.rows), np.diff(pattern.indptr))
        found, direction = np.zeros((body.rows, 3)), body.in_rows(along)
        np.add.at(found, row, np.einsum("kij,kj->ki", out, direction[pattern.indices]))
        ends = [mean_forces(body, q0, q1 + sign * 1e-6 * along) for sign in (1.0, -1.0)]
        wanted = (ends[0] - ends[1]) / 2e-6
        error = found.ravel()[: body.size] - wanted
        errors.append(np.abs(error).max() / np.abs(wanted).max())
    assert errors[-1] < 1e-2
    assert observed_order(sizes, errors) > 0.8


def remembering(case: fd.Case) -> Assembly:
    """The body of a motion, whose creases remember."""
    return pack(case, 1.0).body


@pytest.mark.parametrize(
    ("model", "law", "deform", "h"), in_pairs(MODELS, LAWS, [1e-9, 1e-4, 0.02], [1e-6, 0.01, 100.0])
)
def test_creases_that_remember_do_the_work_that_is_stored_and_lost(model, law, deform, h):
    """However far and long the step; without resultant and moment."""
    damping = fd.CreaseDamping(0.01) if model == "plate" else ()
    body = remembering(fd.Case(structure(model, fold_law=LAWS[law]), FREE, damping=damping))
    memory, powers = body.term(HingeMemory), np.zeros(2)
    q0, q1 = states(body, deform, 0.3)
    memory.start(q0)
    before = body.energies(q0).sum()
    force = mean_forces(body, q0, q1, h, powers)
    lost, change = memory.own.lost[1] + h * powers[1], body.energies(q1).sum() - before
    assert force @ (q1 - q0) == pytest.approx(change + lost, abs=4e-13 * (before + abs(change)))
    assert lost > -1e-14 * before
    assert_no_resultant(body, force, q0, q1)


class DragContext(NamedTuple):
    coefficient: float  # N s/m
    rows: int


@forces
def _drag(own, u, v, t, force, powers):
    speed, out = rows_at(v, own.rows), rows_at(force, own.rows)
    for c in range(3):
        out[0, c] += own.coefficient * speed[0, c]
        numbers_at(powers, 2)[1] += own.coefficient * speed[0, c] ** 2


class Drag(Term):
    """Drag of the first node."""

    without = ("stiffness",)

    def __init__(self, coefficient: float) -> None:
        self.coefficient = coefficient

    def compiled(self, part: Any, kept: Any, group: int) -> CompiledTerm:
        own = DragContext(self.coefficient, int(part.own[1]))
        return CompiledTerm(Context(own), {FORCES: _drag})


class Dragged(Net):
    """Points on springs, of which the first is slowed down."""

    @cached_property
    def body(self) -> Assembly:
        return Assembly(super().body.sheet, Drag(0.3))


def thrown(kind: type[Net]) -> Any:
    """A point on six springs that flies to and fro."""
    points, ends = np.vstack([np.zeros(3), np.eye(3), -np.eye(3)]), [(0, k) for k in range(1, 7)]
    net = kind(points, np.array(ends), np.full(6, 50.0), np.full(7, 0.2))
    case, v = fd.Case(net, [fd.Fix(range(1, 7))]), np.zeros((7, 3))
    v[0] = 8.0, 3.0, -5.0
    start = fd.State(velocity=v)
    return fd.simulate(case, 20.0, method="energy_momentum", dt=0.02, every_steps=50, initial=start)


@pytest.mark.matrix
def test_a_sheet_of_ones_own_keeps_its_energy():
    """Springs of another package, with nothing but forces and energies."""
    motion = thrown(Net)
    total = (motion.kinetic + motion.strain_springs).to_numpy()
    assert np.ptp(motion.strain_springs.to_numpy()) > 0.3 * total[0]
    assert np.ptp(total) < 1e-9 * total[0]


@pytest.mark.matrix
def test_the_balance_closes_with_a_term_that_dissipates():
    motion = thrown(Dragged)
    assert float(motion.dissipated[-1]) > 0.99 * float(motion.kinetic[0])
    assert motion.attrs["energy_error"] < 1e-9


@pytest.mark.parametrize(("turn", "order"), [(0.0, 3.0), (0.7, 2.0)])
def test_gradient_of_the_dihedral_needs_little_help(turn, order):
    """What is made up along the deformation is of third order in it, of second with a rotation."""
    x0 = np.array([[0.0, 0, 0], [1.0, 0, 0], [0.4, 0.9, 0.3], [0.6, -0.8, 0.2]])
    deform = np.random.default_rng(7).standard_normal((4, 3))
    rotation = Rotation.from_rotvec(turn * np.array([0.48, -0.6, 0.64])).as_matrix()
    rows = np.array([[0, 1, 2, 3]], np.uint32)
    sizes, missing = np.array([1e-2, 5e-3, 2.5e-3]), []
    for size in sizes:
        x1 = (x0 + size * deform) @ rotation.T
        turned = float(angles(x1, rows)[0] - angles(x0, rows)[0])
        points, plain, gradient = (np.empty((4, 3)) for _ in range(3))
        mean = 0.5 * (x0 + x1)
        discrete_gradient(mean, x1 - x0, turned, points, plain, gradient)
        assert (gradient * (x1 - x0)).sum() == pytest.approx(turned, abs=1e-14)
        assert np.abs(np.cross(mean, gradient).sum(axis=0)).max() < 1e-13
        assert np.abs(gradient.sum(axis=0)).max() < 1e-13
        # points = A (mean about its center): without the correction the gradient is A^-1 plain
        stretch = np.linalg.lstsq(mean - mean.mean(axis=0), points, rcond=None)[0].T
        bare = plain @ np.linalg.inv(stretch).T
        missing.append(turned - (bare * (x1 - x0)).sum())
    assert observed_order(sizes, missing) == pytest.approx(order, abs=0.2)


def test_mean_values_are_quotients():
    """Closed forms: linear laws give the mean stress and moment, whatever the change."""
    code, address = 0, np.zeros(3, np.int64)
    for x, change in ((0.1, 0.3), (-0.2, 0.5), (0.4, 1e-14), (0.0, 0.0)):
        stress, slope = mean_stress(code, address, x, change)
        assert stress == pytest.approx(0.5 * x + 0.5 * change, rel=1e-12)
        assert slope == pytest.approx(0.5)
        p = np.zeros(4)
        moment, slope = mean_moment(code, address, p, 1.0, 1.0, 1.0 + x, change)
        assert moment == pytest.approx(x + 0.5 * change, rel=1e-12)
        assert slope == pytest.approx(0.5)
    # superlinear through its rest angle: (3/7)(b^(7/3) - a^(7/3)) / (a + b)
    moment, _ = mean_moment(1, address, np.zeros(4), 1.0, 1.0, 0.9, 0.3)
    assert moment == pytest.approx(3 / 7 * (0.2 ** (7 / 3) - 0.1 ** (7 / 3)) / 0.3, rel=1e-12)
