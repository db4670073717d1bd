"""Load factors of linear buckling: columns, plates, trusses, and derivatives of the tangent."""

from __future__ import annotations

import sys

import numpy as np
import pytest
from scipy import sparse
from scipy.linalg import eigh
from scipy.spatial.transform import Rotation

import foldyn as fd
from foldyn.algebra.load_factors import Softening
from foldyn.algebra.solvers import factorizer
from foldyn.errors import FoldynWarning, InputError
from foldyn.linear import linearize
from foldyn.linear.buckling import buckling
from foldyn.linear.buckling_base import Base
from foldyn.structures import ModelOptions
from pairwise import in_pairs

LENGTH, WIDTH, THICKNESS, MODULUS = 1.0, 0.1, 1e-3, 1e9
BENDING = MODULUS * WIDTH * THICKNESS**3 / 12.0  # EI of the strip, N m2
EULER = np.pi**2 * BENDING / LENGTH**2


def rectangle(length=LENGTH, width=WIDTH, boards=1):
    """Panels side by side along x."""
    x = np.linspace(0.0, length, boards + 1)
    vertices = [(each, y, 0.0) for y in (0.0, width) for each in x]
    n = boards + 1
    return fd.Pattern(vertices, [(k, k + 1, n + k + 1, n + k) for k in range(boards)])


def at(structure, axis, place):
    """Nodes at a coordinate."""
    return np.flatnonzero(np.abs(structure.nodes[:, axis] - place) < 1e-9)


def pressed(structure, force=1.0, length=LENGTH, way=-1.0):
    """Forces along x, evenly spread over the end at x = length."""
    end = at(structure, 0, length)
    y = structure.nodes[end, 1]
    share = np.where((y < y.min() + 1e-9) | (y > y.max() - 1e-9), 0.5, 1.0)
    forces = force * way * share / share.sum()
    return [fd.Force([int(k)], (each, 0.0, 0.0)) for k, each in zip(end, forces, strict=True)]


def pinned(structure, length=LENGTH):
    """A strip that turns freely at both ends."""
    start, end = at(structure, 0, 0.0), at(structure, 0, length)
    return [fd.Fix(start, "xz"), fd.Fix(start[:1], "y"), fd.Fix(end, "z")]


def strip(divisions=8, loads=None, **options):
    """A strip of a shell, pinned at both ends, under 1 N along x."""
    structure = fd.shell(rectangle(), fd.Sheet(MODULUS, 0.0, THICKNESS), divisions=divisions,
                         **options)  # fmt: skip
    loads = pressed(structure) if loads is None else loads
    return fd.Case(structure, pinned(structure), loads)


# ------------------------------------------------------------------ columns and plates
def test_a_pinned_strip():
    """Euler: n^2 pi^2 EI / L^2, Timoshenko and Gere, Theory of Elastic Stability, section 2.1."""
    errors = []
    for divisions in (8, 16):
        found = buckling(strip(divisions), 3)
        expected = EULER * np.array([1.0, 4.0, 9.0])
        np.testing.assert_allclose(found.load_factor, expected, rtol=0.03 if divisions == 16 else 1)
        errors.append(1.0 - float(found.load_factor[0]) / EULER)
        assert found.attrs["complete"] == found.attrs["positive"] == 3
        assert found.attrs["negative"] == 0
        assert abs(found.attrs["departure"]) < 1e-5
    assert abs(errors[1]) < 0.01
    assert np.log2(errors[0] / errors[1]) == pytest.approx(2.0, abs=0.05)
    shape = found["shape"].values
    np.testing.assert_allclose(np.linalg.norm(shape, axis=2).max(axis=1), 1.0)
    x = strip(16).structure.nodes[:, 0]
    np.testing.assert_allclose(shape[0, :, 2], np.sin(np.pi * x), atol=2e-3)
    assert np.abs(shape[:, :, :2]).max() < 1e-6
    end = at(strip(16).structure, 0, LENGTH)
    shortened = -LENGTH / (MODULUS * WIDTH * THICKNESS)  # m per N
    np.testing.assert_allclose(found["prebuckling"].values[end, 0], shortened, rtol=1e-9)


