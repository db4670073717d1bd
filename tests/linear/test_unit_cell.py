"""How cells repeat: patterns that do, partners, the Brillouin zone, and what is refused."""

from __future__ import annotations

import math
from functools import partial

import numpy as np
import pytest
from cells import SHEET, chain, kresling, miura

import foldyn as fd
from foldyn.errors import ComputationError, FoldynWarning, InputError
from foldyn.patterns import GENERATORS
from foldyn.patterns.screw import motion_between, of_twist, translation

REPEATING = {
    "simple_fold": {}, "miura": {"cells": (2, 1)}, "arc_miura": {"cells": (1, 1)}, "eggbox": {},
    "kresling": {"storeys": 2, "alternating": True}, "waterbomb": {"cells": (2, 2)},
    "yoshimura": {"cells": (2, 2)}, "curved_pleat": {"pleats": 2, "segments": 3},
    "miura_tube": {"cells": 1}, "zipper_tubes": {"cells": 1}, "resch": {"cells": (2, 2)},
}  # fmt: skip
TWISTED = {
    "kresling": {"storeys": 3},
    "waterbomb": {"cells": (2, 2)},
    "arc_miura": {"cells": (1, 1)},
}


def cell_of(pattern, **given):
    return fd.UnitCell(fd.Case(fd.discretize(pattern, SHEET, preset="plate")), **given)


@pytest.mark.parametrize("name", REPEATING)
def test_generators_say_how_they_repeat(name):
    pattern = GENERATORS[name](**REPEATING[name]).scaled(0.03)
    cell = cell_of(pattern)
    assert cell.dimensions == len(pattern.periods)
    for k, (pairs, motion) in enumerate(zip(pattern.periods, cell.motions, strict=True)):
        moved = motion.images(pattern.vertices[pairs[:, 0]])
        assert moved == pytest.approx(pattern.vertices[pairs[:, 1]], abs=1e-12)
        steps = cell.copies.offset[pairs[:, 1]] - cell.copies.offset[pairs[:, 0]]
        assert (steps == np.eye(cell.dimensions)[k]).all()
    b = fd.bands(cell, [[0.3] * cell.dimensions], count=3)
    assert (b.frequency.values > 0.0).all()


def test_other_generators_do_not_repeat():
    """The corners of a square twist and a flasher's rim are no panels of a neighbor."""
    others = {name for name, make in GENERATORS.items() if name not in REPEATING}
    assert others == {"square_twist", "flasher"}
    assert not any(GENERATORS[name]().periods for name in others)


@pytest.mark.parametrize("name", TWISTED)
def test_tubes_repeat_under_screws(name):
    pattern = GENERATORS[name](**TWISTED[name]).scaled(0.03)
    assert sum(motion.turns for motion in cell_of(pattern).motions) == 1


@pytest.mark.matrix
def test_periods_stay_with_a_pattern_that_is_moved_and_folded(tmp_path):
    pattern = fd.patterns.miura(a=0.03, b=0.03)
    for made in (
        pattern.rotated(30.0, (1, 2, 3)), pattern.mirrored("y"), pattern.scaled(0.5),
        fd.patterns.miura(a=0.03, b=0.03, dihedral=100),
    ):  # fmt: skip
        assert cell_of(made).dimensions == 2
    flat = fd.patterns.miura(a=0.03, b=0.03, dihedral=180)
    folded = fd.fold(flat, fraction=0.5).pattern
    assert len(folded.faces) == 4
    assert cell_of(folded).vectors.shape == (2, 3)
    assert folded.rim_families.keys() == flat.rim_families.keys()
    case = fd.Case(fd.discretize(pattern, SHEET, preset="plate"))
    fd.save(fd.modes(case, 2), tmp_path / "modes.nc")
    again = fd.case_of(fd.load(tmp_path / "modes.nc")).structure.pattern
    assert [pairs.tolist() for pairs in again.periods] == [p.tolist() for p in pattern.periods]
    assert again.rim_families.keys() == pattern.rim_families.keys()
    assert not pattern.repeated((2, 1)).periods


