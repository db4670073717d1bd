"""Pullbacks of terms: what weighted forces change with, against tangents and differences."""

from __future__ import annotations

from collections.abc import Callable
from functools import cache
from itertools import product
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray
from pulled_terms import Lone, lone
from samples import CUBIC, structure
from scipy import sparse

import foldyn as fd
from foldyn.checks import gradient_error, observed_order
from foldyn.dynamics.dampers import dampers
from foldyn.dynamics.driver import prepare
from foldyn.errors import InputError
from foldyn.mechanics.assembly import Assembly
from foldyn.mechanics.constant_damping import DampingMatrix, DampingRows
from foldyn.mechanics.membranes_term import MembranesTerm
from foldyn.mechanics.pullback import Pullback, arrays_of_body
from foldyn.mechanics.springs import SpringsTerm
from foldyn.mechanics.viscous import ViscousTerm
from foldyn.mechanics.viscous_panels import ViscousPanelsTerm
from foldyn.shells.term import ShellTerm
from foldyn.structures.bars_plates import BarsPlatesTerm, ClampsTerm

THICK = fd.Sheet(1e6, 0.25, 0.1, density=1000.0, length_scale_ratio=2.0)
CORNERS = np.array([[0, 0, 0], [1, 0, 0], [1, 1, 0.3], [0, 1, 0.3], [0.5, -0.8, 0.4]])
MIXED = fd.Pattern(CORNERS, [[0, 1, 2, 3], [1, 0, 4]])
MIURA = fd.patterns.miura(cells=(1, 1), panel_angle=60, dihedral=110)
LOCKING = fd.EnhancedLinear(150, 200)


def plates(pattern: fd.Pattern, by_folds: bool = False, **options: Any) -> Assembly:
    """Panels with edge angles; with the dofs of explicit methods, some of these turns of folds."""
    made = fd.discretize(pattern, THICK, preset="n5b8e", **options)
    return (made.for_explicit if by_folds else made).body


def shell(by_folds: bool = False, **options: Any) -> Assembly:
    made = fd.shell(MIXED, THICK, divisions=1, **options)
    return (made.for_explicit if by_folds else made).body


def supported(*supports: fd.Spring, **options: Any) -> Assembly:
    """A fold of bars and hinges, with springs."""
    made = fd.discretize(
        fd.patterns.simple_fold(1.0, 1.3, dihedral=60), THICK, preset="herkal", **options
    )
    return fd.Case(made, supports).body


def damped(
    model: Any, damping: Any, *dashpots: fd.Dashpot, by_folds: bool = False, **options: Any
) -> Assembly:
    """A fold with damping in the place of its other terms."""
    fold = fd.patterns.simple_fold(1.0, 1.3, dihedral=60)
    if model == "shell":
        made = fd.shell(fold, THICK, divisions=2)
    else:
        made = fd.discretize(fold, THICK, preset=model, **options)
    case = fd.Case(made.for_explicit if by_folds else made, dashpots, damping=damping)
    return Assembly(case.elastic_body.sheet, *dampers(case))


def constant(kind: type[DampingRows] | type[DampingMatrix]) -> Lone:
    """A matrix, or full rows."""
    values = np.random.default_rng(5).standard_normal((6, 6))
    values[0, 1:4] = 0.0
    matrix = values[:2] if kind is DampingRows else sparse.csr_array(values)
    return Lone(kind(matrix), 6, 2)