def test_a_strip_clamped_at_one_end():
    """pi^2 EI / (4 L^2), Timoshenko and Gere, section 2.1."""
    errors = []
    for divisions in (4, 8):
        sheet = fd.Sheet(MODULUS, 0.0, THICKNESS)
        structure = fd.shell(rectangle(), sheet, divisions=divisions, clamped="xmin")
        start = at(structure, 0, 0.0)
        supports = [fd.Fix(start, "xz"), fd.Fix(start[:1], "y")]
        found = buckling(fd.Case(structure, supports, pressed(structure)), 1)
        errors.append(1.0 - float(found.load_factor[0]) / (EULER / 4.0))
    assert abs(errors[1]) < 0.01
    assert np.log2(errors[0] / errors[1]) == pytest.approx(2.0, abs=0.3)


def plate(divisions):
    """A square plate, simply supported on all edges, under 1 N/m along x."""
    sheet = fd.Sheet(MODULUS, 0.3, 0.01)
    structure = fd.shell(rectangle(1.0, 1.0), sheet, divisions=divisions)
    edges = [at(structure, axis, place) for axis in (0, 1) for place in (0.0, 1.0)]
    start, middle = edges[0], at(structure, 1, 0.0)
    supports = [fd.Fix(np.unique(np.concatenate(edges)), "z"), fd.Fix(start, "x")]
    supports.append(fd.Fix([int(middle[np.argmin(structure.nodes[middle, 0])])], "y"))
    return fd.Case(structure, supports, pressed(structure))


def test_a_square_plate():
    """k = 4.00 of pi^2 D / b^2: Timoshenko and Gere, section 9.2."""
    unit = np.pi**2 * MODULUS * 0.01**3 / (12.0 * (1.0 - 0.3**2))
    k = [float(buckling(plate(n), 1).load_factor[0]) / unit for n in (4, 8, 16)]
    errors = 4.0 - np.array(k)
    orders = np.log2(errors[:-1] / errors[1:])
    assert abs(errors[-1]) < 0.05 * 4.0
    assert orders[-1] == pytest.approx(2.0, abs=0.2)


def test_pressed_by_its_supports():
    """A displacement d shortens by EA d / L; forces and displacements buckle at one stress."""
    case = strip()
    end = at(case.structure, 0, LENGTH)
    moved = fd.Case(case.structure, [*pinned(case.structure), fd.Impose(end, "x", -1e-3)])
    factor = float(buckling(moved, 1).load_factor[0])
    force = factor * 1e-3 * MODULUS * WIDTH * THICKNESS / LENGTH
    assert force == pytest.approx(float(buckling(case, 1).load_factor[0]), rel=1e-4)


def test_pressed_by_its_warmth():
    """Between fixed ends E A alpha T presses, although nothing moves along x."""
    structure = strip().structure
    start, end = at(structure, 0, 0.0), at(structure, 0, LENGTH)
    supports = [fd.Fix([*start, *end], "xz"), fd.Fix([*start[:1]], "y")]
    case = fd.Case(structure, supports, [fd.Temperature(1.0, expansion=1e-5)])
    factor = float(buckling(case, 1).load_factor[0])
    force = factor * 1e-5 * MODULUS * WIDTH * THICKNESS
    assert force == pytest.approx(float(buckling(strip(), 1).load_factor[0]), rel=1e-4)