def test_translations_are_found_where_the_pattern_says_nothing():
    pattern = fd.patterns.miura(a=0.03, b=0.03)
    found = cell_of(pattern.changed(periods=()))
    assert found.vectors == pytest.approx(cell_of(pattern).vectors)


def test_cells_that_meet_across_corners_are_one_lattice():
    """Hexagons of six triangles: neighbors along the sum of both periods share an edge too."""
    ring = np.exp(1j * np.pi / 3.0 * np.arange(6))
    points = np.column_stack([np.append(ring.real, 0.0), np.append(ring.imag, 0.0)]) * 0.03
    pattern = fd.Pattern(points, [(k, (k + 1) % 6, 6) for k in range(6)])
    step = 0.03 * np.sqrt(3.0)
    vectors = [(0.0, step, 0.0), (1.5 * 0.03, 0.5 * step, 0.0)]
    cell = cell_of(pattern, vectors=vectors)
    assert cell.kinds == 3  # two corners and the middle
    assert "K" in fd.linear.unit_cell.special_points(cell.vectors)
    zeros = fd.bands(cell, [[0.0, 0.0]], count=4).frequency.values[0] < 1e-3
    assert zeros.tolist() == [True, True, True, False]


def test_screws_and_their_logarithms():
    screw = fd.Screw((1.0, 2.0, 2.0), 40.0, 0.3, (0.1, -0.2, 0.5))
    points = np.random.default_rng(0).normal(size=(5, 3))
    assert of_twist(screw.twist).images(points) == pytest.approx(screw.images(points))
    assert of_twist(3.0 * screw.twist).images(points) == pytest.approx(screw.images(points, 3))
    found, off = motion_between(points, screw.images(points), 1e-9)
    assert off.max() < 1e-12
    assert (found.angle, found.shift) == (pytest.approx(40.0), pytest.approx(0.3))
    found, _ = motion_between(points, points + np.array([1.0, 2.0, 3.0]), 1e-9)
    assert not found.turns
    assert found.vector == pytest.approx([1.0, 2.0, 3.0])
    assert of_twist(translation((1.0, 2.0, 3.0)).twist).vector == pytest.approx([1.0, 2.0, 3.0])


@pytest.mark.filterwarnings("error")
def test_computed_angles_are_not_doubted():
    """A turn of pi/3 degrees is one in radians if a user gives it, but not if it is computed."""
    turn = np.radians(np.pi / 3.0) * np.array([0.0, 0.0, 1.0])
    screw = of_twist(np.concatenate([turn, [0.0, 0.0, 1.0]]))
    assert screw.angle == pytest.approx(np.pi / 3.0)
    points = np.random.default_rng(0).normal(size=(5, 3))
    assert motion_between(points, screw.images(points), 1e-9)[0].angle == pytest.approx(np.pi / 3)


def test_screws_that_move_nothing_are_refused():
    for angle in (0.0, -720.0):
        with pytest.raises(InputError, match=r"shift = 0, angle = -?\d+: moves nothing"):
            fd.Screw("z", angle, 0.0)


# ---------------------------------------------------------------------- the zone
def test_paths_go_through_their_points():
    phases = miura().path("G-X-M-G", 61)
    assert phases.sizes == {"phase": 61, "period": 2}
    ticks = [int(np.argmin(abs(phases.distance.values - t))) for t in phases.attrs["ticks"]]
    pi = np.pi
    assert phases.values[ticks] == pytest.approx(np.array([[0, 0], [pi, 0], [pi, pi], [0, 0]]))
    assert phases.attrs["tick_labels"] == "G-X-M-G"
    assert np.diff(phases.distance.values).max() < 1.5 * np.diff(phases.distance.values).min()
    assert kresling().path("X-G-X", 5).sizes == {"phase": 5, "period": 1}
    assert miura().path("G-X-M-G", 4).values == pytest.approx(phases.values[ticks])


def test_grids_fill_the_zone_once():
    grid = miura().grid(6)
    assert grid.shape == (36, 2)
    assert len(np.unique(np.round(np.exp(1j * grid.values), 9), axis=0)) == 36


