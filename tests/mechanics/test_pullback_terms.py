"""Pullbacks of terms: what weighted forces change with, against tangents and differences."""

from __future__ import annotations

from collections.abc import Callable
from functools import cache, partial
from itertools import product

import numpy as np
import pytest
from numpy.typing import NDArray
from pulled_terms import Lone, lone
from samples import SHEET, structure

import foldyn as fd
from foldyn.checks import gradient_error, observed_order
from foldyn.mechanics.edge_gives_term import BalancedGivesTerm, EdgeGivesTerm
from foldyn.mechanics.membranes import MembranesTerm


def plates(pattern: fd.Pattern) -> fd.Structure:
    return fd.discretize(pattern, SHEET, preset="n5b8e")


CORNERS = np.array([[0, 0, 0], [1, 0, 0], [1, 1, 0.3], [0, 1, 0.3], [0.5, -0.8, 0.4]])
MIURA = partial(plates, fd.patterns.miura(cells=(1, 2), panel_angle=60, dihedral=110))
MIXED = partial(plates, fd.Pattern(CORNERS, [[0, 1, 2, 3], [1, 0, 4]]))
TERMS: dict[str, Callable[[], Lone]] = {
    "membranes": lambda: lone(structure("miura, coupled").body, MembranesTerm),
    "membranes of hexagons": lambda: lone(structure("hexagon, coupled").body, MembranesTerm, 2),
    "gives": lambda: lone(MIXED().body, EdgeGivesTerm),
    "gives in balance": lambda: lone(MIXED().condensed.body, BalancedGivesTerm),
}
OF_MEMBRANES = "vector per_length2 *stiffness"
ARRAYS = {  # with a star where forces are linear
    "membranes": OF_MEMBRANES,
    "membranes of hexagons": OF_MEMBRANES,
    "gives": "*vector *per_length2 *across *stiffness",
    "gives in balance": "vector per_length2 across stiffness",
}
SYMMETRIC = {("gives in balance", "stiffness")}  # matrices that are factorized
EACH = [(term, name) for term, names in ARRAYS.items() for name in names.split()]
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
    assert set(ARRAYS[name].replace("*", "").split()) == set(numbers) == set(gradient)
    for key, array in numbers.items():
        assert gradient[key].shape == array.shape


@pytest.mark.parametrize(("name", "seed"), [*product(TERMS, SEEDS)])
def test_the_derivatives_by_the_state(name, seed) -> None:
    own = made(name)
    q, v, w = drawn(own, seed)
    by_q, by_v, _ = own.pulled(q, v, w)
    if not own.term.damps:
        exact = own.term.tangent(q).T @ w
        assert np.abs(by_q - exact).max() < 1e-12 * np.abs(exact).max()
        assert not by_v.any()
        return
    exact = own.term.damping(q).T @ w
    assert np.abs(by_v - exact).max() < 1e-12 * np.abs(exact).max()
    error = gradient_error(lambda q: w @ own.force(q, v), lambda _: by_q, q, seed)
    assert error < 1e-8


@pytest.mark.parametrize(("each", "seed"), [*product(EACH, SEEDS)])
def test_the_gradients_are_those_of_differences(each, seed) -> None:
    """To first order, with a remainder of second order; one a thousandth off is not."""
    name, key = each[0], each[1].strip("*")
    own = made(name)
    q, v, w = drawn(own, seed)
    array = np.array(own.term.arrays().numbers[key], float)
    gradient = own.pulled(q, v, w)[2][key]

    def allowed(values: NDArray) -> NDArray:
        if (name, key) in SYMMETRIC:
            return 0.5 * (values + np.swapaxes(values, -1, -2))
        return values

    gradient = allowed(gradient)

    def weighted(values: NDArray) -> float:
        return float(w @ own.changed(key, allowed(values)).force(q, v))

    size = float(np.abs(array).max())
    assert gradient_error(weighted, lambda _: gradient, array, seed, size) < 1e-7
    assert gradient_error(weighted, lambda _: 1.001 * gradient, array, seed, size) > 1e-4

    along = size * np.random.default_rng(seed).standard_normal(array.shape)
    steps, at = 1e-2 / np.array([1, 10, 100, 1000]), weighted(array)

    def remainders(gradient: NDArray) -> NDArray:
        slope = float((gradient * along).sum())
        return np.array([abs(weighted(array + h * along) - at - h * slope) for h in steps])

    noise = 1e-12 * max(abs(at), np.abs(w * own.force(q, v)).max())
    found = remainders(gradient)
    above = found > noise
    if each[1].startswith("*"):
        assert not above.any()
    else:
        assert above.sum() > 1
        assert observed_order(steps[above], found[above]) > 1.9
    assert remainders(1.001 * gradient)[-1] > 10.0 * noise