# ------------------------------------------------------------------ trusses
class Truss:
    """Two bars of half span b and height h; the apex moves by x aside and v down.

    With bars linear in Green strain and c = 2 EA / L^3, the tangent at x = 0 is
    c (b^2 - h v + v^2/2) aside and c (h^2 - 3 h v + 3/2 v^2) along the load c (h - v) (2h - v) v/2:
    Crisfield, Non-linear Finite Element Analysis 1, 1991, section 1.2.
    """

    def __init__(self, b, h, EA=1e4):
        self.b, self.h, self.stiffness = b, h, 2.0 * EA / np.hypot(b, h) ** 3
        self.structure = fd.Structure(
            nodes=np.array([[-b, 0, 0], [b, 0, 0], [0, 0, h]], float),
            bars=np.array([[0, 2], [1, 2]]),
            bar_area=np.array([1e-4, 1e-4]),
            sheet=fd.Sheet(EA / 1e-4, 0.3, 0.01),
            options=ModelOptions(bar_law="linear"),
        )

    def case(self, load=-1.0):
        supports = [fd.Fix([0, 1], "xyz"), fd.Fix([2], "y")]
        return fd.Case(self.structure, supports, [fd.Force([2], (0.0, 0.0, load))])

    @property
    def aside(self):
        """Load at which b^2 = h v on the linear path v = P / (c h^2)."""
        return self.stiffness * self.b**2 * self.h

    @property
    def down(self):
        """Load at which h^2 = 3 h v."""
        return self.stiffness * self.h**3 / 3.0

    @property
    def departure(self):
        """Left of the tangent aside, at the load `aside`, with v corrected to second order."""
        v, h = self.b**2 / self.h, self.h
        carried = 0.5 * self.stiffness * (h - v) * (2.0 * h - v) * v
        v += (self.aside - carried) / (self.stiffness * h**2)
        return 1.0 - (h * v - v**2 / 2.0) / self.b**2


def test_a_high_truss_sways_aside():
    truss = Truss(b=0.2, h=2.0)
    found = buckling(truss.case(), 2)
    np.testing.assert_allclose(found.load_factor, [truss.aside], rtol=1e-9)
    np.testing.assert_allclose(found["shape"][0, 2], [1.0, 0.0, 0.0], atol=1e-12)
    assert found.attrs["departure"] == pytest.approx(truss.departure, rel=1e-6)
    assert 1e-3 < abs(truss.departure) < 0.03


def test_a_truss_with_two_factors():
    truss = Truss(b=1.0, h=2.0)
    with pytest.warns(FoldynWarning, match="displacements are not small"):
        found = buckling(truss.case(), 2)
    np.testing.assert_allclose(found.load_factor, [truss.aside, truss.down], rtol=1e-9)
    np.testing.assert_allclose(found["shape"][0, 2], [1.0, 0.0, 0.0], atol=1e-12)
    np.testing.assert_allclose(found["shape"][1, 2], [0.0, 0.0, 1.0], atol=1e-12)


def test_a_shallow_truss_is_told():
    """It snaps; the linear path is far off there, and that to the other factor means nothing."""
    truss = Truss(b=1.0, h=0.1)
    with pytest.warns(FoldynWarning, match="displacements are not small"):
        found = buckling(truss.case(), 2)
    np.testing.assert_allclose(found.load_factor, [truss.down], rtol=1e-9)
    v = (1.0 - np.sqrt(1.0 / 3.0)) * truss.h  # of the limit point
    limit = 0.5 * truss.stiffness * (truss.h - v) * (2.0 * truss.h - v) * v
    assert truss.down / limit == pytest.approx(1.732, abs=1e-3)  # the error that it warns of


def test_a_path_finds_the_same():
    """Where the path is straight, its first critical point is the first load factor."""
    case = strip(4)
    factor = float(buckling(case, 1).load_factor[0])
    with pytest.warns(FoldynWarning, match="stability"):
        path = fd.trace(case, "arc_length", load_factors=[0.0, 1.2 * factor],
                        first_step=0.4 * factor)  # fmt: skip
    critical = path.load_factor.values[path.point.values == "bifurcation"]
    assert critical[0] == pytest.approx(factor, rel=1e-4)
    truss = Truss(b=0.2, h=2.0)
    with pytest.warns(FoldynWarning, match="stability"):
        path = fd.trace(truss.case(), "arc_length", load_factors=[0.0, 1.1 * truss.aside],
                        first_step=0.3 * truss.aside)  # fmt: skip
    critical = path.load_factor.values[path.point.values == "bifurcation"]
    found = buckling(truss.case(), 1)
    assert critical[0] == pytest.approx(float(found.load_factor[0]), rel=0.02)
    error = critical[0] / float(found.load_factor[0]) - 1.0
    assert found.attrs["departure"] == pytest.approx(error, rel=0.1)


