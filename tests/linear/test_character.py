"""What modes do: shares of a beam's motions, and names."""

from __future__ import annotations

import numpy as np
import pytest
from bodies import TOP, body, paper_specimen

import foldyn as fd
from foldyn.errors import InputError
from foldyn.linear import character, modes
from foldyn.linear.character import main_axis
from foldyn.results import modes_dataset
from named_models import named

STRAIGHT = {"fold_law": "linear", "bend_law": "linear"}
KINDS = ["axial", "bending along y", "bending along z", "torsion", "distortion"]


def tall():
    """A Kresling column of many storeys along z."""
    pattern = fd.patterns.kresling(sides=8, radius=1, height=0.5, twist=20, storeys=12)
    return fd.discretize(
        pattern, fd.Sheet(1e6, 0.25, 0.01, 1.0), membrane="bars", **named(STRAIGHT)
    )


def given(s, shapes):
    """A set of modes with shapes (k, n, 3) that were not computed."""
    k = len(shapes)
    none, along = np.zeros(k), np.zeros((k, 3))
    values = {
        "frequency": none + 1.0, "eigenvalue": none + 1.0, "shape": shapes, "rigid": none > 0.0,
        "rigid_share": none, "damping_ratio": none, "participation": along,
        "effective_mass": along, "displacement": np.zeros(s.nodes.shape),
    }  # fmt: skip
    return modes_dataset(fd.Case(s), values, {})


def unit(s, shapes):
    """Shapes of one kinetic energy."""
    weight = s.mass.diagonal()[:, None]
    return [shape / np.sqrt((weight * shape**2).sum()) for shape in shapes]


def beam(s, axis="z"):
    """Motions of a beam along an axis on the nodes of a structure, by kind."""
    a = "xyz".index(axis)
    b, c = (a + 1) % 3, (a + 2) % 3
    x = s.nodes - s.nodes.mean(axis=0)
    t = (x[:, a] - x[:, a].min()) / np.ptp(x[:, a])
    out = {name: np.zeros(x.shape) for name in ("axial", "b", "c", "torsion")}
    out["axial"][:, a] = t
    out["b"][:, b], out["b"][:, a] = t**2, -2 * t * x[:, b] / np.ptp(x[:, a])
    out["c"][:, c], out["c"][:, a] = t**2, -2 * t * x[:, c] / np.ptp(x[:, a])
    out["torsion"] = t[:, None] * np.cross(np.eye(3)[a], x)
    return list(out.values())


@pytest.mark.parametrize("axis", "xyz")
def test_motions_of_a_beam_are_recognized(axis):
    s, others = tall(), [other for other in "xyzxy"["xyz".index(axis) + 1 :]][:2]
    kinds = ["axial", *(f"bending along {other}" for other in others), "torsion"]
    found = character(given(s, beam(s, axis)), axis)
    assert found.kind_of.values.tolist() == kinds
    assert (found.share.max("kind").values > 0.97).all()
    np.testing.assert_allclose(found.share.sum("kind"), 1.0, atol=1e-12)
    assert found.name.values.tolist() == [f"first {kind}" for kind in kinds]


def test_breathing_is_distortion():
    s = tall()
    outward = s.nodes * [1.0, 1.0, 0.0]
    oval = s.nodes * [1.0, -1.0, 0.0]
    found = character(given(s, [outward, oval]), "z")
    assert found.kind_of.values.tolist() == ["distortion"] * 2
    assert found.name.values.tolist() == ["first distortion", "second distortion"]
    assert (found.share.sel(kind="distortion") > 0.99).all()


def test_a_mixture_is_shared_by_its_kinetic_energy():
    """Without a leading part it is mixed: three at 44, 33 and 23 % of the motion."""
    s = tall()
    axial, sway, _, turned = unit(s, beam(s))
    shapes = [
        0.6 * axial + 0.8 * turned,
        np.sqrt(0.44) * axial + np.sqrt(0.33) * turned + np.sqrt(0.23) * sway,
        np.sqrt(0.52) * axial + np.sqrt(0.48) * turned,
    ]
    found = character(given(s, shapes), "z")
    assert found.kind_of.values.tolist() == ["torsion", "mixed", "axial"]
    assert found.name.values.tolist() == ["first torsion", "mixed: axial, torsion", "first axial"]
    np.testing.assert_allclose(found.share.sel(kind="axial"), [0.36, 0.44, 0.52], atol=0.01)
    np.testing.assert_allclose(found.share.sel(kind="torsion"), [0.64, 0.33, 0.48], atol=0.01)


