"""Added mass: published values of flat plates, and what holds for every sheet in every state."""

import numpy as np
import pytest

import foldyn as fd
from foldyn.cases.added_mass import fluid_at
from foldyn.errors import InputError
from foldyn.mechanics.air.added_mass import caught, flow_of

SHEET = fd.Sheet(1e6, 0.25, 1e-3, density=1000.0)
WATER = 998.0


def plates(*corners):
    faces = [tuple(range(4 * k, 4 * k + 4)) for k in range(len(corners))]
    return fd.discretize(fd.Pattern(np.concatenate(corners), faces), SHEET, preset="plate")


def rectangle(a, b, height=0.0, aside=0.0):
    corners = np.array([(0, 0, 0), (a, 0, 0), (a, b, 0), (0, b, 0)], float)
    return np.add(corners, [aside, 0.5 * aside, height])


def miura(cells=(2, 1), **more):
    return fd.patterns.miura(cells=cells, a=1.0, b=1.3, panel_angle=70, dihedral=110, **more)


def added(structure, resolution=4, density=1.0, **more):
    return fd.Case(structure, air=fd.Air(density, resolution=resolution, **more)).added_mass()


def along(structure, direction):
    return np.tile(np.asarray(direction, float), len(structure.nodes))


def heave(structure, resolution):
    z = along(structure, (0, 0, 1))
    return z @ (added(structure, resolution) @ z)


# ------------------------------------------------------------------ published values
@pytest.mark.parametrize(
    ("ratio", "published"), [(1.0, 0.579), (2.0, 0.757)], ids=["square", "twice as long"]
)
def test_rectangles_have_the_published_mass_with_400_elements(ratio, published):
    """rho pi/4 a^2 b times 0.579 and 0.757 (DNV-RP-C205, appendix D, rectangular plates)."""
    plate = plates(rectangle(1.0, ratio))
    found = heave(plate, 20) / (np.pi / 4 * ratio)
    assert found == pytest.approx(published, rel=0.01)
    coarse, middle = (heave(plate, n) / (np.pi / 4 * ratio) for n in (8, 12))
    order = np.log((published - coarse) / (published - middle)) / np.log(1.5)
    assert 1.7 < order < 2.3
    limit = found + (found - middle) / ((20 / 12) ** 2 - 1)
    assert limit == pytest.approx(published, rel=2e-3)


@pytest.mark.parametrize(("ratio", "published"), [(4.0, 0.872), (10.0, 0.947)])
def test_long_rectangles_have_the_published_mass(ratio, published):
    """The same table; elements are as long as the plate."""
    found = heave(plates(rectangle(1.0, ratio)), 20) / (np.pi / 4 * ratio)
    assert found == pytest.approx(published, rel=0.006)


def disk(n):
    """Triangles of a graded square of n x n elements drawn into a circle."""
    s = -np.cos(np.pi * np.arange(n + 1) / n)
    x, y = np.meshgrid(s, s, indexing="ij")
    points = np.stack([x * np.sqrt(1 - y**2 / 2), y * np.sqrt(1 - x**2 / 2), 0 * x], axis=-1)
    number = np.arange((n + 1) ** 2).reshape(n + 1, n + 1)
    a, b, c, d = number[:-1, :-1], number[1:, :-1], number[1:, 1:], number[:-1, 1:]
    odd = (np.add.outer(np.arange(n), np.arange(n)) % 2).astype(bool)[..., None]
    one = np.where(odd, np.stack([a, b, c], -1), np.stack([a, b, d], -1))
    two = np.where(odd, np.stack([a, c, d], -1), np.stack([b, c, d], -1))
    unknown = np.full((n + 1, n + 1), -1)
    unknown[1:-1, 1:-1] = np.arange((n - 1) ** 2).reshape(n - 1, n - 1)
    return points.reshape(-1, 3), np.concatenate([one, two]).reshape(-1, 3), unknown.ravel()