# ------------------------------------------------------------------ scales, signs, preloads
def test_twice_the_loads_take_half_the_factor():
    one = buckling(strip(), 2)
    for scale in (2.0, 1e-6, 1e6):
        other = buckling(strip(loads=pressed(strip().structure, scale)), 2)
        np.testing.assert_allclose(scale * other.load_factor, one.load_factor, rtol=1e-6)
        np.testing.assert_allclose(other["shape"], one["shape"], atol=1e-5)


def test_a_reversed_load_has_negative_factors():
    push = buckling(strip(), 2)
    pull = buckling(strip(loads=pressed(strip().structure, way=1.0)), 2)
    assert (pull.attrs["positive"], pull.attrs["negative"]) == (0, 2)
    np.testing.assert_allclose(pull.load_factor, -push.load_factor, rtol=1e-9)


def test_shear_buckles_either_way():
    """A square in shear: k = 9.34 of pi^2 D / b^2, Timoshenko and Gere, section 9.7."""
    found = [sheared(divisions) for divisions in (8, 16)]
    for each in found:
        assert (each.attrs["positive"], each.attrs["negative"]) == (2, 2)
    unit = np.pi**2 * MODULUS * 0.01**3 / (12.0 * (1.0 - 0.3**2))
    k = np.array([each.load_factor.values for each in found]) / unit
    np.testing.assert_allclose(k[:, 0], -k[:, 2], rtol=1e-3)
    assert (4.0 * k[1, 0] - k[0, 0]) / 3.0 == pytest.approx(9.34, rel=0.02)  # errors of order 2


def sheared(divisions):
    case = plate(divisions)
    nodes = case.structure.nodes
    ends = [(at(case.structure, along, place), across, 2.0 * place - 1.0)
            for along, across in ((0, 1), (1, 0)) for place in (1.0, 0.0)]  # fmt: skip
    loads = []
    rim = case.supports[0]
    corner = int(np.flatnonzero((nodes[:, :2] < 1e-9).all(axis=1))[0])
    beside = int(np.flatnonzero((nodes[:, 0] > 1 - 1e-9) & (nodes[:, 1] < 1e-9))[0])
    held = {(corner, 0), (corner, 1), (beside, 1)}  # supports give the force there
    for end, axis, sign in ends:
        along = nodes[end, axis]
        share = np.where((along < 1e-9) | (along > 1.0 - 1e-9), 0.5, 1.0)
        for k, each in zip(end, sign * share / share.sum(), strict=True):
            if (int(k), axis) not in held:
                loads.append(fd.Force([int(k)], np.eye(3)[axis] * each))
    held = [rim, fd.Fix([corner], "xy"), fd.Fix([beside], "y")]
    return buckling(fd.Case(case.structure, held, loads), 2)


def test_a_preload_takes_its_share():
    case = strip()
    whole = float(buckling(case, 1).load_factor[0])
    for share in (0.5, -1.0):
        preload = pressed(case.structure, share * whole)
        found = buckling(case, 1, preload=preload)
        assert float(found.load_factor[0]) == pytest.approx((1.0 - share) * whole, rel=1e-4)
        end = at(case.structure, 0, LENGTH)
        shortened = -share * whole * LENGTH / (MODULUS * WIDTH * THICKNESS)
        np.testing.assert_allclose(found["displacement"][end, 0], shortened, rtol=1e-4)
        assert found.attrs["state"] == "equilibrium"
        assert list(np.ravel(found.attrs["constant"])) == list(range(len(preload)))
    truss = Truss(b=0.2, h=2.0)  # one load, by itself
    found = buckling(truss.case(), 1, preload=fd.Force([2], (0.0, 0.0, -0.3 * truss.aside)))
    assert float(found.load_factor[0]) == pytest.approx(0.7 * truss.aside, rel=0.01)
    with pytest.raises(InputError, match="buckled already"):
        buckling(case, 1, preload=pressed(case.structure, 1.5 * whole))