# ---------------------------------------------------------------------- what is refused
def test_more_phases_than_memory_holds_are_refused():
    for phases in (partial(miura().path, "G-X"), miura().grid):
        with pytest.raises(InputError, match=r"count: a list of .* phases needs about .* GiB"):
            phases(10**12)


def test_wrong_vectors_name_the_nearest_vertices():
    case, own = miura().case, miura().vectors
    with pytest.raises(
        InputError, match=r"vectors: motion 0 brings no boundary edge .* vertices, "
    ):
        fd.UnitCell(case, vectors=[1.2 * own[0]])
    with pytest.raises(InputError, match=r"vectors = .*: must not be zero or parallel"):
        fd.UnitCell(case, vectors=[own[0], 2.0 * own[0]])
    with pytest.raises(InputError, match="at most two"):
        fd.UnitCell(case, vectors=own, screw=fd.Screw("z", 10.0, 0.0))
    with pytest.raises(InputError, match="lead to different places"):
        fd.UnitCell(case, vectors=[own[0]], screw=fd.Screw("z", 90.0, 0.0))
    double = fd.patterns.miura(cells=(2, 1), a=0.03, b=0.031)
    with pytest.raises(InputError, match=r"panels 0 and 2 are copies .* more than one cell"):
        cell_of(double, vectors=[own[0]])
    with pytest.raises(InputError, match=r"tolerance = 0.5: must be less than 0.05"):
        fd.UnitCell(case, tolerance=0.5)
    both = double.changed(periods=[[(v, v + 6) for v in range(9)]])
    with pytest.raises(InputError, match=r"panels 0 and 2 are copies of each other"):
        fd.bands(cell_of(both), [[0.5]])


def test_vertices_without_partners_are_named():
    pattern = fd.patterns.miura(a=0.03, b=0.031)
    moved = pattern.vertices.copy()
    moved[7] += [2e-4, 0.0, 0.0]
    bent = pattern.changed(vertices=moved)
    with pytest.raises(
        InputError, match=r"vertices 1 to 7, which the pattern says is its period 0"
    ):
        cell_of(bent)
    with pytest.raises(InputError, match=r"vertices 1 have no partner under motion 0"):
        cell_of(bent.changed(periods=()), vectors=miura().vectors[:1])
    ring = 0.03 * np.exp(2j * np.pi / 5.0 * np.arange(5))
    pentagon = fd.Pattern(np.column_stack([ring.real, ring.imag]), [range(5)])
    with pytest.raises(InputError, match="does not say how it repeats"):
        cell_of(pentagon)


def test_states_that_do_not_repeat_name_nodes():
    cell = miura()
    moved = np.zeros_like(cell.case.structure.nodes)
    moved[8] = [0.0, 0.0, 1e-4]
    with pytest.raises(InputError, match=r"state: does not repeat: no motion .* nodes \d and 8"):
        fd.bands(cell, [[0.5, 0.5]], state=fd.State(moved))
    storey = kresling()
    moved = np.zeros_like(storey.case.structure.nodes)
    moved[7] = [0.0, 0.0, 1e-4]
    with pytest.raises(InputError, match=r"no motion .* nodes 2 and 7 are off"):
        fd.bands(storey, [[0.5]], state=fd.State(moved))
    with pytest.raises(InputError, match="state: "):
        fd.bands(storey, [[0.5]], state="equilibrium")


@pytest.mark.parametrize(
    ("case", "match"),
    [
        ({"contact": fd.Contact(thickness=1e-4)}, "contact: cells do not touch"),
        ({"damping": fd.ModalDamping(0.02)}, "damping: modes of one cell"),
    ],
)
def test_what_does_not_repeat_is_refused(case, match):
    cell = fd.UnitCell(fd.Case(miura().case.structure, **case))
    with pytest.raises(InputError, match=match):
        fd.bands(cell, [[0.5, 0.5]])


