"""Bands against supercells, closed rings, the derivatives of bands, and homogenized sheets."""

from __future__ import annotations

import numpy as np
import pytest
from cells import SHEET, chain, eigenvalues, kresling, miura, of_ring, squares
from scipy.optimize import brentq

import foldyn as fd
from foldyn.errors import FoldynWarning, InputError
from foldyn.linear.unit_cell import images
from foldyn.patterns.screw import of_twist, translation

RULES = [
    "consistent",
    *(
        pytest.param(rule, marks=pytest.mark.matrix)
        for rule in ("mixed_voronoi", "panel", "centroid")
    ),
]
EXACT = 1e-9  # of the highest eigenvalue


def assert_alike(cell, supercell, counts, states=({}, {}), **options):
    """The eigenvalues of N cells at phase zero are those of one at 2 pi j / N."""
    own = eigenvalues(cell, of_ring(counts), **states[0], **options)
    whole = eigenvalues(supercell, np.zeros((1, len(counts))), **states[1], **options)
    assert len(own) == len(whole)
    np.testing.assert_allclose(own, whole, rtol=0.0, atol=EXACT * whole[-1])


@pytest.mark.matrix
@pytest.mark.parametrize("mass", RULES)
def test_supercells_have_the_waves_of_one_cell(mass):
    assert_alike(miura(mass=mass), miura((2, 2), mass=mass), (2, 2))
    assert_alike(chain(mass=mass), chain(3, mass=mass), (3,))
    assert_alike(kresling(mass=mass), kresling(3, mass=mass), (3,))


def test_supercells_do_so_where_a_cell_is_one_panel():
    assert_alike(squares(), squares(3), (3, 1))


@pytest.mark.matrix
@pytest.mark.parametrize("mass", RULES)
def test_supercells_do_so_in_prestressed_states(mass):
    stretch = np.array([[1.01, 0.004, 0.0], [0.0, 0.99, 0.0], [0.0, 0.0, 1.0]])
    cells = miura(mass=mass), miura((2, 1), mass=mass)
    states = [{"state": fd.linear.relaxed(c, c.vectors @ stretch)} for c in cells]
    assert_alike(*cells, (2, 1), states)
    stressed, free = (eigenvalues(cells[0], [[1.0, 1.0]], **each) for each in (states[0], {}))
    assert np.abs(stressed / free - 1.0).max() > 0.01
    cells = kresling(mass=mass), kresling(2, mass=mass)
    states = [
        {"state": fd.linear.relaxed(c, [fd.Screw("z", n * 32.0, n * 0.0295)])}
        for n, c in enumerate(cells, 1)
    ]
    assert_alike(*cells, (2,), states)


def bending(along, across, height, curvature):
    """Motions that bend a sheet evenly along its first period, about a height (m)."""
    turn = np.array([0.0, curvature * along[0], 0.0])
    twist = np.concatenate([turn, along - np.cross(turn, [0.0, 0.0, height])])
    return [of_twist(twist), translation(across)]


@pytest.mark.matrix
def test_supercells_do_so_on_bent_sheets():
    """Translations that become rotations."""
    cells, states = (miura(), miura((2, 1))), []
    for cell in cells:
        height = cell.case.structure.nodes[:, 2].mean()
        states.append({"state": fd.linear.relaxed(cell, bending(*cell.vectors, height, 5.0))})
    assert_alike(*cells, (2, 1), states)
    b = fd.bands(cells[0], [[0.5, 0.5]], count=1, **states[0])
    assert b.angles.values == pytest.approx([5.0 * cells[0].vectors[0, 0], 0.0])


def pair_of(make, **options):
    """One cell of a sheet, and two beside each other."""
    for counts in ((1, 1), (2, 1)):
        pattern = fd.patterns.miura(cells=counts, a=0.03, b=0.031)
        own = {
            name: value(counts[0]) if callable(value) else value for name, value in options.items()
        }
        yield fd.UnitCell(fd.Case(make(pattern, SHEET, **own)))


