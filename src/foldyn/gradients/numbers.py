"""The numbers that define a case for the solvers: between parameters and results.

Gradients of results are taken with respect to these numbers (`mechanics.pullback`), and these
numbers are differentiated by the parameters of a design (`gradients.parameters`).
"""

from __future__ import annotations

from collections.abc import Mapping
from contextlib import suppress

import numpy as np
from numpy.typing import NDArray
from scipy import sparse

from foldyn.cases import Case
from foldyn.dynamics.system import PackedCase
from foldyn.errors import InputError
from foldyn.mechanics.pullback import Arrays, Pullback, arrays_of_body

Gradient = Mapping[str, NDArray]
"""Derivatives of a quantity by arrays of numbers, by the name of the array."""


def numbers_of(case: Case) -> Arrays:
    """Numbers of a case: of the terms of its body, mass, loads, supports and damping."""
    arrays = arrays_of_body(case.body)
    numbers, layout = dict(arrays.numbers), dict(arrays.layout)
    for kind in ("load", "imposed", "rest"):
        for k, (vector, _) in enumerate(getattr(case, f"{kind}_terms")):
            numbers[f"{kind}.{k}"] = np.asarray(vector, float)
    layout["held"] = case.fixed
    if case.constraints:  # no solver differentiates ties: any change of them shows here
        basis = case.constraints.basis
        numbers["constraints"] = basis @ np.random.default_rng(0).uniform(1.0, 2.0, basis.shape[1])
    numbers["alpha"], numbers["beta"] = np.array([[case.rayleigh.alpha], [case.rayleigh.beta]])
    with suppress(InputError):  # statics needs no mass
        mass = sparse.csr_array(case.mass)
        mass.sort_indices()
        numbers["mass"] = mass.data
        layout |= {"mass.columns": mass.indices, "mass.rows": mass.indptr}
    return Arrays(numbers, layout)


def numbers_of_motion(packed: PackedCase, start: tuple[NDArray, NDArray]) -> Arrays:
    """Numbers of a case as packed for motions, and its initial state."""
    arrays, system, mass = arrays_of_body(packed.body), packed.system, packed.mass
    numbers = {
        **arrays.numbers,
        "loads": system.loads.value,
        "moved": system.moved.value,
        "mass": mass.data,
        "alpha": np.array([system.alpha]),
        "start.displacement": start[0],
        "start.velocity": start[1],
    }
    ties = system.ties
    if len(ties.slave):  # no solver differentiates ties
        numbers["constraints"] = ties.masters.value
    waves = system.waves._asdict()
    waves = {f"histories.{key}": np.asarray(waves[key]) for key in waves if key != "address"}
    layout = {
        **arrays.layout,
        **waves,
        "loads.dofs": system.loads.dof,
        "loads.histories": system.loads.row,
        "moved.dofs": system.moved.dof,
        "mass.columns": mass.indices,
        "mass.rows": mass.indptr,
        "order": system.order,
        "constraints.slaves": ties.slave,
        "constraints.masters": ties.masters.dof,
    }
    return Arrays(numbers, layout)


def nothing(case: Case, pullback: Pullback) -> dict[str, NDArray]:
    """Zero gradient by the numbers of a case, given the pullback of its body's forces."""
    total = {name: np.zeros_like(out) for name, out in pullback.gradient.items()}
    for kind in ("load", "imposed"):
        for k, (vector, _) in enumerate(getattr(case, f"{kind}_terms")):
            total[f"{kind}.{k}"] = np.zeros_like(vector)
    with suppress(InputError):
        total["mass"] = np.zeros(case.mass.nnz)
    return total | {"alpha": np.zeros(1), "beta": np.zeros(1)}
