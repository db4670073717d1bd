"""Gradients through motions by RK4, against differences of the motions and what is known."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from differences import Design

import foldyn as fd
from foldyn.dynamics import runge_kutta_adjoint
from foldyn.errors import InputError

MOTION = {"kind": "dynamics", "method": "rk4", "dt": 1e-3, "duration": 0.4, "every_steps": 20}
PRESETS = ("merlin2", "plate", "n5b8e")
MEASURES = (
    "displacement[8,z]", "displacement_at[8,x,0.2]", "velocity[7,z]", "maximum[8,z]",
    "integral[8,z]", "mean_square[7,z]", "largest_displacement",
)  # fmt: skip


def cell(
    force: float = 0.4, alpha: float = 0.5, stiffness: Any = 0.5, youngs: float = 1e5,
    lift: float = 0.0, beta: float = 0.0, preset: Any = "plate", **options: Any,
) -> fd.Case:  # fmt: skip
    pattern = fd.patterns.miura()
    sheet = fd.Sheet(youngs, 0.25, 0.03, 400.0)
    options |= {"bend_law": "linear"} if preset == "merlin2" else {}
    made = fd.discretize(pattern, sheet, preset=preset, crease_stiffness=stiffness, **options)
    supports: list[Any] = [fd.Fix("xmin"), fd.Spring(20.0, [8], direction=(0, 1, 1))]
    if lift:
        supports.append(fd.BaseMotion("z", fd.Ramp(0.3, smooth=True), lift))
    push = fd.Force("xmax", (0.3 * force, 0.1 * force, force), fd.HalfSine(0.3))
    return fd.Case(made, supports, [push], [fd.Rayleigh(alpha, beta)])


def built(preset: Any, **fixed: Any) -> Any:
    return lambda **given: cell(preset=preset, **fixed, **given)


@pytest.mark.matrix
@pytest.mark.parametrize("preset", PRESETS)
def test_gradients_agree_with_differences(preset):
    stiffness = np.random.default_rng(5).uniform(0.4, 0.6, 4)
    values = {"force": 0.4, "alpha": 0.5, "stiffness": stiffness}
    stretched = Design(built(preset), values, ["strain"], MOTION)
    stretched.step = 4e-3  # a difference of stretches near 1
    for design in (Design(built(preset), values, [*MEASURES], MOTION), stretched):
        errors = design.errors()
        assert max(errors.values()) < 1e-6, errors


@pytest.mark.matrix
@pytest.mark.parametrize("mass", ["mixed_voronoi", "consistent"])
def test_gradients_by_what_the_sheet_is_made_of(mass):
    values = {"youngs": 1e5, "force": 0.4}
    build = built("merlin2", mass=mass)
    errors = Design(build, values, ["displacement[8,z]", "mean_square[7,z]"], MOTION).errors()
    assert max(errors.values()) < 1e-6, errors


@pytest.mark.matrix
def test_supports_that_move_and_damping_of_the_stiffness():
    values = {"lift": 0.03, "youngs": 1e5, "beta": 1e-5}
    build = built("merlin2", mass="mixed_voronoi")
    errors = Design(build, values, ["displacement[8,z]"], MOTION).errors()
    assert max(errors.values()) < 1e-6, errors
    base = fd.sensitivity(build, values, measures="displacement[1,z]", analysis=MOTION)
    assert base["gradient_lift"].values[0] == pytest.approx(1.0, rel=1e-9)


@pytest.mark.matrix
@pytest.mark.parametrize("seed", [11, 12])
def test_the_remainder_falls_with_the_second_order(seed):
    values = {"force": 0.4, "alpha": 0.5, "stiffness": np.full(4, 0.5), "youngs": 1e5}
    design = Design(built("plate"), values, ["displacement[8,z]", "maximum[8,x]"], MOTION)
    assert (design.order(seed) > 1.9).all()


def test_a_linear_motion_is_proportional_to_its_force():
    found = fd.sensitivity(
        built("plate"), {"force": 1e-7}, measures="displacement[8,z]", analysis=MOTION
    )
    slope, value = found["gradient_force"].values[0], found["value"].values[0]
    assert slope == pytest.approx(value / 1e-7, rel=1e-5)


@pytest.mark.matrix
def test_few_kept_states_change_nothing(monkeypatch):
    """However steps are taken again, the gradient is the same to rounding."""
    values = {"force": 0.4, "stiffness": 0.5}
    once = {**MOTION, "every_steps": 400}
    whole = fd.sensitivity(built("plate"), values, measures="displacement[8,z]", analysis=once)
    monkeypatch.setattr(runge_kutta_adjoint, "ROOM", (4 * 3 * 3 * 13 * 8 * 3.0, 3 * 2 * 8 * 39.0))
    parts = fd.sensitivity(built("plate"), values, measures="displacement[8,z]", analysis=once)
    for name in values:
        assert parts[f"gradient_{name}"].values == pytest.approx(
            whole[f"gradient_{name}"].values, rel=1e-12
        )


@pytest.mark.matrix
def test_all_arrays_of_a_structure_at_once():
    case = cell(preset="merlin2", mass="mixed_voronoi")
    names = ["fold_stiffness", "fold_rest", "bend_stiffness", "bend_rest", "bar_area", "node_mass"]
    found = fd.sensitivity(case, names, measures="displacement[8,z]", analysis=MOTION)
    chance = np.random.default_rng(2)
    for name in names:
        own = getattr(case.structure, name)
        own = case.mass.diagonal() if own is None else own
        change = own * chance.uniform(0.5, 1.5, own.shape)

        def at(h: float, name: str = name, own: Any = own, change: Any = change) -> float:
            made = replace(case.structure, **{name: own + h * change})
            other = replace(case, structure=made)
            given = {key: value for key, value in MOTION.items() if key != "kind"}
            end = fd.simulate(other, **given)["displacement"][-1]
            return float(end.sel(node=8, axis="z"))

        h = 1e-3
        expected = (8.0 * (at(h) - at(-h)) - (at(2.0 * h) - at(-2.0 * h))) / (12.0 * h)
        slope = found[f"gradient_{name}"].values[0] @ change
        assert slope == pytest.approx(expected, rel=1e-6), name


def test_the_length_to_which_a_bar_is_cut():
    """One that is cut longer pushes as one whose ends came nearer, per unit of the strain."""
    case = cell(preset="merlin2", force=1e-9)
    found = fd.sensitivity(case, ["bar_length"], measures="displacement[8,z]", analysis=MOTION)
    slope = found["gradient_bar_length"].values[0]
    h = 1e-6
    free = ~case.fixed[case.structure.bars].any(axis=(1, 2))
    for bar in np.flatnonzero(free)[:2]:
        i, j = case.structure.bars[bar]
        along = case.structure.nodes[j] - case.structure.nodes[i]
        along = along / np.linalg.norm(along)
        youngs, area = case.structure.sheet.youngs_modulus, case.structure.bar_area[bar]
        push = h / case.structure.bar_length[bar] * youngs * area * along
        loads = [*case.loads, fd.Force([int(j)], push), fd.Force([int(i)], -push)]
        pushed = fd.Case(case.structure, case.supports, loads, case.damping)
        given = {key: value for key, value in MOTION.items() if key != "kind"}
        end, start = (fd.simulate(one, **given)["displacement"][-1] for one in (pushed, case))
        moved = float((end - start).sel(node=8, axis="z")) / h
        assert slope[bar] == pytest.approx(moved, rel=1e-3)


# ------------------------------------------------------------------ what has none
@pytest.mark.parametrize(
    ("changes", "told"),
    [({"method": "dormand_prince", "dt": None}, "rk4"), ({"method": "energy_momentum"}, "rk4")],
)
def test_methods_without_gradients(changes, told):
    with pytest.raises(InputError, match=told):
        fd.sensitivity(
            cell(), ["fold_stiffness"], measures="displacement[8,z]", analysis={**MOTION, **changes}
        )


@pytest.mark.parametrize(
    ("more", "told"),
    [
        ({"contact": fd.Contact()}, "contact"),
        ({"loads": [fd.Actuate([0], fraction=0.1, history=fd.Ramp(0.1))]}, "Actuate"),
        ({"loads": [fd.Pressure(5.0)]}, "Pressure"),
    ],
)
def test_cases_without_gradients(more, told):
    case = cell(stiffness=0.5)
    other = fd.Case(case.structure, case.supports, more.get("loads", ()), (), **{
        key: value for key, value in more.items() if key != "loads"
    })  # fmt: skip
    with pytest.raises(InputError, match=rf"no gradients.*{told}.*leave (that|it) out"):
        fd.sensitivity(other, ["fold_stiffness"], measures="displacement[8,z]", analysis=MOTION)


def test_a_size_of_zero_has_no_derivative():
    still = fd.Case(cell().structure, [fd.Fix("xmin")])
    with pytest.raises(InputError, match="is 0, where a size has no derivative"):
        fd.sensitivity(still, ["fold_stiffness"], measures="largest_displacement", analysis=MOTION)


@pytest.mark.matrix
@pytest.mark.filterwarnings("ignore:creases are damped")  # two nodes that are struck shake them
@pytest.mark.parametrize("method", ["rk4", "central_difference"])
@pytest.mark.parametrize("model", ["n5b8e", "shell"])
def test_gradients_through_dofs_that_have_an_inertia_of_their_own(model, method):
    """Also of one that begins in balance: it moves with the nodes."""
    pattern = fd.patterns.miura()
    speed = np.zeros((len(pattern.vertices), 3))
    speed[[7, 8], 2] = 0.4

    def build(youngs: float, damping: float) -> fd.Case:
        sheet, options = fd.Sheet(youngs, 0.25, 0.03, 400.0), {"crease_stiffness": 0.5}
        if model == "shell":
            made = fd.shell(pattern, sheet, divisions=1, mass="consistent", **options)
        else:
            made = fd.discretize(pattern, sheet, preset="n5b8e", **options)
        push = fd.Force("xmax", (0.1, 0.1, 0.3), fd.HalfSine(0.3))
        return fd.Case(made, [fd.Fix("xmin")], [push], fd.CreaseDamping(damping))

    made = build(1e5, 2e-3).structure
    velocity = np.zeros(made.nodes.shape)
    velocity[: len(speed)] = speed
    motion = {**MOTION, "method": method, "duration": 0.2, "initial": fd.State(None, velocity)}
    values = {"youngs": 1e5, "damping": 2e-3}
    errors = Design(build, values, ["displacement[8,z]", "mean_square[7,z]"], motion).errors()
    assert max(errors.values()) < 1e-5, errors  # the damping changes little
