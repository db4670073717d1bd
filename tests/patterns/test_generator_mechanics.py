"""Patterns in mechanics: what folds rigidly takes no energy, what is coupled is stiff."""

from __future__ import annotations

import numpy as np
import pytest

import foldyn as fd

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
    structure = fd.discretize(first, SHEET, fold_law="linear")
    angles = np.degrees(last.dihedrals).tolist()
    case = fd.Case(structure, loads=[fd.Actuate(list(range(len(angles))), angle=angles)])
    path = fd.trace(case, steps=5, inertia_relief=True)
    found = first.vertices + path.displacement.values[-1][: len(first.vertices)]
    np.testing.assert_allclose(distances(found), distances(last.vertices), rtol=1e-12)
    energy = sum(path[f"strain_{part}"].values for part in ("bars", "folds", "bends"))
    assert energy[-1] < 1e-18 * energy.max()


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
    one = fd.modes(fd.Case(fd.discretize(tube, stiff, **options)), count=8)
    two = fd.modes(fd.Case(fd.discretize(zipper, stiff, **options), supports=links), count=8)
    fold, squeeze = one.frequency.values[6:]
    both, other = two.frequency.values[6:]
    assert squeeze < 5 * fold
    assert both == pytest.approx(fold, rel=0.3)
    assert other > 50 * both
    assert one.frequency.values[5] < 0.01 * fold