@pytest.mark.parametrize(
    "options",
    [
        {"preset": "herkal", "fold_law": "linear"},
        pytest.param({"preset": "n5b8e"}, marks=pytest.mark.matrix),
        {"scheme": "n4b5", "preset": "herkal"},
        {"crease_stiffness": {"zigzag": 0.1, "straight": 0.3}},
        {"rigid": lambda cells: [2 * i for i in range(cells)]},
    ],
    ids=["herkal", "n5b8e", "n4b5", "families", "rigid"],
)
def test_supercells_do_so_with_every_model(options):
    secant = {"secant": 1.0} if options.get("preset") == "herkal" else {}
    assert_alike(*pair_of(fd.discretize, **options), (2, 1), **secant)


def test_supercells_of_shells_have_the_waves_of_one_cell():
    assert_alike(*pair_of(fd.shell, divisions=2), (2, 1))


def with_attachments(counts):
    """A sheet on springs, with masses, rollers and springs across its cells."""
    pattern = fd.patterns.miura(cells=counts, a=0.03, b=0.031)
    step = 2 * counts[1] + 1
    cells = [(i, j) for i in range(counts[0]) for j in range(counts[1])]
    middle = [(2 * i + 1) * step + 2 * j + 1 for i, j in cells]
    across = [(m, (2 * i + 2) * step + 2 * j + 1) for m, (i, j) in zip(middle, cells, strict=True)]
    corners = [2 * i * step + 2 * j for i in range(counts[0] + 1) for j in range(counts[1] + 1)]
    supports = [
        fd.Spring(200.0, nodes=middle, direction="z"),
        fd.Spring(1e3, between=across),
        fd.Fix(corners, axes="y"),
    ]
    masses = [fd.PointMass(middle, 0.003), fd.PointMass(corners, 0.001)]
    return fd.UnitCell(
        fd.Case(fd.discretize(pattern, SHEET, preset="plate"), supports, masses=masses)
    )


def test_supports_and_masses_repeat_and_partners_count_once():
    assert_alike(with_attachments((1, 1)), with_attachments((2, 1)), (2, 1))


def on_turning_supports(storeys):
    """A tower on springs and rollers that turn with its rings."""
    pattern = fd.patterns.kresling(sides=5, radius=0.03, height=0.03, storeys=storeys)
    supports = []
    for ring in range(storeys):
        angle = np.radians(30.0 * ring)
        way = (np.cos(angle), np.sin(angle), 0.3)
        supports.append(fd.Spring(500.0, nodes=[5 * ring], direction=way))
        supports.append(fd.Fix([5 * ring + 2], direction=way))
    return fd.UnitCell(fd.Case(fd.discretize(pattern, SHEET, preset="plate"), supports))


def test_directions_turn_with_a_screw():
    assert_alike(on_turning_supports(1), on_turning_supports(2), (2,))


def zipper(cells):
    """Two tubes whose walls are tied."""
    pattern = fd.patterns.zipper_tubes(cells=cells, a=0.03, b=0.03)
    ties = pattern.custom["foldyn:ties"]
    links = [fd.Link([node], to=corners) for node, corners in ties]
    return fd.UnitCell(fd.Case(fd.discretize(pattern, SHEET, preset="plate"), links))


def riding(storeys):
    """A tower whose rings are plates on three of their corners."""
    pattern = fd.patterns.kresling(sides=6, radius=0.03, height=0.03, storeys=storeys)
    rings = [range(6 * r, 6 * r + 6) for r in range(storeys + 1)]
    links = [fd.Link(list(ring[1::2]), to=list(ring[::2])) for ring in rings]
    return fd.UnitCell(fd.Case(fd.discretize(pattern, SHEET, preset="plate"), links))


@pytest.mark.matrix
def test_links_repeat():
    assert_alike(riding(1), riding(2), (2,))
    assert_alike(zipper(1), zipper(2), (2,))


