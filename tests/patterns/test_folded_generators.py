"""Generators that fold: isometry, flat panels, developability, letters, families, mechanics."""

from __future__ import annotations

import inspect

import numpy as np
import pytest

import foldyn as fd
from foldyn.patterns import GENERATORS, Pattern
from foldyn.patterns.topology import edge_lookup, edge_of
from named_models import named

FOLDING = {
    "simple_fold": (1.0, 60.0, 179.0),
    "miura": (5.0, 60.0, 120.0, 179.0),
    "arc_miura": (40.0, 90.0, 150.0, 179.9),
    "waterbomb": (100.0, 120.0, 150.0, 179.9),
    "yoshimura": (154.0, 160.0, 175.0, 179.9),
    "curved_pleat": (85.0, 110.0, 150.0, 179.0),
    "resch": (3.0, 60.0, 120.0, 179.0),
    "square_twist": (2.0, 60.0, 100.0, 179.0),
}
"""Dihedrals (degrees) of generators that are flat at 180."""
WRAPPED = ("flasher",)
"""Those with a flat and a folded state and nothing between."""
NEVER_FLAT = ("eggbox", "kresling", "miura_tube", "zipper_tubes")
OTHER = {
    "miura": {"cells": (2, 3), "a": 0.7, "b": 1.3, "panel_angle": 50},
    "arc_miura": {"cells": (1, 2), "a": 0.9, "b": 1.1, "panel_angle": 70, "second_angle": 50},
    "waterbomb": {"cells": (2, 3), "a": 1.0, "b": 1.5},
    "yoshimura": {"cells": (3, 3), "a": 0.4, "b": 1.1},
    "curved_pleat": {"pleats": 3, "segments": 4, "a": 0.3, "arc": 60},
    "square_twist": {"a": 0.5, "b": 1.2, "panel_angle": 30},
    "resch": {"cells": (2, 1), "a": 0.3},
    "flasher": {"sides": 5, "a": 0.2, "rings": 2},
}


def every(names):
    """Each generator with its defaults, and with other arguments."""
    return [(name, options) for name in names for options in ({}, OTHER.get(name, {}))]


def spans(pattern: Pattern) -> np.ndarray:
    """Distances (m) of all corners of each panel."""
    corners = [pattern.vertices[list(face)] for face in pattern.faces]
    return np.concatenate([np.linalg.norm(x[:, None] - x[None], axis=-1).ravel() for x in corners])


def corner_angles(pattern: Pattern) -> dict[int, list[tuple[int, int, float]]]:
    """Of each vertex the panels around it: the edges on both sides, and the angle (rad)."""
    found: dict[int, list[tuple[int, int, float]]] = {}
    for face in pattern.faces:
        for k, vertex in enumerate(face):
            after, before = face[(k + 1) % len(face)], face[k - 1]
            u, w = pattern.vertices[[after, before]] - pattern.vertices[vertex]
            angle = np.arctan2(np.linalg.norm(np.cross(u, w)), u @ w)
            found.setdefault(vertex, []).append((after, before, angle))
    return found


def interior(pattern: Pattern) -> list[int]:
    return sorted(set(range(len(pattern.vertices))) - set(pattern.boundary.ravel().tolist()))


def in_order(around_vertex: list[tuple[int, int, float]]) -> list[tuple[int, float]]:
    """Neighbors of an interior vertex counter-clockwise, each with the angle after it (rad)."""
    after = {first: (second, angle) for first, second, angle in around_vertex}
    start = here = around_vertex[0][0]
    out = []
    while True:
        following, angle = after[here]
        out.append((here, angle))
        here = following
        if here == start:
            return out


def test_the_lists_here_are_complete():
    assert set(GENERATORS) == {*FOLDING, *WRAPPED, *NEVER_FLAT}
    for name, make in GENERATORS.items():
        arguments = inspect.signature(make).parameters
        assert ("folded" in arguments) == (name in WRAPPED)


