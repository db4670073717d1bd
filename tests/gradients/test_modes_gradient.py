"""Gradients of modes, against differences of the modes and what is known otherwise."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from differences import Design

import foldyn as fd
from foldyn.errors import InputError

PRESETS = ("merlin2", "plate", "n5b8e")
MODES = {"kind": "modes", "count": 4}


def cell(
    panel_angle: float = 63.0, thickness: float = 0.02, stiffness: Any = 0.02, density: float = 900,
    preset: Any = "plate", supports: Any = ("xmin",), **options: Any,
) -> fd.Case:  # fmt: skip
    pattern = fd.patterns.miura(panel_angle=panel_angle)
    sheet = fd.Sheet(1e6, 0.25, thickness, density)
    made = fd.discretize(pattern, sheet, preset=preset, crease_stiffness=stiffness, **options)
    return fd.Case(made, [fd.Fix(part) for part in supports], damping=[fd.Rayleigh(0.3, 2e-4)])


def build(preset: Any) -> Any:
    options = {} if preset != "merlin2" else {"bend_law": "linear"}
    return lambda **given: cell(preset=preset, **options, **given)


@pytest.mark.matrix
@pytest.mark.parametrize("preset", PRESETS)
@pytest.mark.parametrize(
    ("measures", "closely"),
    [(["frequency[1]", "frequency[3]", "damping_ratio[2]"], 1e-6), (["effective_mass[2,z]"], 1e-5)],
)
def test_gradients_agree_with_differences(preset, measures, closely):
    stiffness = np.random.default_rng(1).uniform(0.01, 0.03, 4)
    values = {"thickness": 0.02, "stiffness": stiffness, "density": 900.0}
    design = Design(build(preset), values, measures, MODES)
    design.step = 4e-3  # eigenvalues have nine digits, and masses hardly depend on stiffness
    errors = design.errors()
    assert max(errors.values()) < closely, errors


@pytest.mark.matrix
@pytest.mark.parametrize("preset", PRESETS)
def test_gradients_by_the_shape_of_panels(preset):
    design = Design(build(preset), {"panel_angle": 61.7}, ["frequency[1]", "frequency[2]"], MODES)
    assert max(design.errors().values()) < 1e-6


@pytest.mark.parametrize("preset", [None, "plate"])
def test_translations_on_springs_turn_nothing(preset):
    """A mass, and a rigid plate of one panel: f = sqrt(n k / m) / (2 pi), on n springs."""

    def build(k: float) -> fd.Case:
        corners = np.array([[0.0, 0, 0], [1, 0, 0], [1, 2, 0], [0, 2, 0]])
        sheet = fd.Sheet(1e9, 0.3, 0.01, 900)
        if preset is None:
            none = np.zeros((0, 2), int), np.zeros(0)
            made = fd.Structure(corners[:1], *none, sheet, node_mass=np.array([18.0]))
        else:
            pattern = fd.Pattern(corners, [[0, 1, 2, 3]])
            made = fd.discretize(pattern, sheet, preset=preset, rigid="all")
        nodes = list(range(len(made.nodes)))
        return fd.Case(made, [fd.Fix(nodes, "xy"), fd.Spring(k, nodes=nodes, direction="z")])

    modes = {"kind": "modes", "count": 1}
    found = fd.sensitivity(build, {"k": 3.0}, measures="frequency[1]", analysis=modes)
    exact = np.sqrt(3.0 * len(build(3.0).structure.nodes) / 18.0) / (2.0 * np.pi)
    np.testing.assert_allclose(found.value, exact, rtol=1e-10)
    np.testing.assert_allclose(found.gradient_k, exact / 6.0, rtol=1e-10)


@pytest.mark.matrix
def test_how_near_panels_are_at_rest():
    def folded(dihedral: float, panel_angle: float) -> fd.Case:
        pattern = fd.patterns.miura((2, 1), panel_angle=panel_angle, dihedral=dihedral)
        return fd.Case(
            fd.discretize(pattern, fd.Sheet(1e6, 0.25, 0.01, 1.0), preset="plate"), [fd.Fix("xmin")]
        )

    values = {"dihedral": 43.0, "panel_angle": 63.0}
    assert max(Design(folded, values, ["clearance"], MODES).errors().values()) < 1e-6
    with pytest.raises(InputError, match="has no finite value"):
        fd.sensitivity(cell, {"density": 900.0}, measures="clearance", analysis=MODES)

    def crossed(height: float) -> fd.Case:
        square = np.array([[0.0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0]])
        points = np.vstack([square, square[:, [0, 2, 1]] + np.array([0.3, 0.4, height])])
        pattern = fd.Pattern(points, [(0, 1, 2, 3), (4, 5, 6, 7)])
        return fd.Case(
            fd.discretize(pattern, fd.Sheet(1e6, 0.25, 0.01, 1.0), preset="plate"),
            [fd.Fix([0, 1, 3])],
        )

    assert fd.sensitivity(crossed, {"height": 0.2}, measures="clearance", analysis=MODES)[
        "gradient_height"
    ].item() == pytest.approx(1.0)
    with pytest.raises(InputError, match="panels touch or cross"):
        fd.sensitivity(crossed, {"height": -0.5}, measures="clearance", analysis=MODES)


@pytest.mark.parametrize("seed", [3, 4])
def test_the_remainder_falls_with_the_second_order(seed):
    values = {"thickness": 0.02, "stiffness": np.full(4, 0.02)}
    design = Design(build("merlin2"), values, ["frequency[1]", "frequency[2]"], MODES)
    assert (design.order(seed, (2e-1, 2e-2, 2e-3, 2e-4)) > 1.9).all()


def test_all_frequencies_scale_with_the_root_of_all_stiffness_over_mass():
    case = cell(mass="mixed_voronoi")
    found = fd.sensitivity(
        case, ["node_mass", "fold_stiffness"], measures="frequency[2]", analysis=MODES
    )
    own = found["value"].values[0]
    by_mass = found["gradient_node_mass"].values[0] @ case.mass.diagonal()
    assert by_mass == pytest.approx(-0.5 * own, rel=1e-9)


def test_what_a_mass_does_at_a_node_is_what_its_shape_says():
    """d lambda = -lambda phi_i' phi_i for a mass at node i (Rayleigh's quotient)."""
    case = cell(mass="mixed_voronoi")
    found = fd.sensitivity(case, ["node_mass"], measures="frequency[1]", analysis=MODES)
    modes = fd.modes(case, count=4)
    shape, frequency = modes["shape"].values[0], float(modes["frequency"][0])
    expected = -0.5 * frequency * (shape**2).sum(axis=1)
    assert found["gradient_node_mass"].values[0] == pytest.approx(expected, rel=1e-8, abs=1e-10)


def test_rayleigh_damping_of_a_mode():
    def damped(alpha: float, beta: float) -> fd.Case:
        made = cell()
        return fd.Case(made.structure, made.supports, damping=[fd.Rayleigh(alpha, beta)])

    values = {"alpha": 0.3, "beta": 2e-4}
    found = fd.sensitivity(
        damped, values, measures=["damping_ratio[1]", "frequency[1]"], analysis=MODES
    )
    omega = 2.0 * np.pi * found["value"].values[1]
    assert found["gradient_alpha"].values[0] == pytest.approx(0.5 / omega, rel=1e-9)
    assert found["gradient_beta"].values[0] == pytest.approx(0.5 * omega, rel=1e-9)


# ------------------------------------------------------------------ states under load
@pytest.mark.matrix
def test_modes_about_an_equilibrium_feel_its_change():
    def loaded(force: float, stiffness: float) -> fd.Case:
        made = cell(stiffness=stiffness)
        return fd.Case(made.structure, made.supports, [fd.Force("xmax", (force, 0.0, 0.4 * force))])

    values = {"force": 0.05, "stiffness": 0.02}
    about = {**MODES, "state": "equilibrium"}
    errors = Design(loaded, values, ["frequency[1]", "frequency[2]"], about).errors()
    assert max(errors.values()) < 1e-6, errors
    unloaded = fd.sensitivity(cell(), ["fold_stiffness"], measures="frequency[1]", analysis=MODES)
    changed = fd.sensitivity(
        loaded(**values), ["fold_stiffness"], measures="frequency[1]", analysis=about
    )
    name = "gradient_fold_stiffness"
    assert not np.allclose(unloaded[name], changed[name], rtol=1e-2)


@pytest.mark.parametrize(
    ("preset", "law", "force"),
    [
        ("herkal", "superlinear", 0.02),
        ("herkal", "superlinear", 2e-3),  # some bends so near rest that they count as soft
        ("plate", fd.PlateSuperlinear(onset=0.02), 0.02),
    ],
)
def test_bends_near_a_kink_of_their_law(preset, law, force):
    """The slope of a superlinear bend changes fast near rest, where a load has turned it a little.

    With all stiffness times a factor and the load as well, the state stays: frequencies have half
    of the factor's exponent.
    """

    def loaded(modulus: float, stiffness: float, force: float) -> fd.Case:
        pattern = fd.patterns.miura(panel_angle=62.0, b=1.1, dihedral=95.0)
        made = fd.discretize(pattern, fd.Sheet(modulus, 0.25, 0.02, 800.0), preset=preset,
                             bend_law=law, crease_stiffness=stiffness)  # fmt: skip
        held = [fd.Fix(list(pattern.faces[0]))]
        return fd.Case(made, held, [fd.Force([8], (0.0, 0.3 * force, force))])

    about = {**MODES, "state": "equilibrium"}
    values = {"modulus": 1e6, "stiffness": 0.03, "force": force}
    design = Design(loaded, values, ["frequency[2]", "frequency[3]"], about)
    found, own = design.gradient(), design.numbers({})
    assert design.difference({"stiffness": 0.03}) == pytest.approx(
        0.03 * found["stiffness"], rel=1e-4
    )
    whole = sum(values[name] * found[name] for name in values)
    assert whole == pytest.approx(0.5 * own, rel=1e-5)


# ------------------------------------------------------------------ dofs without mass
@pytest.mark.matrix
@pytest.mark.filterwarnings("ignore:the rest state is no equilibrium")
@pytest.mark.parametrize("model", ["n5b8e", "shell"])
@pytest.mark.parametrize("analysis", ["modes", "frf"])
def test_what_has_no_mass_stays_in_balance(model, analysis):
    """Creases that are not at their rest angle bend the panels, more or less with the design."""
    pattern = fd.patterns.miura(panel_angle=62.0, b=1.1, dihedral=95.0)
    rest = np.degrees(fd.discretize(pattern, fd.Sheet(1e6, 0.25, 0.02), preset="plate").fold_rest)

    def build(thickness: float, stiffness: float) -> fd.Case:
        sheet = fd.Sheet(1e6, 0.25, thickness, 800.0)
        options = {
            "crease_stiffness": stiffness,
            "crease_rest": rest + 12.0 * np.array([1.0, 0.8, -1.0, 0.5]),
        }
        shell = model == "shell"
        made = (
            fd.shell(pattern, sheet, divisions=2, **options)
            if shell
            else fd.discretize(pattern, sheet, preset=model, **options)
        )
        return fd.Case(made, [fd.Fix([0, 1, 4, 3])], damping=fd.Rayleigh(0.2, 1e-2))

    measures, given = ["frequency[1]", "damping_ratio[2]"], {"kind": "modes", "count": 3}
    if analysis == "frf":
        push = [fd.Force([8], (0.0, 0.0, 1.0))]
        measures, given = ["response[8,z,1]"], {"kind": "frf", "drive": push, "frequencies": [1.0]}
    values = {"thickness": 0.02, "stiffness": 0.15}
    errors = Design(build, values, measures, given).errors()
    assert max(errors.values()) < 1e-6, errors


# ------------------------------------------------------------------ several modes at once
def square(one: float = 0.02, other: float = 0.02, thickness: float = 0.02) -> fd.Case:
    """A flat sheet of 2 x 2 squares held in its middle, whose bending modes come in pairs."""
    grid = np.array([[i, j, 0.0] for i in range(3) for j in range(3)]) - 1.0
    grid[:, 2] = 0.0
    faces = [(0, 3, 4, 1), (1, 4, 5, 2), (3, 6, 7, 4), (4, 7, 8, 5)]
    pattern = fd.Pattern(grid, faces)
    along = np.ptp(pattern.vertices[pattern.creases][..., 0], axis=1) > 0.5
    sheet = fd.Sheet(1e6, 0.25, thickness, 900.0)
    stiffness = np.where(along, one, other).tolist()
    made = fd.discretize(pattern, sheet, preset="plate", crease_stiffness=stiffness)
    return fd.Case(made, [fd.Fix([4]), fd.Fix([1, 3, 5, 7], "xy")])


def pair() -> int:
    """Number of the first of two modes that have one frequency."""
    frequency = fd.modes(square(), count=8)["frequency"].values
    near = np.flatnonzero(np.abs(np.diff(frequency)) < 1e-7 * frequency[1:])
    assert len(near)
    return int(near[0]) + 1


PAIR = {"kind": "modes", "count": 8}


def test_one_of_two_modes_with_one_frequency_has_no_derivative():
    k = pair()
    with pytest.raises(InputError, match=r"have the same frequency.*the sum of all.*along"):
        fd.sensitivity(
            square, {"one": 0.02, "other": 0.02}, measures=f"frequency[{k}]", analysis=PAIR
        )


def test_their_sum_has_one():
    k = pair()
    both = f"frequency[{k}] + frequency[{k + 1}]"
    found = fd.sensitivity(square, {"one": 0.02}, measures=both, analysis=PAIR)

    def total(one: float) -> float:
        frequency = fd.modes(square(one), count=8)["frequency"].values
        return float(frequency[k - 1] + frequency[k])

    h = 1e-5
    slope = (total(0.02 + h) - total(0.02 - h)) / (2.0 * h)
    assert found["gradient_one"].values[0] == pytest.approx(slope, rel=1e-5)


@pytest.mark.matrix
@pytest.mark.parametrize("rates", [{"one": 1.0}, {"one": 0.3, "other": -1.0}, {"thickness": 1.0}])
def test_each_has_derivatives_in_one_direction(rates):
    k = pair()
    values = {"one": 0.02, "other": 0.02, "thickness": 0.02}
    names = [f"frequency[{k}]", f"frequency[{k + 1}]"]
    found = fd.sensitivity(square, values, measures=names, analysis=PAIR, along=rates)[
        "derivative"
    ].values

    def at(h: float) -> np.ndarray:
        moved = {name: value + h * rates.get(name, 0.0) for name, value in values.items()}
        return fd.modes(square(**moved), count=8)["frequency"].values[k - 1 : k + 1]

    h = 1e-6
    one_sided = (-3.0 * at(0.0) + 4.0 * at(h) - at(2.0 * h)) / (2.0 * h)
    assert found == pytest.approx(one_sided, rel=1e-4, abs=1e-8)


@pytest.mark.matrix
@pytest.mark.filterwarnings("ignore:the rest state is no equilibrium")
def test_so_they_have_where_dofs_without_mass_move_along():
    """Of a pyramid on guides, whose creases are not at their rest angle."""
    corners = [(1.0, 1.0, 0.0), (-1.0, 1.0, 0.0), (-1.0, -1.0, 0.0), (1.0, -1.0, 0.0)]
    pattern = fd.Pattern([*corners, (0.0, 0.0, 0.6)], [(k, (k + 1) % 4, 4) for k in range(4)])

    def build(thickness: float) -> fd.Case:
        made = fd.discretize(pattern, fd.Sheet(1e6, 0.25, thickness, 900.0), preset="n5b8e",
                             crease_stiffness=0.1, crease_rest=200.0)  # fmt: skip
        return fd.Case(made, [fd.Fix([4]), fd.Fix([0, 1, 2, 3], "xy")])

    def both(h: float) -> np.ndarray:
        return fd.modes(build(0.02 + h), 4)["frequency"].values[1:3]

    names, rates, four = ["frequency[2]", "frequency[3]"], {"thickness": 1.0}, {**MODES, "count": 4}
    found = fd.sensitivity(build, {"thickness": 0.02}, measures=names, analysis=four, along=rates)[
        "derivative"
    ]
    h = 1e-5
    assert np.ptp(both(0.0)) < 1e-9
    assert found.values == pytest.approx((both(h) - both(-h)) / (2.0 * h), rel=1e-5)


# ------------------------------------------------------------------ what has none
@pytest.mark.parametrize(
    ("measures", "analysis", "told"),
    [
        ("frequency[1]", {**MODES, "secant": 1.0}, "finite amplitude.*leave that out"),
        ("unstable_modes", MODES, "has no derivative; measures with one are"),
        ("frequencies", MODES, r"measures\[0\]: frequencies is an array; ask for one"),
        ("frequency[9]", MODES, "raise analysis.count"),
    ],
)
def test_refused(measures, analysis, told):
    with pytest.raises(InputError, match=told):
        fd.sensitivity(
            cell(preset="n5b8e"), ["fold_stiffness"], measures=measures, analysis=analysis
        )


def test_rigid_modes_have_no_derivative():
    free = fd.Case(cell().structure)
    with pytest.raises(InputError, match=r"mode 1 is rigid or unstable.*hold the sheet"):
        fd.sensitivity(
            free,
            ["fold_stiffness"],
            measures="frequency[1]",
            analysis={"kind": "modes", "count": 8},
        )


def test_soft_hinges_have_no_part():
    """Superlinear bends have no slope at rest: nothing changes with their stiffness."""
    made = cell(preset="herkal", supports=("xmin", "xmax"))
    with pytest.warns(fd.errors.FoldynWarning, match="superlinear"):
        found = fd.sensitivity(
            made,
            ["bend_stiffness", "fold_stiffness"],
            measures="effective_mass[4,z]",
            analysis=MODES,
        )
    assert not found["gradient_bend_stiffness"].values.any()
    assert found["gradient_fold_stiffness"].values.any()
