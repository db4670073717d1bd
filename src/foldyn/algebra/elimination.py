"""Linear equations G u = g between dofs, solved for some of these dofs: the slaves.

Each equation determines one dof, the slave, from others. Let x be the vector u in which each slave
is replaced by the value g of its equation. Then u = E x, where each slave is a combination of free
dofs, held dofs and values g. The columns of E for free dofs span the motions that the equations and
the supports allow. The transpose of E turns forces on u into forces on x: driving forces on free
dofs, support reactions on held dofs, and the multipliers of the equations on slaves.

The equations are processed one after the other. Slaves of earlier equations are substituted first.
A free dof with a sufficient coefficient, preferably the first in the equation, becomes the slave
and is then eliminated from all earlier equations. An equation without remaining free dofs follows
from the others, or contradicts them.
"""

from __future__ import annotations

from collections import defaultdict
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy import sparse

NAMED = 0.5  # share of the largest coefficient above which the first dof becomes the slave
# an equation follows from the others if less than this share of its coefficients remains
DEPENDENT = 1e-9
ROUNDING = 1e-14  # coefficients below this share of an equation's coefficients are zero


class Elimination(NamedTuple):
    """Solution of k equations between m dofs; s equations are independent."""

    slaves: NDArray  # (s,) dofs
    kept: NDArray  # (s,) equation of each slave
    left: NDArray  # (k - s,) equations that determine no dof
    basis: sparse.csr_array  # E (m, m)


def eliminate(equations: sparse.csr_array, held: NDArray) -> Elimination:
    """Solve equations G (k, m) for slaves among the dofs that are not in the mask `held` (m,)."""
    size = equations.shape[1]
    known: dict[int, dict[int, float]] = {}  # slaves as combinations of entries of x
    users: defaultdict[int, set[int]] = defaultdict(set)  # slaves that depend on each free dof
    kept, left = [], []
    bounds = zip(equations.indptr[:-1].tolist(), equations.indptr[1:].tolist(), strict=True)
    for number, (first, last) in enumerate(bounds):
        named = equations.indices[first:last].tolist()
        values = equations.data[first:last].tolist()
        row = _inserted(dict(zip(named, values, strict=True)), known)
        largest = max(map(abs, values), default=0.0)
        pivot = _pivot(row, named, held, known, DEPENDENT * largest)
        if pivot < 0:
            left.append(number)
            continue
        kept.append(number)
        share = row.pop(pivot)
        solved = {j: -value / share for j, value in row.items() if abs(value) > ROUNDING * largest}
        solved[pivot] = 1.0 / share
        for slave in users.pop(pivot, ()):
            changed = _inserted(known[slave], {pivot: solved})
            known[slave] = {j: value for j, value in changed.items() if abs(value) > ROUNDING}
            for j in solved:
                users[j].add(slave)
        known[pivot] = solved
        for j in solved:
            users[j].add(pivot)
    slaves = np.array(list(known), np.int64)
    return Elimination(
        slaves, np.array(kept, np.int64), np.array(left, np.int64), _basis(known, size)
    )


def _inserted(row: dict[int, float], known: dict[int, dict[int, float]]) -> dict[int, float]:
    """Substitute the known slaves into a combination of dofs."""
    out: defaultdict[int, float] = defaultdict(float)
    for dof, value in row.items():
        for j, part in known.get(dof, {dof: 1.0}).items():
            out[j] += value * part
    return dict(out)


def _pivot(
    row: dict[int, float], named: list[int], held: NDArray, known: dict[int, Any], least: float
) -> int:
    """Free dof for which an equation is solved; -1 if none is left."""
    open_ = {j: abs(value) for j, value in row.items() if not held[j] and j not in known}
    largest = max(open_.values(), default=0.0)
    if largest <= least:
        return -1
    first = (j for j in named if open_.get(j, 0.0) >= NAMED * largest)
    return next(first, max(open_, key=lambda j: open_[j]))


def _basis(known: dict[int, dict[int, float]], size: int) -> sparse.csr_array:
    alone = np.setdiff1d(np.arange(size), np.array(list(known), np.int64))
    rows = [alone, *(np.full(len(known[slave]), slave) for slave in known)]
    columns = [alone, *(np.array(list(each), np.int64) for each in known.values())]
    values = [np.ones(len(alone)), *(np.array(list(each.values())) for each in known.values())]
    entries = np.concatenate(values), (np.concatenate(rows), np.concatenate(columns))
    basis = sparse.csr_array(entries, (size, size))
    basis.sort_indices()
    return basis