def test_a_closed_ring_has_the_waves_of_its_sector():
    """One storey of a tower, of which a side is the cell: rotations about the axis."""
    pattern = fd.patterns.kresling(sides=6, radius=0.03, height=0.03)
    whole = fd.modes(fd.Case(fd.discretize(pattern, SHEET, preset="plate")), count=36)
    side = fd.Pattern(pattern.vertices[[0, 1, 6, 7]], [(0, 1, 3), (0, 3, 2)])
    cell = fd.UnitCell(
        fd.Case(fd.discretize(side, SHEET, preset="plate")), screw=fd.Screw("z", 60.0, 0.0)
    )
    own = eigenvalues(cell, of_ring((6,)))
    top = whole.eigenvalue.values[-1]
    np.testing.assert_allclose(own, whole.eigenvalue.values, rtol=0.0, atol=EXACT * top)


@pytest.mark.matrix
def test_a_closed_tube_has_the_waves_of_its_sector():
    """A waterbomb sheet of nine bases that closes: its seam is a crease like the others."""

    def cell(bases, dihedral):
        pattern = fd.patterns.waterbomb(cells=(bases, 2), a=0.03, b=0.02, dihedral=dihedral)
        return fd.UnitCell(fd.Case(fd.discretize(pattern, SHEET, preset="plate")))

    def open_by(dihedral):
        return cell(1, dihedral).motions[0].angle - 40.0

    dihedral = brentq(open_by, 119.0, 120.0, xtol=1e-12)
    sector, tube = cell(1, dihedral), cell(9, dihedral)
    assert (sector.dimensions, tube.dimensions) == (2, 1)
    own = eigenvalues(sector, [(2.0 * np.pi * j / 9, 0.7) for j in range(9)])
    whole = eigenvalues(tube, [[0.7]])
    np.testing.assert_allclose(own, whole, rtol=0.0, atol=EXACT * whole[-1])


@pytest.mark.parametrize(
    ("cell", "phase"), [(miura, (0.7, -0.4)), (kresling, (0.9,)), (chain, (1.3,))]
)
def test_waves_run_both_ways_alike(cell, phase):
    b = fd.bands(cell(), [phase, [-x for x in phase]], count=12, track=False)
    assert b.eigenvalue[0].values == pytest.approx(b.eigenvalue[1].values, rel=1e-11)


@pytest.mark.parametrize(
    ("cell", "phase"), [(miura(), (0.7, 0.4)), (kresling(), (0.9,)), (riding(1), (0.9,))]
)
def test_group_velocities_are_the_derivatives_of_bands(cell, phase):
    step, count = 1e-4, 8
    b = fd.bands(cell, [phase], count=count, group_velocity=True, track=False)
    for j, unit in enumerate(np.eye(cell.dimensions)):
        moved = [np.array(phase) + s * step * unit for s in (-2, -1, 1, 2)]
        omega = np.sqrt(fd.bands(cell, moved, count=count, track=False).eigenvalue.values)
        exact = (omega[0] - 8.0 * omega[1] + 8.0 * omega[2] - omega[3]) / (12.0 * step)
        assert b.slope.values[0, :, j] == pytest.approx(exact, abs=1e-6 * abs(exact).max())
    speeds = np.einsum("bj,ja->ba", b.slope.values[0], cell.vectors)
    assert b.group_velocity.values[0] == pytest.approx(speeds)


def test_shapes_move_partners_by_the_phase():
    cell, phase = miura(), np.array([0.7, 0.4])
    shape = fd.bands(cell, [phase], count=3, shape=True).shape.values[0]
    for pairs, k in zip(cell.case.structure.pattern.periods, phase, strict=True):
        assert shape[:, pairs[:, 1]] == pytest.approx(np.exp(1j * k) * shape[:, pairs[:, 0]])
    cell = kresling()
    shape = fd.bands(cell, [[0.7]], count=3, shape=True).shape.values[0]
    turned = shape[:, :5] @ cell.motions[0].rotation().T
    assert shape[:, 5:] == pytest.approx(np.exp(0.7j) * turned)


def test_polarizations_are_shares():
    b = fd.bands(miura(), miura().path("G-X", 5), count=6, polarization=True)
    assert b.polarization.sum("axis").values == pytest.approx(1.0)
    assert b.polarization.values.min() >= 0.0


