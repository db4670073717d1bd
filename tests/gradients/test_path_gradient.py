"""Gradients along equilibrium paths, against differences of the paths and what is known."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from differences import Design
from scipy.sparse.linalg import splu

import foldyn as fd
from foldyn.errors import InputError
from foldyn.gradients.path import Balance
from foldyn.statics import landscape
from foldyn.sweeps.measures import MEASURES

TIP = 8  # on the upper ring


def tower(
    height: float = 0.06, twist: float = 30.0, thickness: float = 2.4e-4, force: float = 1.0,
    stiffness: Any = 6e-3, drop: float = 0.0, preset: Any = "merlin2", spring: float = 0.0,
) -> fd.Case:  # fmt: skip
    """A Kresling tower, pressed from above by forces, or by a plate that moves down."""
    pattern = fd.patterns.kresling(6, 0.04, height=height, twist=twist)
    sheet = fd.Sheet(1.2e9, 0.2, thickness, 700.0)
    made = fd.discretize(pattern, sheet, preset=preset, crease_stiffness=stiffness)
    supports: list[Any] = [fd.Fix("zmin")]
    if spring:
        supports.append(fd.Spring(spring, "zmax", direction=(0, 0, 1)))
    if drop:
        return fd.Case(made, [*supports, fd.Impose("zmax", "z", -drop)])
    return fd.Case(made, supports, [fd.Force("zmax", (0, 0, -force))])


STIFFNESS = np.random.default_rng(8).uniform(5e-3, 7e-3, 12)
SNAP = {
    "kind": "statics", "method": "arc_length", "first_step": 1.0, "steps": 200,
    "settings": {"largest_turn": 3.0},
    "until": {"node": TIP, "axis": "z", "displacement": -0.036},
}  # fmt: skip
PRESSED = {"kind": "statics", "load_factors": [0.0, 0.5, 1.0]}
MOVED = {"kind": "statics", "method": "displacement", "steps": 4}


@pytest.mark.matrix
@pytest.mark.parametrize("preset", ["merlin2", "plate", "n5b8e"])
def test_equilibria_under_given_forces(preset):
    values = {"force": 2.0, "stiffness": STIFFNESS, "spring": 900.0}
    build = lambda **given: tower(preset=preset, **given)  # noqa: E731
    measures = ["displacement[8,z]", "strain_energy", "largest_displacement"]
    design = Design(build, values, measures, PRESSED)
    design.step = 3e-3
    assert max(design.errors().values()) < 1e-6


@pytest.mark.matrix
def test_equilibria_where_supports_move():
    values = {"drop": 0.01, "stiffness": STIFFNESS, "height": 0.06, "twist": 30.0}
    measures = ["displacement[8,x]", "strain_energy", "clearance"]
    errors = Design(tower, values, measures, MOVED).errors()
    assert max(errors.values()) < 1e-6, errors


def test_the_force_of_supports_is_the_slope_of_the_energy():
    """dE/d drop is the force on the plate (Castigliano)."""
    found = fd.sensitivity(
        tower, {"drop": 0.01, "spring": 900.0}, measures="strain_energy", analysis=MOVED
    )
    path = fd.trace(tower(drop=0.01, spring=900.0), "displacement", steps=4)
    chosen = path["support_axis"].values == "z"
    nodes = path["support_node"].values[chosen]
    upper = path["reaction"].values[-1][chosen][nodes >= 6].sum()
    assert found["gradient_drop"].values[0] == pytest.approx(-upper, rel=1e-8)


@pytest.mark.matrix
def test_snap_through():
    values = {"height": 0.06, "twist": 30.0, "thickness": 2.4e-4, "stiffness": STIFFNESS}
    measures = ["limit_load", "load_at[8,z,-0.01]", "barrier", "barrier_back"]
    design = Design(tower, values, measures, SNAP)
    design.step = 3e-4
    assert max(design.errors().values()) < 1e-7


@pytest.mark.matrix
@pytest.mark.filterwarnings("ignore:the path loses stability")
@pytest.mark.parametrize("seed", [21, 22])
def test_the_remainder_falls_with_the_second_order(seed):
    values = {"height": 0.06, "thickness": 2.4e-4, "stiffness": np.full(12, 6e-3)}
    design = Design(tower, values, ["limit_load", "load_at[8,z,-0.01]"], SNAP)
    lengths = (4e-2, 4e-3, 4e-4, 4e-5)
    assert (design.order(seed, lengths) > 1.9).all()


@pytest.mark.matrix
def test_a_limit_load_falls_as_the_force_grows():
    found = fd.sensitivity(tower, {"force": 1.0}, measures=["limit_load", "barrier"], analysis=SNAP)
    value, slope = found["value"].values, found["gradient_force"].values
    assert slope[0] == pytest.approx(-value[0], rel=1e-10)
    assert slope[1] == 0.0  # a barrier is between states without force


# ------------------------------------------------------------------ what has none
@pytest.mark.parametrize(
    ("analysis", "measure", "told"),
    [
        (SNAP, "displacement[8,z]", r"no given load factor.*newton"),
        (PRESSED, "limit_load", "limit_load.*nan"),
        (PRESSED, "barrier", "no two stable states|needs at least|barrier"),
        (PRESSED, "load_at[8,z,0.5]", "moves from.* and not to"),
        (PRESSED, "bifurcation_load", "has no derivative"),
        ({**PRESSED, "constant": [0]}, "displacement[8,z]", "constant loads.*leave that out"),
    ],
)
def test_refused(analysis, measure, told):
    with pytest.raises(InputError, match=told):
        fd.sensitivity(tower, {"force": 1.0}, measures=measure, analysis=analysis)


def test_displacements_at_a_limit_point_have_no_derivative():
    case = tower()
    given = {name: value for name, value in SNAP.items() if name != "kind"}
    path = fd.trace(case, **given)
    at = int(np.flatnonzero(path["point"].values == "limit")[0])
    q = case.body.dofs(path["displacement"].values[at])
    force = np.zeros(len(q))
    force[3 * TIP + 2] = 1.0
    with pytest.raises(InputError, match=r"limit point or a bifurcation.*limit_load"):
        Balance(case, q).under(force)
    before = case.body.dofs(path["displacement"].values[at - 1])
    assert np.isfinite(Balance(case, before).under(force)).all()


def test_numbers_of_one_equilibrium_share_the_factors(monkeypatch: pytest.MonkeyPatch) -> None:
    count: list[int] = []

    def factorized(block: Any) -> Any:
        count.append(1)
        return splu(block)

    monkeypatch.setattr("foldyn.gradients.path.splu", factorized)
    measures = [f"displacement[{TIP},{axis}]" for axis in "xyz"]
    fd.sensitivity(
        tower,
        {"height": 0.06},
        measures=measures,
        analysis={"kind": "statics", "load_factors": [0.01]},
    )
    assert len(count) == 1


@pytest.mark.matrix
def test_barriers_share_the_landscape(monkeypatch: pytest.MonkeyPatch) -> None:
    count: list[int] = []

    def counted(result: Any, case: fd.Case) -> Any:
        count.append(1)
        return landscape(result, case)

    for name in ("barrier", "barrier_back"):
        monkeypatch.setitem(MEASURES, name, replace(MEASURES[name], through=counted))
    found = fd.sensitivity(
        tower, {"stiffness": 6e-3}, measures=["barrier", "barrier_back"], analysis=SNAP
    )
    assert len(count) == 1
    assert found["gradient_stiffness"].values.all()


@pytest.mark.matrix
def test_the_energy_of_bends_near_the_kink_of_their_law():
    """Turned by a small load far less than differences of their rest angles would turn them."""
    pattern = fd.patterns.simple_fold(b=1.1, dihedral=105.0)
    sheet = fd.Sheet(1e6, 0.25, 0.03)
    made = fd.discretize(pattern, sheet, preset="herkal", crease_stiffness=0.05)
    case = fd.Case(made, [fd.Fix([0, 1, 2, 3])], [fd.Force([4, 5], (2e-4, 0.0, 3e-4))])
    given = {"method": "newton", "load_factors": [1.0]}
    found = fd.sensitivity(
        case, ["bend_rest"], measures="strain_energy", analysis={"kind": "statics", **given}
    )
    way = np.random.default_rng(6).uniform(-1.0, 1.0, len(made.bend_rest))

    def energy(by: float) -> float:
        other = replace(made, bend_rest=made.bend_rest + by * way)
        path = fd.trace(replace(case, structure=other), **given)
        return float(sum(path[name][-1] for name in case.energy_groups))

    h = 1e-7
    expected = (energy(h) - energy(-h)) / (2.0 * h)
    assert found["gradient_bend_rest"].values[0] @ way == pytest.approx(expected, rel=1e-3)
