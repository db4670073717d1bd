"""Rims of Kresling cells: held along z only, so that they bow in their plane, or straight."""

from typing import Any

import numpy as np
import pytest

import foldyn as fd
from foldyn.cases.clamped_edges import straightened
from foldyn.errors import InputError
from foldyn.structures.held_edges import directions, guided_edges, straight_in_bending

SIDES, WAY = 6, 1e-7
LOW, HIGH = list(range(SIDES)), list(range(SIDES, 2 * SIDES))
N5B8E: dict[str, Any] = {"preset": "n5b8e"}


def cell(height: float, twist: float) -> fd.Pattern:
    return fd.patterns.kresling(sides=SIDES, radius=0.04, height=height, twist=twist)


def steel(thickness: float) -> fd.Sheet:
    return fd.Sheet(2e11, 0.3, thickness, density=7850.0)


def pressed(along: bool = True) -> list[Any]:
    return [fd.Fix(LOW, along=along), fd.Impose(HIGH, "z", -WAY, along=along)]


def stiffness(case: fd.Case) -> float:
    """N/m, for small displacements."""
    path = fd.trace(case, "displacement", steps=1)
    return 2.0 * sum(float(path[name][-1]) for name in case.energy_groups) / WAY**2


CELLS = [(0.06, 30, 133, 4.084e6, 0.02), (0.04, 45, 80, 9.028e5, 0.08)]
"""Height (m), twist, slenderness, stiffness (N/m), and the error of n5b8e.

The stiffness is the limit of superelements of level 5 with 24, 32, 48 and 64 divisions: pairs of
them, extrapolated with the square of the mesh size, agree within 0.02 %.
"""


@pytest.mark.parametrize(("height", "twist", "slender", "true", "error"), CELLS)
def test_a_rim_held_along_z_only(height, twist, slender, true, error):
    """With a straight rim in the model the errors are +29 and +60 %."""
    pattern, sheet = cell(height, twist), steel(0.04 / slender)
    made = fd.discretize(pattern, sheet, **N5B8E, straight="zmin", guided={"z": "zmax"})
    assert stiffness(fd.Case(made, pressed())) == pytest.approx(true, rel=error)
    assert stiffness(straight(pattern, sheet)) > 1.25 * true


@pytest.mark.matrix
@pytest.mark.parametrize(("height", "twist", "slender", "true", "error"), CELLS)
def test_superelements_with_such_a_rim(height, twist, slender, true, error):
    made = fd.superelements(cell(height, twist), steel(0.04 / slender))
    assert stiffness(fd.Case(made, pressed())) == pytest.approx(true, rel=4e-3)


def straight(pattern: fd.Pattern, sheet: fd.Sheet, **options: Any) -> fd.Case:
    made = fd.discretize(pattern, sheet, **N5B8E, straight="zmin or zmax", **options)
    return fd.Case(made, pressed())


def capped(pattern: fd.Pattern, sheet: fd.Sheet, crease: float) -> fd.Case:
    """The cell with a rigid plate hinged to its upper rim."""
    closed = fd.Pattern(pattern.vertices, [*pattern.faces, tuple(HIGH)])
    rim = np.isin(closed.creases, HIGH).all(axis=1)
    made = fd.superelements(
        closed, sheet, rigid=[2 * SIDES], crease_stiffness=np.where(rim, 0.0, crease).tolist()
    )
    return fd.Case(made, [fd.Fix(LOW, along=True), fd.Impose(HIGH, "z", -WAY)])


@pytest.mark.parametrize(
    ("slender", "crease", "error"),
    [
        pytest.param(40, 0.0, 0.02, marks=pytest.mark.matrix),
        pytest.param(133, 0.0, 0.02, marks=pytest.mark.matrix),
        pytest.param(133, 6.0, 0.04, marks=pytest.mark.matrix),
    ],
)
def test_a_straight_rim(slender, crease, error):
    """Soft creases leave a thick cell right; stiff ones, which bows turn, make it too soft."""
    pattern, sheet = cell(0.06, 30), steel(0.04 / slender)
    true = stiffness(capped(pattern, sheet, crease))
    found = stiffness(straight(pattern, sheet, crease_stiffness=crease))
    assert found == pytest.approx(true, rel=error)