def test_a_disk_has_the_mass_of_lamb_with_400_elements():
    """8/3 rho r^3 (Lamb, Hydrodynamics, section 102)."""
    found = []
    for n in (8, 12, 20):
        mesh = disk(n)
        push = caught(*mesh).sum(axis=1)
        found.append(push @ (flow_of(*mesh) @ push) / (8 / 3))
    assert found[-1] == pytest.approx(1.0, abs=0.01)
    assert np.log((1 - found[0]) / (1 - found[1])) / np.log(1.5) == pytest.approx(2.0, abs=0.25)


@pytest.mark.matrix
def test_plates_close_to_each_other_squeeze_the_fluid_between_them():
    """In a narrow gap h the fluid has the energy of torsion, 0.1406 rho a^4 / 2h for speeds 1, -1.

    u = grad p / h with lap p = -2, whose integral is half the torsion constant of the square.
    """
    found = []
    for gap in (0.1, 0.05):
        pair = plates(rectangle(1, 1), rectangle(1, 1, gap))
        move = along(pair, (0, 0, 1)) * np.where(pair.nodes[:, 2] > gap / 2, 1.0, -1.0).repeat(3)
        found.append(move @ (added(pair, 12) @ move))
    assert found[1] - found[0] == pytest.approx(0.1406 * (1 / 0.05 - 1 / 0.1), rel=0.06)


def vortex_rings(pattern, n):
    """Added mass (3, 3) of translations by constant doublets: no flow through centers of rings."""
    s = np.linspace(0.0, 1.0, n + 1)
    u, v = np.meshgrid(s, s, indexing="ij")
    shape = np.stack([(1 - u) * (1 - v), u * (1 - v), u * v, (1 - u) * v], axis=-1)
    grids = shape @ pattern.vertices[np.array(pattern.faces)][:, None]
    sides = grids[:, :-1, :-1], grids[:, 1:, :-1], grids[:, 1:, 1:], grids[:, :-1, 1:]
    quads = np.stack(sides, axis=3).reshape(-1, 4, 3)
    center = quads.mean(axis=1)
    normal = 0.5 * np.cross(quads[:, 2] - quads[:, 0], quads[:, 3] - quads[:, 1])
    area = np.linalg.norm(normal, axis=1)
    normal /= area[:, None]
    through = 0.0
    for k in range(4):
        one, two = center[:, None] - quads[:, k], center[:, None] - quads[:, (k + 1) % 4]
        a, b = np.linalg.norm(one, axis=2), np.linalg.norm(two, axis=2)
        velocity = (
            np.cross(one, two) * ((a + b) / (a * b * (a * b + (one * two).sum(2))))[..., None]
        )
        through = through + np.einsum("ijk,ik->ij", velocity, normal) / (4 * np.pi)
    found = normal.T @ (area[:, None] * np.linalg.solve(through, normal))
    return 0.5 * (found + found.T)


@pytest.mark.matrix
def test_a_folded_sheet_has_the_mass_of_another_method():
    """Constant doublets and collocation, with an error that falls like the size of the rings."""
    pattern = miura(cells=(1, 1))
    counts = 4, 6, 9
    other = np.array([vortex_rings(pattern, n) for n in counts]).reshape(3, 9)
    expected = np.polyfit(1.0 / np.array(counts), other, 2)[-1].reshape(3, 3)
    structure = fd.discretize(pattern, SHEET, preset="plate")
    unit = np.tile(np.eye(3), (len(structure.nodes), 1))
    coarse, fine = (unit.T @ (added(structure, n) @ unit) for n in (8, 12))
    found = fine + (fine - coarse) / (1.5**2 - 1)
    np.testing.assert_allclose(found, expected, rtol=0, atol=5e-3 * found.max())


# ------------------------------------------------------------------ every sheet
@pytest.fixture(scope="module")
def folded():
    return fd.discretize(miura(), SHEET, preset="plate")


