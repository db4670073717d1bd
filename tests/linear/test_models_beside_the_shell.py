"""Models beside the shell, for one's own case: against the study, by symmetry, and bad input."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest

import foldyn as fd
from foldyn.errors import FoldynWarning, InputError
from foldyn.linear import fidelity as compare_models
from foldyn.linear.compared import SCOPE, legend, percent
from foldyn.linear.fidelity import MODELS, comparison, forces_alone, rest_forces, small_loads
from foldyn.linear.shell_of import meshes, shell_of, triangle_count
from foldyn.results import fidelity_dataset
from named_models import named
from pairwise import beyond
from verification.fidelity.compare import RESULTS, read

SHEET = fd.Sheet(1e6, 0.25, 0.01, density=1.0)
PLATE = {"calibration": "plate", "mass": "consistent", "bend_law": "linear"}
STANDARD = {"calibration": "standard", "bend_law": "linear"}
UNIT = {"cells": (1, 1), "a": 1.0, "b": 1.0, "panel_angle": 60, "dihedral": 60}
FOLDING = [fd.Fix([0, 1, 2], "x"), fd.Fix([1], "y"), fd.Fix([0, 2, 6, 8], "z")]  # case study 2
SUPPORTS = {"folding": FOLDING, "free": []}


def strip(panels: int) -> fd.Pattern:
    """Flat squares in a row."""
    points, n = [(x, y) for y in (0.0, 1.0) for x in range(panels + 1)], panels + 1
    return fd.Pattern(points, [[k, k + 1, n + k + 1, n + k] for k in range(panels)])


CUT = {"scheme": "n4b5", "bend_law": "linear"}
CORNERS = [fd.Fix([0, 1, 2, 3])]
SQUARE = fd.discretize(strip(1), SHEET, **CUT)
ARROW = fd.discretize(fd.Pattern([[0, 0], [2, 1], [0, 2], [0.5, 1]], [[0, 1, 2, 3]]), SHEET, **CUT)
LONG = fd.discretize(strip(500), SHEET, bend_law="linear")


def fold(**options) -> fd.Structure:
    """A simple fold, which takes milliseconds."""
    return fd.discretize(fd.patterns.simple_fold(), SHEET, **named(options))


def held(*loads, **options) -> fd.Case:
    return fd.Case(fold(**(options or STANDARD)), [fd.Fix([0, 1, 2, 3])], loads)


@pytest.fixture(scope="module")
def miura():
    """Case study 2 with linear bends and its load."""
    structure = fd.discretize(fd.patterns.miura(**UNIT), SHEET, **STANDARD)
    case = fd.Case(structure, FOLDING, [fd.Force([7], (0.01, 0, 0), fd.HalfSine(0.5))])
    return case, fd.fidelity(case, count=8, reference="shell")


@pytest.fixture(scope="module")
def quick():
    """A fold on a coarse mesh, all models."""
    case = held(fd.Force([4, 5], (0, 0, 1e-4)), bend_law="superlinear")
    return case, fd.fidelity(case, 5, reference="shell", divisions=(3, 6))


@pytest.mark.parametrize("support", beyond(SUPPORTS))
def test_errors_are_those_of_the_study(support, miura):
    """The same shell, models and pairing as the stored tables, on which nothing of this ran."""
    name = f"miura, cells 1x1, a 1, b 1, panel_angle 60, dihedral 60, {support}, L* 1"
    (stored,) = [m for m in read(RESULTS / "documented.csv") if m.case == name]
    found = miura[1]
    if support == "free":
        found = fd.fidelity(fd.Case(miura[0].structure), count=8, reference="shell")
        assert found.result.attrs["rigid"] == 6
    kept = {"own": "standard, mixed_voronoi", "plate": "plate, consistent",
            "n5b8e": "n5b8e, condensed"}  # fmt: skip
    for model, name in kept.items():
        modes = [mode for mode in found.table(model) if mode.below]
        assert len(modes) == len(stored.rows[name]) >= 3
        for mode, row in zip(modes, stored.rows[name], strict=True):
            assert mode.mode == row.mode
            assert mode.shell == pytest.approx(row.shell, rel=1e-5)
            mine = (mode.shell / found.limit * 0.6, mode.error, mode.mac)
            assert mine == pytest.approx((row.over_plate, row.error, row.mac), abs=1e-4)


@pytest.mark.matrix
def test_displacements_are_those_of_the_study(miura):
    """Case study 2 of docs/fidelity.md: 23.9 mm, -28 % and +0.6 % beside 8 and 16 divisions."""
    result = miura[1].result
    assert float(result["deflection"]) == pytest.approx(23.95e-3, abs=1e-4)
    assert result["deflection_error"].values == pytest.approx([-0.28, 0.005, 0.024], abs=5e-3)
    assert 0.0 < float(result["deflection_mesh_error"]) < 0.02  # a coarser mesh is softer


@pytest.mark.matrix
def test_the_models_of_case_study_2(miura):
    """The case's own is "standard", which is left out; each finer model has smaller errors.

    Edges that bow, as n5b8e's do, have shapes of plates, too, above the limit.
    """
    case, found = miura
    assert found.models == ("own", "plate", "n5b8e")
    own, plate, edges = (found.table(model) for model in found.models)
    assert max(abs(m.error) for m in edges if m.below) < 0.02
    assert max(abs(m.error) for m in plate if m.below) < 0.06
    assert max(abs(m.error) for m in own if m.below) > 0.4
    assert max(m.mac for m in plate if not m.below) < 0.82
    assert all(m.mac > 0.9 and 0.0 < m.error < 0.2 for m in edges[3:7])
    assert any(math.isinf(m.error) and m.mac < 0.5 for m in plate)  # a plate's mode, lost
    assert found.holds_to() == 0.0 and found.holds_to("n5b8e") == edges[2].shell
    assert found.notes == (SCOPE,)
    assert repr(found) == "<Fidelity of own, plate, n5b8e: 8 modes, 3 below 3.835 Hz>"
    assert fd.case_of(found.result).loads == case.loads


@pytest.mark.matrix
def test_warnings_of_the_case_are_not_repeated(recwarn):
    partly = [fd.Fix([0, 1, 2, 3]), fd.Impose([4], "z", 0.1)]
    case = fd.Case(fold(**PLATE), partly, [fd.Force([4, 5], (0, 0, 1e-4))])
    assert len(recwarn) == 1  # the force acts in part where a node is moved
    found = fd.fidelity(case, 2, reference="shell", divisions=(2, 4))
    assert len(recwarn) == 1
    assert "small loads" in str(found)


@pytest.mark.matrix
def test_printed_lines_are_short(quick):
    text = str(quick[1])
    assert max(map(len, text.splitlines())) <= 79
    assert quick[1].notes[-1] == " ".join(text.split("\n\n")[-1].splitlines())


@pytest.mark.matrix
def test_a_case_with_the_right_model_keeps_it():
    found = fd.fidelity(
        fd.Case(fold(**PLATE), [fd.Fix([0, 1, 2, 3])]), 2, reference="shell", divisions=(4, 8)
    )
    assert found.models == ("own", "standard", "n5b8e")
    assert "deflection" not in found.result


@pytest.mark.matrix
def test_a_free_sheet_has_no_displacement_under_its_weight():
    case = fd.Case(fold(**PLATE), [], [fd.Gravity((0, 0, -9.81))])
    result = fd.fidelity(case, 2, reference="shell", divisions=(2, 4), models=[]).result
    assert result.attrs["rigid"] == 6
    assert "deflection" not in result
    assert (result["frequency"] > 0.0).all()


@pytest.mark.matrix
def test_superlinear_bends_have_no_stiffness(quick):
    case, found = quick
    assert found.models == ("own", "standard", "plate", "n5b8e")
    assert int(found.result["soft_hinges"].sel(model="own")) == 8
    assert np.isinf(found.result["deflection_error"].sel(model="own"))
    errors = found.result["deflection_error"].sel(model=["plate", "n5b8e"])
    np.testing.assert_allclose(errors, 0.0, atol=0.01)
    assert found.notes[0].startswith("8 hinges of the case's own model are superlinear")
    assert "soft" in str(found)
    assert "\nsoft: the model at rest has no stiffness against these loads\n" in str(found)
    swung = fd.fidelity(case, 3, reference="shell", divisions=(2, 4), models=["plate"], secant=5.0)
    assert np.isfinite(swung.result["deflection_error"]).all()
    assert not any("no stiffness" in note for note in swung.notes)


@pytest.mark.matrix
def test_a_kresling_cell_vibrates_as_plates():
    """Triangles that are held at their base have no mode below the limit: take the shell."""
    pattern = fd.patterns.kresling(sides=6, radius=1.0, height=0.9, twist=30)
    case = fd.Case(fd.discretize(pattern, SHEET, **PLATE), [fd.Fix("zmin")])
    found = fd.fidelity(case, 3, reference="shell", divisions=(2, 4), models=["standard"])
    assert not any(mode.below for mode in found.table())
    assert found.table()[1].shell == pytest.approx(found.table()[2].shell, rel=1e-3)  # symmetry
    assert str(found).count(" * ") == 3
    assert "\n* above 0.6 of the plate frequency, 1.365 Hz" in str(found)


@pytest.mark.matrix
def test_a_legend_says_what_words_of_the_table_mean(quick):
    """Those that occur in it: where nothing is lost, nothing is said of it."""
    result = quick[1].result.copy(deep=True)
    result["error"][:] = result["deflection_error"][:] = 0.01
    result.attrs["limit"] = 1e9
    words = legend(fd.Fidelity(result))
    assert words == ["own: the model of the case"]
    result["error"][0, 1] = np.inf
    lost = "lost: no mode of the model has this shape (MAC below 0.5)"
    assert legend(fd.Fidelity(result)) == [*words, lost]
    assert set(words) < set(str(fd.Fidelity(result)).splitlines())


def test_it_is_read_as_it_was_saved(quick, tmp_path):
    _, found = quick
    fd.save(found.result, tmp_path / "fidelity.nc")
    again = fd.Fidelity(fd.load(tmp_path / "fidelity.nc"))
    assert str(again) == str(found)
    np.testing.assert_array_equal(again.table("plate"), found.table("plate"))


def test_the_shell_is_held_and_loaded_as_the_case():
    pattern = fd.patterns.miura((2, 1), panel_angle=60, dihedral=80)
    options = {"fold_law": "linear", "crease_stiffness": {"mountain": 0.2}, "clamped": [(0, 1)],
               "rigid": [1]}  # fmt: skip
    structure = fd.discretize(pattern, SHEET, **options, **STANDARD)
    supports = [fd.Fix("xmin"), fd.Spring(3.0, [12]), fd.Link([13, 14], "z"), fd.BaseMotion("x")]
    loads = [fd.TotalForce((0, 0, 2.0), edges="xmax"), fd.Pressure(0.5)]
    case = fd.Case(structure, supports, loads, fd.Rayleigh(0.1), [fd.PointMass([8], 0.7)])
    made = shell_of(case, 4)
    for name in ("supports", "loads", "masses"):
        assert getattr(made, name) == getattr(case, name)
    assert made.rayleigh == fd.Rayleigh()
    for name in options:
        assert getattr(made.structure.options, name) == getattr(structure.options, name)
    np.testing.assert_allclose(made.structure.fold_stiffness, structure.fold_stiffness)
    held = np.flatnonzero(made.fixed[: len(pattern.vertices)].all(axis=1))
    np.testing.assert_array_equal(held, [0, 1, 2])
    assert made.total_mass == pytest.approx(case.total_mass)
    mean = [rest_forces(one).reshape(-1, 3).sum(axis=0) for one in (case, made)]
    np.testing.assert_allclose(mean[0], mean[1], rtol=1e-6, atol=1e-12)
    assert np.abs(mean[0]).max() > 2.0  # the pressure, too


@pytest.mark.matrix
def test_what_is_no_force_is_left_out():
    """Of an actuated and heated fold under a force only the force counts."""
    push = fd.Force([4, 5], (0, 0, 1e-4))
    case = held(fd.Actuate("all", 100), push, fd.CreaseMoment("all", 1e-3))
    alone, others = forces_alone(case)
    assert (alone.loads, others) == ((push,), [0, 2])
    found = fd.fidelity(case, 1, reference="shell", divisions=(2, 4), models=[])
    assert found.result.attrs["not_forces"] == "loads[0], loads[2]"
    expected = fd.fidelity(held(push), 1, reference="shell", divisions=(2, 4), models=[])
    assert float(found.result["deflection"]) == float(expected.result["deflection"])


def test_pressure_is_a_force():
    """On a plate of two flat rigid panels under a small pressure: p b a^2/2 on the crease k."""
    structure = fd.discretize(
        strip(2), SHEET, crease_stiffness=0.1, rigid="all", fold_law="linear", preset="plate"
    )
    case = fd.Case(structure, [fd.Fix([0, 1, 3, 4])], [fd.Pressure(1e-3, [1])])
    turn = 1e-3 * 0.5 / 0.1  # rad
    assert small_loads(case).work == pytest.approx(1e-3 * 0.5 * turn, rel=2e-2)


@pytest.mark.parametrize(
    ("panels", "given", "expected"),
    [(4, None, (6, 12)), (4, (4, 9), (4, 9)), (60, None, (5, 10)), (400, None, (2, 4))],
)
def test_divisions(panels, given, expected, recwarn):
    assert meshes(strip(panels), given) == expected
    told = [str(one.message) for one in recwarn]
    assert len(told) == (panels > 4)
    if told:
        assert f"would have {288 * panels} triangles: it has {expected[1]} divisions" in told[0]


def test_triangles_are_counted():
    patterns = [strip(3), fd.patterns.kresling(sides=5, radius=1.0, height=0.9, twist=20)]
    angle = np.arange(6) * np.pi / 3
    patterns.append(fd.Pattern(np.column_stack([np.cos(angle), np.sin(angle)]), [range(6)]))
    for pattern in patterns:
        made = fd.shell(pattern, SHEET, divisions=4)
        assert triangle_count(pattern, 4) == len(made.triangles)


def test_a_shell_too_large_is_refused():
    with pytest.raises(InputError, match="divisions: the shell of 500 panels would have 16000"):
        fd.fidelity(fd.Case(LONG), reference="shell", models=[])


@pytest.mark.matrix
def test_superelements_are_the_reference_by_default(quick):
    """They and the shell, graded alike, have the same limits, also under gravity and pressure."""
    case = held(fd.Gravity((0.0, 0.0, -9.81)), fd.Pressure(2.0, [1]), fd.Force([4], (0, 0, 0.1)))
    radius = SHEET.thickness
    found = fd.fidelity(case, 4, models=[]).result
    shell = fd.fidelity(
        case, 4, reference="shell", divisions=(8, 12), models=[], vertex_radius=radius
    ).result
    np.testing.assert_allclose(found["frequency"], shell["frequency"], rtol=0.01)
    np.testing.assert_allclose(found["error"], shell["error"], atol=0.02)
    assert float(found["deflection"]) == pytest.approx(float(shell["deflection"]), rel=0.01)
    assert (found["mesh_error"] < 0.02).all() and float(found["deflection_mesh_error"]) < 0.01
    assert found.attrs["reference"] == "superelements" and "divisions" not in found.attrs


@pytest.mark.matrix
def test_models_of_ones_own(quick):
    case, _ = quick
    found = fd.fidelity(
        case,
        2,
        reference="shell",
        divisions=(2, 4),
        models={"bubble": {**PLATE, "mass": "bubble"}, "same": {}},
    )
    assert found.models == ("own", "bubble")
    assert found.result["options"].values.tolist() == [
        'calibration = "standard", mass = "mixed_voronoi", bend_law = "superlinear"',
        'calibration = "plate", mass = "bubble", bend_law = "linear"',
    ]
    cut = comparison(held(scheme="n4b5", **STANDARD), 2, models=["plate"])
    assert cut.compared["plate"].structure.options.scheme == "n5b8"
    assert set(MODELS) == {"standard", "plate", "n5b8e", "bars"}


def test_what_n5b8e_does_not_take_leaves_it_out():
    """By default, where no model is named; clamped edges go with all models."""
    soft = held(**STANDARD, fold_law="superlinear")  # no slope at rest
    assert list(comparison(soft, 1, "shell", (2, 4)).compared) == ["own", "plate"]
    clamped = held(**STANDARD, clamped=[(0, 1)])
    assert list(comparison(clamped, 1).compared) == ["own", "plate", "n5b8e"]


@pytest.mark.matrix
def test_a_rest_state_out_of_balance_is_told():
    case = held(crease_rest=80.0, **STANDARD)
    with pytest.warns(FoldynWarning, match="the rest state is no equilibrium"):
        fd.fidelity(case, 1, reference="shell", divisions=(2, 4), models=[])


def made_up(frequency, errors, reference="shell", **more):
    """A comparison with made-up errors."""
    (k, m), facts = np.shape(errors), {"limit": 100.0, "reference": reference}
    values = {
        "frequency": frequency, "mesh_error": np.full(k, 0.001), "error": errors,
        "mac": np.where(np.isinf(errors), 0.1, 0.99),
        "options": ["a", "b"][:m], "soft_hinges": [0] * m, **more,
    }  # fmt: skip
    return fd.Fidelity(fidelity_dataset(held(), ["own", "plate"][:m], values, facts))


def test_models_hold_up_to_the_first_mode_that_they_miss():
    found = made_up([10.0, 20.0, 30.0], [[0.5, 0.01], [0.0, -0.02], [0.0, np.inf]])
    assert (found.holds_to(), found.holds_to("plate")) == (0.0, 20.0)
    assert made_up([10.0, 20.0], [[0.02], [-0.09]]).holds_to() == 20.0
    (row,) = (line for line in str(found).splitlines() if line.startswith("10 % up to"))
    assert row.split() == ["10", "%", "up", "to", "0", "Hz", "20", "Hz"]


@pytest.mark.parametrize(
    ("reference", "error", "told"),
    [
        ("shell", -0.05, "The finer mesh of the shell is itself about 5.0 % off"),
        ("shell", np.nan, "The meshes of the shell have not converged for mode 2, so that"),
        ("superelements", 0.03, "The superelements are themselves up to 3.0 % off"),
    ],
)
def test_errors_of_the_reference_are_told(reference, error, told):
    exact = [[0.0, 0.0], [0.0, 0.0]]
    found = made_up([10.0, 20.0], exact, reference, mesh_error=np.array([0.0, error]))
    assert found.notes[0].startswith(told)
    assert made_up([10.0, 20.0], exact, reference).notes == (SCOPE,)


def test_percent():
    found = [percent(x) for x in (0.021, -0.34, 1.5, -0.0004)]
    assert found == ["+2.1 %", "-34 %", "+150 %", "-0.0 %"]


def heavier(case):
    return replace(case.structure, bar_area=2 * case.structure.bar_area)


def massless(case):
    return fd.discretize(case.structure.pattern, replace(SHEET, density=None), preset="plate")


CENTER = r"nodes: node {} is the center of panel {}"


@pytest.mark.parametrize(
    ("change", "message"),
    [
        (lambda c: c.structure, r"case: got Structure, give a Case"),
        (
            lambda c: fd.Case(fd.shell(c.structure.pattern, SHEET, divisions=3)),
            r"case: its model is shell, .*",
        ),
        (
            lambda c: fd.Case(heavier(c)),
            r"case: its structure was changed after fd.discretize made it",
        ),
        (lambda c: fd.Case(massless(c)), r"sheet.density: missing; frequencies need it \(kg/m3\)"),
        (lambda c: replace(c, supports=[fd.Fix([7], "z")]), CENTER.format(7, 1) + ", .* 0 to 5"),
        (
            lambda c: replace(c, loads=[fd.Force([6], (0, 0, 1.0))], supports=()),
            CENTER.format(6, 0),
        ),
        (lambda c: replace(c, masses=[fd.PointMass([6], 1.0)]), CENTER.format(6, 0)),
        (lambda c: replace(c, supports=[fd.Link([7], to=[2, 3, 4])]), CENTER.format(7, 1)),
        (lambda c: fd.Case(ARROW), r"panel 0 .* not convex enough to be meshed"),
        (
            lambda c: replace(c, structure=SQUARE, supports=CORNERS),
            "^supports: hold every node alo",
        ),
    ],
)
def test_cases_that_are_refused(change, message):
    with pytest.raises(InputError, match=message):
        fd.fidelity(change(held()), models=[])


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        ({"reference": "beam"}, 'reference = "beam"'),
        ({"divisions": (4, 8)}, "divisions = [4, 8]: are those of the shell"),
        ({"count": 0}, "count = 0: must be a whole number, at least 1"),
        (
            {"divisions": 12, "reference": "shell"},
            "divisions = 12: give two numbers, as in (6, 12)",
        ),
        (
            {"divisions": (8, 8), "reference": "shell"},
            "divisions = [8, 8]: the second mesh must be the finer one",
        ),
        (
            {"divisions": (0, 8), "reference": "shell"},
            "divisions = 0: must be a whole number, at least 2",
        ),
        ({"secant": 0.0}, "secant = 0.0: must be"),
        ({"models": "plate"}, 'models = "plate": give a list of names, as ["plate"]'),
        ({"models": ["plates"]}, "models = \"plates\": did you mean 'plate'? choose one of"),
        ({"models": {"own": {}}}, 'models: "own": give arguments of discretize by the name'),
        ({"models": {"a": {"massed": 1}}}, 'models: a: argument = "massed": did you mean'),
        ({"models": {"a": {"mass": "heavy"}}}, 'models: a: mass = "heavy": choose one of'),
    ],
)
def test_arguments_that_are_refused(arguments, message):
    with pytest.raises(InputError) as caught:
        compare_models(held(), **arguments)
    assert str(caught.value).startswith(message)


@pytest.mark.matrix
def test_a_model_that_cannot_move_is_refused():
    moving = fd.Case(fd.discretize(SQUARE.pattern, SHEET, bend_law="linear"), CORNERS)
    with pytest.raises(InputError, match=r"^models: cut: supports: hold every node"):
        fd.fidelity(moving, models={"cut": {"scheme": "n4b5"}})
    rows = fd.fidelity(moving, 6, reference="shell", divisions=(3, 6), models=[]).table()
    assert [row.shell for row in rows] == sorted(row.shell for row in rows)  # extrapolated, too
    assert rows[0].mac == 0.0  # nothing moves where both have nodes


@pytest.mark.matrix
def test_only_comparisons_are_shown(quick):
    case, found = quick
    with pytest.raises(InputError, match=r"result: is a result of the kind modes; give one of"):
        fd.Fidelity(fd.modes(replace(case, loads=()), 1, secant=1.0))
    with pytest.raises(InputError, match="result: is no result"):
        fd.Fidelity(found)  # type: ignore[arg-type]
    with pytest.raises(InputError, match="model = \"plates\": did you mean 'plate'"):
        found.table("plates")


@pytest.mark.matrix
def test_graded_shells_agree_with_even_ones():
    """A free sheet has the same limits, within what both say they are off."""
    pattern = fd.patterns.miura(cells=(1, 1), a=0.05, b=0.05, panel_angle=60, dihedral=90)
    sheet = fd.Sheet(2e9, 0.3, 1e-3, density=700.0)
    case = fd.Case(fd.discretize(pattern, sheet, preset="plate"))
    even = fd.fidelity(case, 5, models=["n5b8e"], reference="shell")
    graded = fd.fidelity(case, 5, models=["n5b8e"], reference="shell", vertex_radius=1e-3)
    assert list(graded.result.attrs["divisions"]) == [8, 12]
    assert "shell: graded toward vertices, within 0.001 m" in str(graded)
    assert "graded" not in str(even)
    for one, other in zip(even.table(), graded.table(), strict=True):
        off = abs(one.mesh_error) + abs(other.mesh_error)
        assert other.shell == pytest.approx(one.shell, rel=off)
        assert off < 0.03


def test_divisions_of_graded_shells():
    case = held()
    for given in ((4, 8), (8, 10)):
        with pytest.raises(InputError, match="with a vertex_radius the first is a multiple of 8"):
            fd.fidelity(case, reference="shell", divisions=given, vertex_radius=0.01)
    with pytest.raises(InputError, match=r"shell: vertex_radius = 0.4: "):
        fd.fidelity(case, reference="shell", vertex_radius=0.4)