def test_the_modes_of_a_column():
    """Its sections are alike in x and y: bending comes in pairs of equal frequency."""
    s = tall()
    base = np.flatnonzero(s.nodes[:, 2] < 1e-9)
    found = modes(fd.Case(s, [fd.Fix(base, "xyz")]), 6)
    kinds = character(found, "z").kind_of.values.tolist()
    assert kinds[:2] == kinds[4:] == ["distortion"] * 2  # its ends become oval
    assert sorted(kinds[2:4]) == ["bending along x", "bending along y"]
    assert float(found.frequency[2]) == pytest.approx(float(found.frequency[3]))


@pytest.mark.parametrize("mass", ["circumcenter", "consistent"])
@pytest.mark.parametrize(
    ("rest", "state"), [("stress_free", None), ("as_published", "equilibrium")]
)
def test_the_wobbles_of_the_specimen_are_bending_in_its_plane(rest, state, mass):
    """The paper's first wobble, axial mode, second wobble (3.8, 9.3, 16.7 Hz) along x.

    The sheet, 0.1 x 0.087 m, sways along y in its plane and its top edge turns about z, so that
    the corners move along x: what its FRF shows at a corner.
    """
    found = modes(paper_specimen(mass, rest), 8, state=state, secant=0.5)
    what = character(found)
    named = dict(zip(what.name.values.tolist(), found.frequency.values, strict=True))
    for name, frequency in (
        ("first bending along y", 3.8), ("first axial", 9.3), ("second bending along y", 16.7),
    ):  # fmt: skip
        assert 0.9 < named[name] / frequency < 1.3, name
    assert named["first bending along z"] < 0.65 * named["first axial"]
    share = what.share.sel(kind=["axial", "bending along y"]).max("kind")
    for name in ("first bending along y", "first axial", "second bending along y"):
        assert float(share[what.name.values.tolist().index(name)]) > 0.85
    edge = character(found, nodes=TOP, stations=1)
    assert edge.kind.values.tolist() == KINDS
    first = edge.isel(mode=what.name.values.tolist().index("first bending along y"))
    assert float(first.share.sel(kind="bending along y")) > 0.95


def test_rigid_modes_are_called_so():
    found = modes(fd.Case(tall()), 8)
    names = character(found, "z").name.values.tolist()
    assert names[:2] == ["first rigid", "second rigid"] and names[5] == "sixth rigid"
    assert "rigid" not in names[6]


def test_by_default_the_axis_leads_away_from_the_supports():
    sheet = fd.Sheet(1.0, 0.25, 0.01, 1.0)
    long = fd.discretize(fd.patterns.miura(cells=(4, 1)), sheet, preset="plate")
    for held in ([], [fd.Fix("xmin")], [fd.Fix("ymin")]):  # it is much longer than wide
        assert main_axis(fd.Case(long, held)) == "x"
    square = fd.discretize(fd.patterns.miura(cells=(2, 1)), sheet, preset="plate")
    found = modes(fd.Case(square, [fd.Fix("ymax")]), 3, secant=1.0)
    assert character(found).attrs["axis"] == "y"
    for name in ("name", "share"):
        np.testing.assert_array_equal(character(found)[name], character(found, "y")[name])


def test_one_dozen_of_nodes_has_two_stations():
    pattern = fd.patterns.kresling(sides=6, radius=1, height=0.9, twist=30, storeys=1)
    s = fd.discretize(pattern, fd.Sheet(1e6, 0.25, 0.01, 1.0), preset="plate")
    t = s.nodes[:, 2:] / 0.9 * [0.0, 0.0, 1.0]
    assert character(given(s, [t]), "z").kind_of.values.tolist() == ["axial"]


def test_refused():
    found = modes(fd.Case(body("miura"), [fd.Fix([0, 1, 2], "xyz")]), 2, secant=1.0)
    for options, message in (
        ({"axis": "xy"}, 'axis = "xy"'), ({"nodes": [41]}, "node 41 is out of range"),
        ({"nodes": [0, 1]}, "mode 1 does not move them"), ({"stations": 0}, "stations = 0"),
    ):  # fmt: skip
        with pytest.raises(InputError, match=message):
            character(found, **options)
    path = fd.trace(paper_specimen(rest="as_published"), load_factors=[0.0])
    with pytest.raises(InputError, match="is a path; give modes"):
        character(path)