# ---------------------------------------------------------------------- long waves
def powers(cell, way, count):
    """Powers of the phase with which the frequencies of the lowest bands begin."""
    steps = np.array([0.02, 0.04])
    b = fd.bands(cell, steps[:, None] * np.array(way), count=count, track=False)
    return np.log2(np.sqrt(b.eigenvalue[1].values / b.eigenvalue[0].values))


@pytest.mark.matrix
def test_branches_that_begin_at_zero():
    """A sheet: bending and two in its plane; a strip: two that bend, torsion and stretching; a
    tower: torsion and stretching at no phase, bending at its angle in turning axes."""
    assert powers(miura(), (1.0, 0.3), 3) == pytest.approx([2.0, 1.0, 1.0], abs=0.02)
    assert powers(chain(), (1.0,), 4) == pytest.approx([2.0, 2.0, 1.0, 1.0], abs=0.05)
    tower = kresling()
    angle = np.radians(tower.motions[0].angle)
    assert angle == pytest.approx(np.radians(30.0))
    zeros = [int((eigenvalues(tower, [[k]]) == 0.0).sum()) for k in (0.0, angle, -angle, 0.3)]
    assert zeros == [2, 1, 1, 0]
    near = fd.bands(tower, [[angle + 0.01], [angle + 0.02]], count=1, track=False).frequency.values[
        :, 0
    ]
    assert near[1] / near[0] == pytest.approx(4.0, rel=0.02)


