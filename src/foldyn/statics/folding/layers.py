"""Layer order of a flat-folded sheet, by propagation and backtracking.

First, all orders implied by the known ones are set; the remaining pairs fall into independent
groups, each searched on its own (as in Flat-Folder by J. Ku and others).
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray
from scipy import sparse
from scipy.sparse import csgraph

from foldyn.errors import ComputationError
from foldyn.statics.folding.layer_constraints import LayerConstraints

MOST_TRIES = 100_000  # guesses in one group


class CrossingError(Exception):
    """No order satisfies one condition, on these rows of the pairs."""

    def __init__(self, rows: tuple[int, ...]) -> None:
        super().__init__(rows)
        self.rows = rows


def ordered(constraints: LayerConstraints) -> NDArray[np.int64]:
    """Orders (k,), 1 or -1, of the pairs, that satisfy all conditions.

    Raises
    ------
    CrossingError
        There are none; holds the rows of the first condition that cannot be satisfied.
    ComputationError
        None was found within a bounded number of guesses.
    """
    search = _Search(constraints)
    search.propagate(range(len(search.conditions)))
    for group in search.groups():
        search.solve(group)
    return np.array(search.orders, np.int64)


class _Search:
    """Orders so far, and the conditions on each."""

    def __init__(self, constraints: LayerConstraints) -> None:
        self.orders = [0] * len(constraints.pairs)
        # a condition: rows, and the product (an int) or the signs (a tuple) that must not be equal
        self.conditions: list[tuple[tuple[int, ...], int | tuple[int, ...]]] = [
            *constraints.products,
            *zip(
                map(tuple, constraints.triples.tolist()),
                map(tuple, constraints.turns.tolist()),
                strict=True,
            ),
        ]
        self.of_row: list[list[int]] = [[] for _ in self.orders]
        for k, (rows, _) in enumerate(self.conditions):
            for row in rows:
                self.of_row[row].append(k)

    def propagate(self, touched) -> list[int]:
        """Set all orders that the touched conditions imply; returns the rows set."""
        orders, conditions = self.orders, self.conditions
        found, queue = [], list(touched)
        while queue:
            rows, rule = conditions[queue.pop()]
            open_ = [k for k, row in enumerate(rows) if not orders[row]]
            if len(open_) > 1:
                continue
            if isinstance(rule, int):
                value = rule
                for row in rows:
                    value *= orders[row] or 1
                if not open_:
                    if value < 0:
                        self.forget(found)
                        raise CrossingError(rows)
                    continue
            else:
                known = {rule[k] * orders[row] for k, row in enumerate(rows) if orders[row]}
                if len(known) > 1:
                    continue
                if not open_:
                    self.forget(found)
                    raise CrossingError(rows)
                value = -known.pop() * rule[open_[0]]
            row = rows[open_[0]]
            orders[row] = value
            found.append(row)
            queue += self.of_row[row]
        return found

    def forget(self, rows: list[int]) -> None:
        for row in rows:
            self.orders[row] = 0

    def groups(self) -> list[list[int]]:
        """Rows without an order, in groups that share no condition."""
        one, other = [], []
        for rows, _ in self.conditions:
            left = [row for row in rows if not self.orders[row]]
            one += left[:-1]
            other += left[1:]
        count = len(self.orders)
        graph = sparse.coo_array((np.ones(len(one)), (one, other)), (count, count))
        _, label = csgraph.connected_components(graph, directed=False)
        groups: dict[int, list[int]] = {}
        for row in range(count):
            if not self.orders[row]:
                groups.setdefault(int(label[row]), []).append(row)
        return list(groups.values())

    def solve(self, group: list[int]) -> None:
        """Order a group by guesses, taken back if they fail."""
        guesses: list[tuple[int, int, list[int]]] = []  # place in the group, value, implied rows
        place, value, tries = 0, 1, 0
        while True:
            while place < len(group) and self.orders[group[place]]:
                place += 1
            if place == len(group):
                return
            row = group[place]
            self.orders[row] = value
            tries += 1
            if tries > MOST_TRIES:
                raise ComputationError(
                    f"no order of the layers was found in {MOST_TRIES} guesses: {len(group)} pairs "
                    "of panels depend on each other"
                )
            try:
                guesses.append((place, value, self.propagate(self.of_row[row])))
                value = 1
            except CrossingError:
                self.orders[row] = 0
                while value < 0:
                    if not guesses:
                        raise
                    place, value, followed = guesses.pop()
                    self.forget([group[place], *followed])
                value = -1