def test_it_is_symmetric_and_positive_and_its_forms_agree(folded):
    operator = added(folded, density=WATER)
    dense = operator.todense()
    np.testing.assert_array_equal(dense, dense.T)
    values = np.linalg.eigvalsh(dense)
    assert values[0] > -1e-12 * values[-1]
    assert values[-1] > 0.0
    x = np.random.default_rng(1).standard_normal((dense.shape[0], 2))
    np.testing.assert_allclose(operator @ x, dense @ x, rtol=0, atol=1e-12 * np.abs(dense).max())
    np.testing.assert_allclose(operator.diagonal(), dense.diagonal(), rtol=1e-12)
    np.linalg.cholesky(np.asarray(operator.flow))


def test_it_turns_shifts_scales_and_renumbers_with_the_sheet(folded):
    """Cubes of lengths; the flow has no other length."""
    pattern, dense = folded.pattern, added(folded).todense()
    turn = np.linalg.qr(np.random.default_rng(3).standard_normal((3, 3)))[0]
    turn *= np.linalg.det(turn)
    order = np.random.default_rng(5).permutation(len(pattern.vertices))
    place = np.argsort(order)
    faces = [tuple(place[[*face[1:], face[0]]].tolist()) for face in reversed(pattern.faces)]
    other = fd.Pattern(3.0 * pattern.vertices[order] @ turn.T + [50.0, -20.0, 7.0], faces)
    moved = fd.discretize(other, SHEET, preset="plate")
    found = added(moved).todense()
    count = len(faces)
    node = np.append(order, len(order) + count - 1 - np.arange(count))  # centers, in panel order
    dofs = (3 * node[:, None] + np.arange(3)).ravel()
    spin = np.kron(np.eye(len(node)), turn)
    expected = 27.0 * spin @ dense[np.ix_(dofs, dofs)] @ spin.T
    np.testing.assert_allclose(found, expected, rtol=0, atol=1e-9 * np.abs(expected).max())


def test_rounding_does_not_choose_how_regular_grids_are_integrated():
    """Pairs of elements stand at the distance at which another rule takes over."""
    pattern = fd.patterns.miura(cells=(2, 1), a=0.03, b=0.03, panel_angle=60, dihedral=100)
    found = [
        fd.Case(
            fd.discretize(
                fd.Pattern(pattern.vertices + shift, pattern.faces), SHEET, preset="plate"
            ),
            air=fd.Air(resolution=2),
        ).added_mass().todense()
        for shift in (0.0, [1.0, 2.0, 3.0])
    ]  # fmt: skip
    np.testing.assert_allclose(*found, rtol=0, atol=1e-11 * np.abs(found[0]).max())


def test_a_state_moves_the_elements_as_a_pattern_that_is_folded_so(folded):
    """Panels bend in no rigid folding, so both have the same elements."""
    flatter = fd.patterns.miura(cells=(2, 1), a=1.0, b=1.3, panel_angle=70, dihedral=130)
    other = fd.discretize(flatter, SHEET, preset="plate")
    case = fd.Case(folded, air=fd.Air())
    found = case.added_mass(fd.State(displacement=other.nodes - folded.nodes))
    expected = added(other, density=1.204).todense()
    np.testing.assert_allclose(found.todense(), expected, rtol=0, atol=1e-9 * expected.max())


def test_shells_and_bars_move_the_same_fluid():
    pattern = miura()
    masses = []
    for structure in (
        fd.discretize(pattern, SHEET, preset="plate"),
        fd.shell(pattern, SHEET, divisions=3),
    ):
        operator = added(structure)
        unit = np.stack([along(structure, row) for row in np.eye(3)], axis=1)
        masses.append(unit.T @ (operator @ unit))
    np.testing.assert_allclose(*masses, rtol=1e-3, atol=1e-6)