@pytest.mark.parametrize(("name", "options"), every(FOLDING))
def test_folding_is_rigid(name, options):
    make = GENERATORS[name]
    flat = make(**options, dihedral=180)
    assert not flat.vertices[:, 2].any()
    assert (flat.face_normals[:, 2] > 0).all()
    for dihedral in FOLDING[name]:
        folded = make(**options, dihedral=dihedral)
        assert folded.faces == flat.faces
        assert not any(folded.flipped)
        np.testing.assert_allclose(spans(folded), spans(flat), rtol=0, atol=1e-12 * flat.size)
        assert folded.face_planarity.max() < 1e-13
        assert folded.size < flat.size
        # the letters that the geometry has are those of the flat crease pattern
        assert Pattern(folded.vertices, folded.faces).assignments == flat.assignments
        assert folded.assignments == flat.assignments
        assert set(flat.assignments) <= {"M", "V"}


@pytest.mark.parametrize(("name", "options"), every(FOLDING))
def test_the_dihedral_is_that_of_some_crease(name, options):
    if name == "curved_pleat":  # one of the chords is at right angles to the rulings
        options = {**options, "segments": 5}
    for dihedral in FOLDING[name]:
        folded = GENERATORS[name](**options, dihedral=dihedral)
        smaller = np.minimum(folded.dihedrals, 2 * np.pi - folded.dihedrals)
        assert np.abs(np.degrees(smaller) - dihedral).min() < 1e-9


@pytest.mark.parametrize(("name", "options"), every(WRAPPED))
def test_wrapped_states_have_the_lengths_and_angles_of_the_flat_one(name, options):
    make = GENERATORS[name]
    flat, folded = make(**options), make(**options, folded=True)
    assert folded.faces == flat.faces
    np.testing.assert_allclose(spans(folded), spans(flat), rtol=0, atol=1e-12 * flat.size)
    assert folded.assignments == flat.assignments
    np.testing.assert_allclose(np.pi - folded.dihedrals, flat.fold_angles, atol=1e-12)
    sign = np.where(np.array(flat.assignments) == "V", 1.0, -1.0)
    assert (sign * flat.fold_angles > 0.1).all()
    assert np.isnan(folded.fold_angles).all()


@pytest.mark.parametrize(("name", "options"), every([*FOLDING, *WRAPPED]))
def test_developable(name, options):
    state = {"folded": True} if name in WRAPPED else {"dihedral": FOLDING[name][1]}
    folded = GENERATORS[name](**options, **state)
    angles = corner_angles(folded)
    if name != "simple_fold":
        assert interior(folded)
    for vertex in interior(folded):
        assert sum(angle for _, _, angle in angles[vertex]) == pytest.approx(2 * np.pi, abs=1e-11)


@pytest.mark.parametrize(
    ("name", "options"),
    [
        *every(["miura", "arc_miura", "waterbomb", "yoshimura", "square_twist"]),
        ("square_twist", {"symmetric": True}),
    ],
)
def test_kawasaki_and_maekawa_where_flat_foldable(name, options):
    flat = GENERATORS[name](**options, dihedral=180)
    row, around_each = edge_lookup(flat.creases), corner_angles(flat)
    for vertex in interior(flat):
        ordered = in_order(around_each[vertex])
        angles = np.array([angle for _, angle in ordered])
        assert angles[::2].sum() == pytest.approx(np.pi, abs=1e-11)
        letters = [flat.assignments[row[edge_of(vertex, other)]] for other, _ in ordered]
        assert abs(letters.count("M") - letters.count("V")) == 2


@pytest.mark.parametrize(("name", "options"), every(GENERATORS))
def test_families_are_all_creases_once(name, options):
    pattern = GENERATORS[name](**options)
    families = dict(pattern.families)
    if name == "zipper_tubes":  # those of each tube as well
        for kind in ("zigzag", "ring"):
            parts = [*families.pop(f"{kind}_1"), *families.pop(f"{kind}_2")]
            assert sorted(parts) == families[kind].tolist()
    rows = np.concatenate([*families.values()])
    assert sorted(rows.tolist()) == list(range(len(pattern.creases)))