# ------------------------------------------------------------------ all models
CREASE = 0.3  # N m/rad


def two_links(preset):
    """Two panels 1 m long that turn about a crease, pressed along x."""
    sheet = fd.Sheet(1e11, 0.0, 0.02)
    pattern = rectangle(2.0, 1.0, boards=2)
    given = {"crease_stiffness": CREASE}
    if preset == "shell":
        structure = fd.shell(pattern, sheet, divisions=2, **given)
    else:
        structure = fd.discretize(pattern, sheet, preset=preset, **given)
    return fd.Case(structure, pinned(structure, 2.0), pressed(structure, length=2.0))


@pytest.mark.parametrize("preset", ["n5b8e", "plate", "shell"])
def test_two_links_with_a_spring(preset):
    """Rigid links turn by a each: k (2 a)^2 / 2 = P L a^2 / 2, so that P = 4 k / L."""
    found = buckling(two_links(preset), 1)
    assert float(found.load_factor[0]) == pytest.approx(4.0 * CREASE / 2.0, rel=1e-3)


@pytest.mark.filterwarnings("ignore:at the load factor:foldyn.errors.FoldynWarning")
@pytest.mark.parametrize("preset", ["herkal", "merlin2"])
def test_bends_without_a_slope(preset):
    """Refused while they stand at rest; a preload that turns them gives them a slope."""
    pattern = fd.Pattern([(0, 0, 0), (1, 0, 0), (1, 1, 0), (0, 1, 0)], [(0, 1, 2, 3)])
    structure = fd.discretize(pattern, fd.Sheet(1e6, 0.3, 0.03, 900.0), preset=preset)
    preload, load = fd.Force([1], (0.0, 0.0, 0.01)), fd.Force([1], (-1.0, 1.0, 0.0))
    held = [fd.Fix([0, 2, 3])]
    with pytest.raises(InputError, match="superlinear law stand at their rest angle"):
        buckling(fd.Case(structure, held, [load]))
    found = buckling(fd.Case(structure, held, [load]), 2, preload=preload)
    both = fd.Case(structure, held, [preload, load])
    expected = of_two_equilibria(both, found, constant=[0])
    np.testing.assert_allclose(found.load_factor, expected, rtol=1e-3)


def of_two_equilibria(case, found, **options):
    """The load factors, with K1 from tangents at two equilibria near the base state."""
    step = 1e-3 * float(np.abs(found.load_factor).min())
    paths = [fd.trace(case, load_factors=[each], settings={"tolerance": 1e-12}, **options)
             for each in (step, -step, 0.0)]  # fmt: skip
    ahead, behind, base = (
        linearize(case, fd.initial_state(path), load_factor=factor).stiffness.toarray()
        for path, factor in zip(paths, (step, -step, 0.0), strict=True)
    )
    factors = 1.0 / eigh((behind - ahead) / (2.0 * step), base, eigvals_only=True)
    positive = np.sort(factors[factors > 0.0])[: found.attrs["positive"]]
    negative = -np.sort(-factors[factors < 0.0])[: found.attrs["negative"]]
    return np.r_[positive, negative]


def loaded(model, load):
    """A Miura cell under a load of a kind."""
    pattern = fd.patterns.miura(cells=(1, 1), a=1, b=1, panel_angle=60, dihedral=100)
    sheet = fd.Sheet(1e6, 0.25, 0.02, 900.0)
    if model == "shell":
        structure = fd.shell(pattern, sheet, divisions=2)
    else:
        structure = fd.discretize(pattern, sheet, preset=model)
    loads = {
        "force": fd.Force([4], (1.0, -2.0, 1.5)),
        "pressure": fd.Pressure(0.3),
        "moment": fd.CreaseMoment("all", 0.3),
        "gravity": fd.Gravity((0.0, 0.1, -1.0)),
        "actuation": fd.Actuate("all", 120.0),
        "warmth": fd.Temperature(1.0, expansion=0.01, curvature=0.1),
        "moved": None,
    }
    held = [fd.Fix([0, 6], "xyz"), fd.Fix([2], "z")]
    given = [] if loads[load] is None else [loads[load]]
    moved = [fd.Impose([8], "x", -0.1)] if load == "moved" else []
    return fd.Case(structure, [*held, *moved], given)