def test_models_that_do_not_repeat_are_refused():
    pattern = fd.patterns.miura(a=0.03, b=0.031)
    each = fd.discretize(pattern, SHEET, crease_stiffness=[0.1] * 4, preset="plate")
    with pytest.raises(InputError, match=r"crease_stiffness: has no value for the crease between"):
        fd.bands(fd.UnitCell(fd.Case(each)), [[0.5, 0.5]])
    law = fd.discretize(pattern, SHEET, fold_law=fd.Prony([0.5], [1.0]), preset="plate")
    with pytest.raises(InputError, match=r"fold_law = .*has memory"):
        fd.bands(fd.UnitCell(fd.Case(law)), [[0.5, 0.5]])
    sideways = fd.Case(kresling().case.structure, [fd.Link([0, 1], axes="x")])
    with pytest.raises(InputError, match=r"supports\[0\].axes = .*a screw turns these axes"):
        fd.bands(fd.UnitCell(sideways), [[0.5]])


@pytest.mark.matrix
def test_periods_that_cannot_be_reached_are_told():
    with pytest.raises(InputError, match="motions: 1 of them; the cell has 2"):
        fd.linear.relaxed(miura(), miura().vectors[:1])
    with pytest.raises(InputError, match=r"motions\[1\] = .*: must not be zero"):
        fd.linear.relaxed(miura(), [miura().vectors[0], (0.0, 0.0, 0.0)])
    with pytest.raises(ComputationError, match="no equilibrium with these periods"):
        fd.linear.relaxed(chain(), [[1e-6, 0.0, 0.0]], steps=1)


def test_zones_refuse_unknown_points():
    with pytest.raises(
        InputError, match='points = "G-Q": "Q" is no point; this cell has G, X, Y, M'
    ):
        miura().path("G-Q")
    with pytest.raises(InputError, match="give at least two points"):
        miura().path("G")
    with pytest.raises(InputError, match="count"):
        miura().path("G-X-M", 2)


@pytest.mark.matrix
@pytest.mark.filterwarnings("error:.*no equilibrium")
@pytest.mark.filterwarnings("ignore:the state is unstable")
@pytest.mark.parametrize("preset", [None, "n5b8e"])
def test_compressed_sheets_that_are_unstable_are_in_equilibrium(preset):
    """Panels of thin sheets buckle: states of equal strain are there, though unstable."""
    thin = fd.Sheet(1e9, 0.3, 1e-4, density=1000.0)
    pattern = fd.patterns.eggbox().scaled(0.03)
    cell = fd.UnitCell(fd.Case(fd.discretize(pattern, thin, preset=preset)))
    along, across = cell.vectors
    state = fd.linear.relaxed(cell, [0.8 * along, across])
    assert fd.bands(cell, [[0.5, 0.5]], count=2, state=state).attrs["residual"] == 0.0


@pytest.mark.matrix
@pytest.mark.filterwarnings("error", "ignore::foldyn.errors.ModelRangeWarning")
def test_small_changes_of_periods_count():
    """Below the tolerance at which vertices meet."""
    cell, tower = miura(), kresling()
    state = fd.linear.relaxed(cell, (1.0 + 1e-7) * cell.vectors)
    b = fd.bands(cell, [[0.5, 0.5]], count=2, state=state)
    assert b.vectors.values[0, 0] / cell.vectors[0, 0] - 1.0 == pytest.approx(1e-7, rel=1e-6)
    screw = tower.motions[0]
    state = fd.linear.relaxed(tower, [fd.Screw("z", screw.angle + 1e-6, screw.shift)])
    b = fd.bands(tower, [[0.5]], count=2, state=state)
    assert math.degrees(b.angles[0]) - screw.angle == pytest.approx(1e-6, rel=1e-5)


def test_states_on_a_line_keep_a_given_screw():
    """Where pairs cannot tell a turn, and nodes move by less than the tolerance."""
    pattern = fd.patterns.waterbomb(cells=(1, 2)).scaled(0.03)
    screw = cell_of(pattern).motions[0]
    strip = fd.patterns.waterbomb(cells=(1, 1)).scaled(0.03)
    cell = cell_of(strip, screw=screw)
    moved = np.random.default_rng(0).normal(scale=1e-10, size=cell.case.structure.nodes.shape)
    with pytest.warns(FoldynWarning, match="no equilibrium"):
        b = fd.bands(cell, [[0.5]], count=2, state=fd.State(moved))
    assert math.degrees(b.angles[0]) == pytest.approx(screw.angle, abs=1e-4)