SPRINGS = [
    fd.Spring(40.0, between=[(0, 2), (1, 3)]),
    fd.Spring(25.0, between=[(3, 0)], rest_length=0.4),
    fd.Spring(300.0, nodes=[0, 2]),
    fd.Spring(55.0, between=[(0, 3)], direction=(1, 2, -1)),
]
AXIAL = fd.Dashpot(0.7, between=[(0, 2), (1, 3)])
TERMS: dict[str, Callable[[], Lone]] = {
    "membranes": lambda: lone(structure("miura, coupled").body, MembranesTerm),
    "membranes of hexagons": lambda: lone(structure("hexagon, coupled").body, MembranesTerm, 2),
    "gives": lambda: lone(plates(MIXED), MembranesTerm),
    "springs": lambda: lone(supported(*SPRINGS), SpringsTerm),
    "springs without length": lambda: lone(
        supported(fd.Spring(35.0, between=[(1, 2)], rest_length=0.0)), SpringsTerm
    ),
    "cables": lambda: lone(
        supported(
            fd.Cable([0, 2, 1, (0.2, 0.3, 1.0)], 400.0, pretension=90.0),
            fd.Cable([1, 3], 400.0, rest_length=0.7),
            fd.Bar([(0, 3)], 70.0, rest_length=2.0),
        ),
        SpringsTerm,
    ),
    "bars with laws": lambda: lone(
        supported(
            fd.Bar([(0, 3), (1, 2)], 70.0, rest_length=2.0, law="ogden"),
            fd.Bar((1, 3), 70.0, rest_length=1.1, law="linear"),
        ),
        SpringsTerm,
    ),
    "clamps": lambda: lone(supported(clamped=[(0, 1)]), ClampsTerm),
    "dashpots": lambda: lone(damped("herkal", fd.CreaseDamping(0.3), AXIAL), ViscousTerm),
    "damped sides": lambda: lone(damped("shell", fd.CreaseDamping(0.3)), ViscousTerm),
    "damped strains": lambda: lone(
        damped("herkal", fd.StrainDamping(0.1), clamped=[(0, 1)]), ViscousTerm
    ),
    "damped panels": lambda: lone(
        damped("herkal", fd.StrainDamping(0.1), membrane="panel"), ViscousPanelsTerm
    ),
    "damping matrix": lambda: constant(DampingMatrix),
    "damping rows": lambda: constant(DampingRows),
    "shell": lambda: lone(shell(), ShellTerm),
    "shell that locks": lambda: lone(shell(fold_law=LOCKING), ShellTerm),
    "clamped shell": lambda: lone(shell(clamped=[(2, 3)], fold_law="linear"), ShellTerm),
    "plates": lambda: lone(plates(MIXED, clamped=[(2, 3)]), BarsPlatesTerm),
    "plates that lock": lambda: lone(
        plates(MIURA, fold_law=LOCKING, membrane="bars"), BarsPlatesTerm
    ),
    "plates of a user's law": lambda: lone(plates(MIXED, fold_law=CUBIC), BarsPlatesTerm),
    "plates by folds": lambda: lone(plates(MIXED, True, clamped=[(2, 3)]), BarsPlatesTerm),
    "one side by folds": lambda: lone(plates(MIXED, True, rigid=[0]), BarsPlatesTerm),
    "locked by folds": lambda: lone(
        plates(MIURA, True, fold_law=LOCKING, membrane="bars"), BarsPlatesTerm
    ),
    "shell by folds": lambda: lone(shell(True), ShellTerm),
    "damped folds": lambda: lone(
        damped("n5b8e", fd.CreaseDamping(0.3), by_folds=True), ViscousTerm
    ),
}
OF_MEMBRANES = "vector per_length2 *stiffness"
OF_BARS = " bars.bar_vector bars.bar_per_length2 *bars.bar_stiffness"
OF_PLATES = "bars.rest per_reach *fold_stiffness *bend_rest *stiffness"
BY_FOLDS = f"{OF_PLATES} *unmoved"
ARRAYS = {  # that count, with a star where forces are linear, with a minus where there is no
    # difference: of a spring without length at rest, or of dofs that are not there
    "membranes": OF_MEMBRANES,
    "membranes of hexagons": OF_MEMBRANES,
    "gives": OF_MEMBRANES,
    "springs": "direction *stiffness lines.vector lines.length *lines.stretch *lines.stiffness",
    "springs without length": "*lines.vector *lines.stiffness -lines.length -lines.stretch",
    "cables": "lines.vector lines.length *lines.stretch *lines.stiffness",
    "bars with laws": "lines.vector lines.length lines.stretch lines.natural *lines.stiffness",
    "clamps": "bars.rest wings *bend_rest *stiffness",
    "dashpots": "axial corners *coefficient -hidden_turn",
    "damped sides": "corners hidden_turn *coefficient",
    "damped strains": "axial corners *coefficient -hidden_turn",
    "damped panels": OF_MEMBRANES,
    "damping matrix": "*data",
    "damping rows": "rows",
    "shell": f"{OF_PLATES} *fold_rest *fold_parameters",
    "shell that locks": f"{OF_PLATES} *fold_rest fold_parameters",
    "clamped shell": f"{OF_PLATES} *fold_rest wings",
    "plates": f"{OF_PLATES} *fold_rest *fold_parameters wings",
    "plates that lock": f"{OF_PLATES} *fold_rest fold_parameters {OF_BARS}",
    "plates of a user's law": f"{OF_PLATES} fold_rest",
    "plates by folds": f"{BY_FOLDS} *fold_rest *fold_parameters wings",
    "one side by folds": f"{BY_FOLDS} *fold_rest *fold_parameters".replace(" *bend_rest", ""),
    "locked by folds": f"{OF_PLATES} unmoved *fold_rest fold_parameters {OF_BARS}",
    "shell by folds": f"{BY_FOLDS} *fold_rest *fold_parameters",
    "damped folds": "*coefficient hidden_turn",
}
EACH = [(t, n) for t, names in ARRAYS.items() for n in names.split() if n[0] != "-"]
SEEDS = (1, 2)
made = cache(lambda name: TERMS[name]())