KINDS = ("force", "pressure", "moment", "gravity", "actuation", "warmth", "moved")


@pytest.mark.filterwarnings("ignore::foldyn.errors.FoldynWarning")
@pytest.mark.parametrize(("model", "load"), in_pairs(("plate", "n5b8e", "shell"), KINDS))
def test_the_change_is_that_along_the_path(model, load):
    """K1 is the difference of tangents at two equilibria near rest, found by tracing the path."""
    case = loaded(model, load)
    found = buckling(case, 4)
    np.testing.assert_allclose(found.load_factor, of_two_equilibria(case, found), rtol=1e-3)
    assert len(found.load_factor) >= 4


@pytest.mark.filterwarnings("ignore:at the load factor:foldyn.errors.FoldynWarning")
def test_pressure_without_a_potential_is_told():
    with pytest.warns(FoldynWarning, match="not symmetric; load factors take its symmetric part"):
        buckling(loaded("plate", "pressure"), 1)


def test_turned_supports():
    """Held and tied along oblique directions, a strip buckles as along the axes."""
    expected = buckling(strip(), 2)
    turn = Rotation.from_euler("zyx", [20.0, 35.0, -50.0], degrees=True).as_matrix()
    pattern = fd.Pattern(rectangle().vertices @ turn.T, rectangle().faces)
    structure = fd.shell(pattern, fd.Sheet(MODULUS, 0.0, THICKNESS), divisions=8)
    rest = strip().structure
    np.testing.assert_allclose(structure.nodes, rest.nodes @ turn.T, atol=1e-12)
    start, end = at(rest, 0, 0.0), at(rest, 0, LENGTH)
    x, y, z = turn.T
    supports = [fd.Fix(start, direction=x), fd.Fix([*start, *end], direction=z),
                fd.Fix(start[:1], direction=y)]  # fmt: skip
    loads = [fd.Force(one.nodes, turn @ one.vector) for one in pressed(rest)]
    found = buckling(fd.Case(structure, supports, loads), 2)
    np.testing.assert_allclose(found.load_factor, expected.load_factor, rtol=1e-6)
    shape = expected["shape"].values @ turn.T
    for one, other in zip(found["shape"].values, shape, strict=True):
        assert abs((one * other).sum()) == pytest.approx((one**2).sum(), rel=1e-6)


def test_a_folded_tube_is_told():
    """Its panels turn from the start: the path buckles at 30.5 (docs/buckling.md)."""
    pattern = fd.patterns.kresling(sides=6, radius=0.05, height=0.04, twist=30, storeys=2)
    structure = fd.discretize(pattern, fd.Sheet(2e9, 0.3, 0.25e-3, 900.0), preset="n5b8e")
    load = fd.Force("zmax", (0.0, 0.0, -1.0 / 6.0))
    with pytest.warns(FoldynWarning, match=r"0\.39 of the shape's stiffness is left"):
        found = buckling(fd.Case(structure, [fd.Fix("zmin")], [load]), 1)
    assert float(found.load_factor[0]) == pytest.approx(14.33, rel=1e-3)


def test_springs_alone_have_no_factor():
    """Springs along fixed directions keep their stiffness."""
    structure = fd.Structure(
        nodes=np.array([[0, 0, 0], [1, 0, 0], [0, 0, 1]], float),
        bars=np.array([[0, 1]]), bar_area=np.array([1e-4]), sheet=fd.Sheet(1e8, 0.3, 0.01),
        options=ModelOptions(bar_law="linear"),
    )  # fmt: skip
    springs = [fd.Spring(10.0, nodes=[2], direction=each) for each in "xyz"]
    case = fd.Case(structure, [fd.Fix([0, 1]), *springs], [fd.Force([2], (0.0, 0.0, -1.0))])
    with pytest.warns(FoldynWarning, match="no load factor was found"):
        found = buckling(case, 1)
    assert found.sizes["mode"] == 0
    np.testing.assert_allclose(found["prebuckling"][2], [0.0, 0.0, -0.1])