@pytest.mark.matrix
def test_panels_of_any_number_of_corners_have_elements():
    """A house is the same however it is cut into panels, to the error of the grid."""
    house = np.array([(0, 0), (1, 0), (1, 1), (0.5, 1.5), (0, 1)], float)
    cuts = [(0, 1, 2, 3, 4)], [(0, 1, 2, 4), (4, 2, 3)], [(0, 1, 2), (0, 2, 4), (4, 2, 3)]
    found = [
        heave(fd.discretize(fd.Pattern(house, cut), SHEET, preset="plate"), 12) for cut in cuts
    ]
    np.testing.assert_allclose(found, found[0], rtol=0.01)


def test_far_apart_panels_are_each_alone():
    """With "local" panels move fluid by themselves, as they do far from each other."""
    near, far = (plates(rectangle(1, 1), rectangle(1, 1, gap)) for gap in (0.5, 1e3))
    z = along(far, (0, 0, 1))
    alone = 2 * heave(plates(rectangle(1, 1)), 8)
    assert z @ (added(far, 8) @ z) == pytest.approx(alone, rel=1e-6)
    for pair in (near, far):
        assert z @ (added(pair, 8, added_mass="local") @ z) == pytest.approx(alone, rel=1e-9)
    assert z @ (added(near, 8) @ z) < 0.9 * alone  # they shelter each other


def test_the_energy_follows_normals(folded):
    """`fluid_at` keeps what is frozen, and `on` the normals of a turned sheet."""
    fluid = fluid_at(fd.Case(folded, air=fd.Air(1.0)), np.zeros_like(folded.nodes))
    turn = np.array([[0, -1, 0], [1, 0, 0], [0, 0, 1.0]])
    x = along(folded, (1, 0, 0))
    y = along(folded, (0, 1, 0))
    here, there = fluid.on(folded.nodes), fluid.on(folded.nodes @ turn.T)
    assert y @ (there @ y) == pytest.approx(x @ (here @ x), rel=1e-12)


# ------------------------------------------------------------------ refusals
def test_panels_that_lie_on_each_other_are_refused():
    for gap in (0.0, 0.01):
        with pytest.raises(InputError, match=r"air: panels 0 and 1 are .* m apart"):
            added(plates(rectangle(1, 1), rectangle(1, 1, gap, 0.2)), 8)
    added(plates(rectangle(1, 1), rectangle(1, 1, 0.2, 0.2)), 8)


def test_a_fold_may_close_to_a_degree_but_not_altogether():
    half = fd.patterns.simple_fold(a=1.0, b=1.0, dihedral=40)
    s = fd.discretize(half, SHEET, preset="plate")
    case = fd.Case(s, air=fd.Air(1.0))
    for degrees, refused in ((1.0, False), (0.05, True)):
        flat = fd.patterns.simple_fold(a=1.0, b=1.0, dihedral=degrees)
        closed = fd.discretize(flat, SHEET, preset="plate").nodes
        state = fd.State(displacement=closed - s.nodes)
        if refused:
            with pytest.raises(InputError, match="panels 0 and 1"):
                case.added_mass(state)
        else:
            case.added_mass(state)


def test_sheets_without_a_flow_are_refused(folded):
    with pytest.raises(InputError, match="the case has no added mass"):
        fd.Case(folded).added_mass()
    with pytest.raises(InputError, match="state: got ndarray"):
        fd.Case(folded, air=fd.Air()).added_mass(folded.nodes)
    with pytest.raises(InputError, match="convex"):
        added(fd.discretize(fd.Pattern([(0, 0), (2, 0), (0.5, 0.5), (0, 2)], [(0, 1, 2, 3)]),
                            SHEET, scheme="n4b5"))  # fmt: skip
    box = [(0, 0, 0), (1, 0, 0), (0, 1, 0), (0, 0, 1)]
    closed = fd.Pattern(box, [(0, 2, 1), (0, 1, 3), (1, 2, 3), (0, 3, 2)])
    with pytest.raises(InputError, match="encloses a volume"):
        added(fd.discretize(closed, SHEET, preset="plate"))