class Homogenized:
    """Energy densities (J/m2) of evenly strained sheets, from finite ones of 1 to 3 cells a side.

    With sides their energies are a n^2 + b n + c, of which the second difference is a.
    """

    def __init__(self):
        options = {"a": 0.03, "b": 0.031, "dihedral": 100.0}
        thick = fd.Sheet(1e9, 0.3, 3e-3, density=1000.0)
        self.sheets = [
            fd.discretize(fd.patterns.miura(cells=(n, n), **options), thick, preset="plate")
            for n in (1, 2, 3)
        ]
        self.cell = fd.UnitCell(fd.Case(self.sheets[0]))
        self.area = float(np.linalg.norm(np.cross(*self.cell.vectors)))
        self.areal_density = self.sheets[0].total_mass / self.area

    def energy(self, motions):
        x = self.sheets[0].nodes
        x = x + fd.linear.relaxed(self.cell, motions, steps=1).displacement
        one, two, three = (self._of(sheet, motions, x) for sheet in self.sheets)
        return (three - 2.0 * two + one) / (2.0 * self.area)

    def _of(self, sheet, motions, x):
        corners, own = sheet.pattern.vertices, self.sheets[0]
        step = round(len(corners) ** 0.5)
        moved = np.empty_like(sheet.nodes)
        for i in range(step):
            for j in range(step):
                at = 3 * (i % 2) + j % 2
                moved[i * step + j] = images(motions, x[at], (i // 2, j // 2))
        for face, center in zip(sheet.pattern.faces, sheet.centers, strict=True):
            i, j = divmod(face[0], step)
            at = own.centers[i % 2 + 2 * (j % 2)]
            moved[center] = images(motions, x[at], (i // 2, j // 2))
        return sheet.energy(moved - sheet.nodes)

    def slopes(self, way):
        """Frequencies (rad/s) of the lowest bands over the wave number along a unit vector, and
        over its square for the first one, for long waves."""
        found = []
        for number in (2.0, 4.0):  # rad/m
            phase = number * (self.cell.vectors @ np.array([*way, 0.0]))
            omega = np.sqrt(fd.bands(self.cell, [phase], count=3, track=False).eigenvalue.values[0])
            found.append(np.append(omega[0] / number**2, omega[1:] / number))
        return (4.0 * found[0] - found[1]) / 3.0


def stiffness(energy, size):
    """Second derivative of an energy about zero, of fourth order."""
    values = [energy(k * size) for k in (-2, -1, 0, 1, 2)]
    return np.dot([-1.0, 16.0, -30.0, 16.0, -1.0], values) / (12.0 * size**2)


@pytest.mark.matrix
def test_long_waves_are_those_of_the_homogenized_sheet():
    sheet = Homogenized()
    along, across = sheet.cell.vectors
    length = float(along[0])

    def stretched(e):
        return sheet.energy([translation((1.0 + e) * along), translation(across)])

    def sheared(g):
        return sheet.energy([translation(along + g * length * np.eye(3)[1]), translation(across)])

    def bent(k):
        height = sheet.sheets[0].nodes[:, 2].mean()
        return sheet.energy(bending(along, across, height, k))

    static = [stiffness(bent, 0.05), stiffness(stretched, 1e-4), stiffness(sheared, 1e-4)]
    plate = fd.effective(sheet.cell)
    own = [
        float(plate[name][k, k]) for name, k in (("bending", 0), ("membrane", 0), ("membrane", 2))
    ]
    assert static == pytest.approx(own, rel=2e-5)  # sides of so small sheets are not quite alike
    speeds = np.sqrt(np.array(static) / sheet.areal_density)
    found = sheet.slopes((1.0, 0.0))
    assert found == pytest.approx([speeds[0], *sorted(speeds[1:])], rel=1e-4)


# ---------------------------------------------------------------------- sorting and refusals
@pytest.mark.matrix
def test_bands_follow_shapes_through_crossings():
    b = fd.bands(miura(), miura().path("G-X", 120), count=8, shape=True, group_velocity=True)
    frequency = b.frequency.values
    order = np.argsort(frequency, axis=1)
    assert (order[2] != order[-10]).any()  # some cross
    inside = slice(20, 100)  # away from the corner at no phase, and from where bands meet
    ahead = frequency[:-1] + np.diff(b.distance.values)[:, None] * b.slope.values[:-1, :, 0] / (
        2.0 * np.pi
    )
    off = np.abs(frequency[1:] - ahead)[inside, :6]
    assert off.max() < 0.01 * frequency.max()
    sorted_ones = fd.bands(miura(), miura().path("G-X", 120), count=8, track=False).frequency.values
    np.testing.assert_allclose(np.sort(frequency, axis=1), sorted_ones)


def test_large_cells_are_solved_as_small_ones_are(monkeypatch):
    pattern = fd.patterns.miura(a=0.03, b=0.031)
    cell = fd.UnitCell(fd.Case(fd.shell(pattern, SHEET, divisions=2)))
    full = fd.bands(cell, [[0.7, 0.4], [0.0, 0.0]], count=8, track=False)
    monkeypatch.setattr("foldyn.linear.wave_solver.DENSE", 1)
    few = fd.bands(cell, [[0.7, 0.4], [0.0, 0.0]], count=8, track=False)
    top = float(full.eigenvalue.max())
    assert few.eigenvalue.values == pytest.approx(full.eigenvalue.values, abs=1e-9 * top)


def test_states_that_are_no_equilibrium_are_told():
    moved = kresling().case.structure.nodes * [0.0, 0.0, 0.001]
    with pytest.warns(FoldynWarning, match="no equilibrium of the repeated sheet"):
        b = fd.bands(kresling(), [[0.5]], count=2, state=fd.State(moved))
    assert b.vectors.values == pytest.approx(np.array([[0.0, 0.0, 0.03003]]))


@pytest.mark.matrix
def test_bands_are_stored_with_their_case(tmp_path):
    b = fd.bands(miura(), miura().path("G-X", 3), count=2, shape=True)
    fd.save(b, tmp_path / "bands.nc")
    again = fd.load(tmp_path / "bands.nc")
    assert np.array_equal(again["shape"].values, b["shape"].values)
    assert again.attrs["tick_labels"] == "G-X"
    cell = fd.UnitCell(fd.case_of(again))
    assert fd.bands(cell, again.wave_vector, count=2).frequency.values == pytest.approx(
        b.frequency.values, abs=1e-6
    )


def test_bands_refuse_what_they_cannot_do():
    with pytest.raises(InputError, match=r"phases: shape \(1, 3\): give \(n, 2\)"):
        fd.bands(miura(), [[0.0, 0.0, 0.0]])
    with pytest.raises(InputError, match=r"count = 100: .* leave 24 motions"):
        fd.bands(miura(), [[0.5, 0.0]], count=100)
    with pytest.raises(InputError, match="cell: "):
        fd.bands(miura().case, [[0.5]])