# ------------------------------------------------------------------ none missed
def test_no_factor_is_missed():
    """Multiple factors, which Lanczos' method alone does not find."""
    factors = np.repeat([1.0, 2.0, 3.0, -1.5, -4.0], 60)
    stiffness = sparse.csc_array(sparse.diags_array(1.0 + np.arange(300.0) % 7))
    change = sparse.csc_array(-stiffness / factors)
    factorize = factorizer("auto", 300)[1]
    softening = Softening(stiffness, change, factorize(stiffness), factorize, 1.0, 10.0)
    positive, negative = softening.nearest(70)
    np.testing.assert_allclose(positive.values, np.repeat([1.0, 2.0], [60, 10]), rtol=1e-9)
    np.testing.assert_allclose(negative.values, -np.repeat([1.5, 4.0], [60, 10]), rtol=1e-9)
    assert positive.complete >= 60 and negative.complete >= 60
    product = positive.shapes.T @ (stiffness @ positive.shapes)
    np.testing.assert_allclose(product, np.eye(70), atol=1e-8)


def test_large_and_small_problems_agree(monkeypatch):
    few = buckling(strip(4), 3)
    monkeypatch.setattr("foldyn.algebra.load_factors.DENSE", 10)
    np.testing.assert_allclose(buckling(strip(4), 3).load_factor, few.load_factor, rtol=1e-8)


@pytest.mark.filterwarnings("ignore:at the load factor:foldyn.errors.FoldynWarning")
def test_the_difference_is_accurate(monkeypatch):
    """Half and twice the step give the same to 1e-6."""
    cases = [strip(), loaded("n5b8e", "force")]
    ends = []
    for step in (5e-6, 1e-5, 2e-5):
        monkeypatch.setattr(sys.modules[Base.__module__], "STEP", step)
        ends.append([float(buckling(case, 1).load_factor[0]) for case in cases])
    np.testing.assert_allclose(np.array(ends) / ends[1], 1.0, rtol=1e-6)


# ------------------------------------------------------------------ refusals and results
def test_refusals():
    case = strip(2)
    structure, supports, loads = case.structure, case.supports, case.loads
    with pytest.raises(InputError, match="nothing to scale by a factor"):
        buckling(fd.Case(structure, supports))
    with pytest.raises(InputError, match="nothing to scale by a factor"):
        buckling(fd.Case(structure, supports), preload=loads)
    with pytest.raises(InputError, match="no load factor exists"):
        buckling(fd.Case(structure, supports, [fd.Force([1], (0.0, 0.0, 0.0))]))
    with pytest.raises(InputError, match="rotation about x"):
        buckling(fd.Case(structure, [fd.Fix([0], "xyz")], loads))
    with pytest.raises(InputError, match="contact: closes and opens"):
        buckling(fd.Case(structure, supports, loads, contact=fd.Contact()))
    with pytest.raises(InputError, match="air: buckling would leave it out"):
        buckling(fd.Case(structure, supports, loads, air=fd.Air(density=1.2)))
    with pytest.raises(InputError, match="preload"):
        buckling(case, preload=3.0)
    with pytest.raises(InputError, match="count"):
        buckling(case, 0)


def test_the_result_holds_its_case(tmp_path):
    found = buckling(strip(2), 2)
    fd.save(found, tmp_path / "buckling.nc")
    again = fd.load(tmp_path / "buckling.nc")
    np.testing.assert_array_equal(again.load_factor, found.load_factor)
    np.testing.assert_array_equal(buckling(fd.case_of(again), 2).load_factor, found.load_factor)
    assert found["shape"].dims == ("mode", "node", "axis")
    assert found.mode.values.tolist() == [1, 2]