@pytest.mark.parametrize("name", ["waterbomb", "yoshimura", "resch", "flasher"])
def test_a_family_has_one_letter(name):
    pattern = GENERATORS[name]()
    for rows in pattern.families.values():
        assert len({pattern.assignments[row] for row in rows}) == 1


def test_families_of_the_first_generators():
    sheet = fd.patterns.miura((2, 3))
    ends = sheet.vertices[sheet.creases]
    along_x = np.abs(np.diff(ends, axis=1)[:, 0, 0]) > 0
    np.testing.assert_array_equal(np.flatnonzero(along_x), sheet.families["zigzag"])
    np.testing.assert_array_equal(np.flatnonzero(~along_x), sheet.families["straight"])
    tower = fd.patterns.kresling(sides=5, storeys=2)
    length = np.linalg.norm(np.diff(tower.vertices[tower.creases], axis=1)[:, 0], axis=1)
    for name, size in (("ring", 5), ("side", 10), ("diagonal", 10)):
        assert len(tower.families[name]) == size
        assert np.ptp(length[tower.families[name]]) < 1e-14
    assert "ring" not in fd.patterns.kresling().families
    assert fd.patterns.simple_fold().families["ridge"].tolist() == [0]


SHEET = fd.Sheet(1e9, 0.3, 2e-3, 700.0)


def distances(points: np.ndarray) -> np.ndarray:
    return np.linalg.norm(points[:, None] - points, axis=-1)[np.triu_indices(len(points), 1)]


@pytest.mark.parametrize(
    ("name", "options", "dihedrals"),
    [
        ("square_twist", {}, (120, 80)),
        ("arc_miura", {"cells": (1, 1)}, (120, 100)),
        ("waterbomb", {"cells": (1, 2)}, (140, 120)),
        ("curved_pleat", {"pleats": 2, "segments": 3}, (140, 120)),
    ],
)
def test_creases_fold_one_state_into_another_without_strain(name, options, dihedrals):
    """Their rest angles go from those of one state to those of the other: no energy is left."""
    make = fd.patterns.GENERATORS[name]
    first, last = (make(**options, dihedral=dihedral) for dihedral in dihedrals)
    structure = fd.discretize(first, SHEET, fold_law="linear", preset="plate")
    angles = np.degrees(last.dihedrals).tolist()
    case = fd.Case(structure, loads=[fd.Actuate(list(range(len(angles))), angle=angles)])
    path = fd.trace(case, steps=5, inertia_relief=True)
    found = first.vertices + path.displacement.values[-1][: len(first.vertices)]
    np.testing.assert_allclose(distances(found), distances(last.vertices), rtol=1e-12)
    energy = sum(path[f"strain_{part}"].values for part in ("bars", "folds", "bends"))
    assert energy[-1] < 1e-18 * energy.max()


@pytest.mark.matrix
def test_zipper_tubes_are_stiff_but_for_folding():
    """A tube folds and is squeezed softly, one end open and the other shut; a zipper only folds.

    E. T. Filipov, T. Tachi, G. H. Paulino, PNAS 112, 2015: of a tube the lowest eigenvalues are
    1.37 and 1.43, of zipper tubes 2.78 and 1194 (in their units).
    """
    tube, zipper = (
        make(3, panel_angle=60, dihedral=90)
        for make in (fd.patterns.miura_tube, fd.patterns.zipper_tubes)
    )
    stiff = fd.Sheet(1e9, 0.3, 1e-2, 700.0)
    options = {"fold_law": "linear", "crease_stiffness": 0.5}
    links = [fd.Link([node], to=corners) for node, corners in zipper.custom["foldyn:ties"]]
    one = fd.modes(fd.Case(fd.discretize(tube, stiff, **named(options))), count=8)
    two = fd.modes(fd.Case(fd.discretize(zipper, stiff, **named(options)), supports=links), count=8)
    fold, squeeze = one.frequency.values[6:]
    both, other = two.frequency.values[6:]
    assert squeeze < 5 * fold
    assert both == pytest.approx(fold, rel=0.3)
    assert other > 50 * both
    assert one.frequency.values[5] < 0.01 * fold