def test_the_direction_of_bows():
    """Horizontal; as plates, nearly upright panels have an edge that bows, inclined ones not."""
    pattern, sheet = cell(0.06, 30), steel(1e-3)
    guided = guided_edges({"z": "zmax"}, pattern)
    assert {axis for *_, axis in guided} == {"z"} and len(guided) == SIDES
    for f in directions(guided, pattern).values():
        assert f[2] == pytest.approx(0.0, abs=1e-15) and np.linalg.norm(f) == pytest.approx(1.0)
    inclined = straight_in_bending((), guided, pattern, sheet)
    assert sorted(inclined) == sorted((low, high) for low, high, _ in guided)
    assert straight_in_bending((), guided, pattern, steel(4e-3)) == []
    oblique = guided_edges({"x": "zmax"}, pattern)
    perpendicular = directions(oblique, pattern)  # two of six edges, which run along y
    assert len(perpendicular) == 2
    held = straight_in_bending((), oblique, pattern, sheet)
    assert {(low, high) for low, high, _ in oblique} - set(perpendicular) <= set(held)


def test_supports_tell_which_edges_are_guided():
    pattern, sheet = cell(0.06, 30), steel(1e-3)
    plain = fd.discretize(pattern, sheet, **N5B8E)
    found = straightened(plain.options, pattern, pressed())
    assert {axis for *_, axis in found["guided"]} == {"z"} and len(found["straight"]) == SIDES
    made = fd.discretize(pattern, sheet, **N5B8E, **found)
    assert made.options.guided == found["guided"]
    assert fd.discretize(pattern, sheet, **N5B8E, **found).bowed_edges == made.bowed_edges
    both = straightened(plain.options, pattern, [*pressed(), fd.Fix(HIGH, "x", along=True)])
    assert both["guided"] == () and len(both["straight"]) == 2 * SIDES


def test_refusals():
    pattern, sheet = cell(0.06, 30), steel(1e-3)
    with pytest.raises(InputError, match="is no axis; take x, y or z"):
        fd.discretize(pattern, sheet, **N5B8E, guided={"w": "zmax"})
    with pytest.raises(InputError, match="give edges by axis"):
        fd.discretize(pattern, sheet, **N5B8E, guided="zmax")  # pyright: ignore[reportArgumentType]
    with pytest.raises(InputError, match="listed twice"):
        fd.discretize(pattern, sheet, **N5B8E, guided={"z": "zmax", "x": "zmax"})
    with pytest.raises(InputError, match="guided: edges bow with"):
        fd.discretize(pattern, sheet, preset="herkal", guided={"z": "zmax"})
    made = fd.discretize(pattern, sheet, **N5B8E, guided={"z": "zmax"})
    with pytest.raises(InputError, match="is guided along z only"):
        fd.Case(made, [fd.Fix(HIGH, along=True)])
    bowed = fd.discretize(pattern, sheet, **N5B8E)
    with pytest.raises(InputError, match=r"guided = .* or straight ="):
        fd.Case(bowed, [fd.Fix("zmax", "z", along=True)])


def test_results_keep_guided_edges(kept):
    made = fd.discretize(
        cell(0.06, 30), steel(1e-3), **N5B8E, straight="zmin", guided={"z": "zmax"}
    )
    held = [fd.Fix("zmin", along=True), fd.Fix("zmax", "z", along=True)]
    case = fd.Case(made, held)
    again = kept(fd.modes(case, count=2)).structure
    assert again.options == made.options and len(made.options.guided) == SIDES


@pytest.mark.matrix
def test_cells_of_waves_have_guided_edges():
    """Frequencies of two cells at the phase 0 are those of one cell at 0 and 180 degrees."""

    def frequencies(cells: int, phases: list[float], guided: bool = True) -> list[float]:
        pattern = fd.patterns.miura(cells=(cells, 1), a=0.03, b=0.031)
        side = [(3 * k, 3 * k + 3) for k in range(2 * cells)]
        options: dict[str, Any] = {"guided": {"z": side}} if guided else {}
        case = fd.Case(fd.discretize(pattern, steel(2e-4), **N5B8E, **options))
        chain = fd.UnitCell(case, vectors=fd.UnitCell(case).vectors[:1])
        found = fd.bands(chain, [[phase] for phase in phases], count=12)
        return sorted(found.frequency.values.ravel().tolist())[5:12]

    two = frequencies(2, [0.0])
    np.testing.assert_allclose(frequencies(1, [0.0, np.pi]), two, rtol=1e-6)
    assert np.abs(np.array(frequencies(2, [0.0], guided=False)) / two - 1.0).max() > 1e-4