def drawn(own: Lone, seed: int, size: float = 0.05) -> tuple[NDArray, NDArray, NDArray]:
    """Dofs, velocities and weights (m,)."""
    q, v, w = np.random.default_rng(seed).standard_normal((3, own.size))
    return size * q, v, w


@pytest.mark.parametrize("name", TERMS)
def test_every_array_is_there(name) -> None:
    own = made(name)
    numbers, (*_, gradient) = own.term.arrays().numbers, own.pulled(*drawn(own, 1))
    for key, array in numbers.items():
        assert gradient[key].shape == array.shape
    counts = {key for key in numbers if np.any(gradient[key])}
    assert counts == {key.strip("*-") for key in ARRAYS[name].split()}


@pytest.mark.parametrize(("name", "seed"), [*product(TERMS, SEEDS)])
def test_the_derivatives_by_the_state(name, seed) -> None:
    own = made(name)
    q, v, w = drawn(own, seed)
    by_q, by_v, _ = own.pulled(q, v, w)
    if not own.term.damps and not name.endswith("by folds"):
        exact = own.term.tangent(q).T @ w
        assert np.abs(by_q - exact).max() < 1e-12 * np.abs(exact).max()
        assert not by_v.any()
        return
    if own.term.damps:
        exact = np.array([w @ own.force(q, unit) for unit in np.eye(own.size)])
        assert np.abs(by_v - exact).max() < 1e-12 * np.abs(exact).max()
    if isinstance(own.term, DampingMatrix | DampingRows) or name == "damped folds":
        assert not by_q.any()
        return
    error = gradient_error(lambda q: float(w @ own.force(q, v)), lambda _: by_q, at=q, seed=seed)
    assert error < 1e-8


@pytest.mark.parametrize("preset", ["plate", "n5b8e"])
def test_a_body_adds_up_its_terms(preset) -> None:
    made = fd.discretize(MIXED, THICK, preset=preset, clamped=[(2, 3)])
    body = fd.Case(made, [fd.Spring(40.0, between=[(0, 2)])]).body
    q, w = np.random.default_rng(6).standard_normal((2, body.size))
    exact, own = body.tangent(0.05 * q) @ w, Pullback(body)
    assert np.abs(own.at(0.05 * q, w) - exact).max() < 1e-12 * np.abs(exact).max()
    once = {key: out.copy() for key, out in own.gradient.items()}
    assert once.keys() >= arrays_of_body(body).numbers.keys()
    own.at(0.05 * q, w)
    assert all(np.allclose(out, 2.0 * once[key]) for key, out in own.gradient.items())
    own.clear()
    assert not any(out.any() for out in own.gradient.values())


@pytest.mark.parametrize("preset", ["plate", "n5b8e"])
def test_what_is_refused_has_a_name(preset) -> None:
    law = fd.Plastic(5e-3, 0.02, law="linear")
    touching = fd.Case(fd.discretize(MIXED, THICK, preset=preset), contact=fd.Contact(0.01)).body
    yielding = fd.Case(fd.discretize(MIXED, THICK, preset=preset, fold_law=law))
    for body, name in (
        (touching, "contact"),
        (prepare(yielding, 1.0, "rk4").packed.body, "creases that yield"),
    ):
        for made in (Pullback, arrays_of_body):
            with pytest.raises(InputError, match=f"no gradients through {name}"):
                made(body)


@pytest.mark.parametrize(("each", "seed"), [*product(EACH, SEEDS)])
def test_the_gradients_are_those_of_differences(each, seed) -> None:
    """To first order, with a remainder of second order; one a thousandth off is not."""
    name, key = each[0], each[1].strip("*")
    own = made(name)
    q, v, w = drawn(own, seed)
    array = np.array(own.term.arrays().numbers[key], float)
    gradient = own.pulled(q, v, w)[2][key]

    def weighted(values: NDArray) -> float:
        return float(w @ own.changed(key, values).force(q, v))

    size = float(np.abs(array).max())
    assert gradient_error(weighted, lambda _: gradient, at=array, seed=seed, size=size) < 1e-7
    assert (
        gradient_error(weighted, lambda _: 1.001 * gradient, at=array, seed=seed, size=size) > 1e-4
    )

    along = size * np.random.default_rng(seed).standard_normal(array.shape)
    steps, at = 3e-3 / np.array([1, 10, 100, 1000]), weighted(array)

    def remainders(gradient: NDArray) -> NDArray:
        slope = float((gradient * along).sum())
        return np.array([abs(weighted(array + h * along) - at - h * slope) for h in steps])

    noise = 1e-14 * max(abs(at), np.abs(w * own.force(q, v)).max())
    found = remainders(gradient)
    above = found > noise
    if each[1].startswith("*"):
        assert not above.any()
        assert remainders(1.001 * gradient)[0] > noise
    else:
        assert above.sum() > 1
        assert observed_order(steps[above], found[above]) > 1.9
        assert observed_order(steps, remainders(1.1 * gradient)) < 1.9
