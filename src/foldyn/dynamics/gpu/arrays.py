"""Cases of one topology as arrays for the GPU: the arrays of the CPU, stacked over the models."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy import sparse

from foldyn.cases.springs import Made
from foldyn.dynamics.gpu.checks import MOST_KINDS
from foldyn.dynamics.gpu.elements import Counts, Damping, Elements
from foldyn.dynamics.gpu.kernels import Nodes
from foldyn.dynamics.gpu.plates import Plates
from foldyn.dynamics.inertia import Inertia
from foldyn.dynamics.system import PackedCase
from foldyn.mechanics.constant_damping import DampingMatrix
from foldyn.mechanics.membranes import Membranes
from foldyn.mechanics.membranes_term import MembranesTerm
from foldyn.mechanics.model import OF_BARS, BarsHinges
from foldyn.mechanics.plates import BarsPlates
from foldyn.mechanics.springs import Springs, SpringsTerm
from foldyn.mechanics.viscous import Viscous, ViscousTerm, viscous

TOPOLOGY = ("bars", "bar_runs", "hinges", "hinge_runs", "hinge_group", "addresses")
OF_PLATES = "hinges", "fold_rotations", "fold_ways", "code", "start", "angle", "entry"
OF_PANELS = (
    "wings", "unmoved", "fold_stiffness", "fold_rest", "fold_parameters", "bend_rest", "stiffness",
)  # fmt: skip
NO_SPRINGS = Made().springs()
NONE = np.zeros(0, np.int64)
NO_DAMPERS = viscous(
    *(NONE.reshape(shape) for shape in ((0, 2), (0, 3), 0, (0, 4), (0, 4, 3), (0, 2), (0, 2), 0))
)


class CaseArrays:
    """Cases of one topology as arrays on the host.

    Parameters
    ----------
    cases : sequence of PackedCase

    Attributes
    ----------
    elements : Elements
    nodes : Nodes
        Everything except the rows of the loads, which `load_rows` (m, l) holds by history.
    counts : Counts
    histories : list
        Pair (case, row) for each row of the factors.
    """

    def __init__(self, cases: Sequence[PackedCase]) -> None:
        first, bodies = cases[0], [packed.body for packed in cases]
        plates = [packed.model for packed in cases if isinstance(packed.model, BarsPlates)]
        models = [_with_force(each) for each in _bars(cases)]
        model = models[0]
        self._entries: list[tuple[NDArray, NDArray, NDArray]] = []  # nodes, slots, signs
        self._slots = 0
        self._add(model.bars[:, 1])
        self._again(model.bars[:, 0], 0)
        for v in range(4):
            self._add(model.hinges[:, v])
        panels = self._terms(bodies, MembranesTerm)
        membranes = [self._membranes([term.membranes for term in own]) for own in panels]
        drawn = self._terms(bodies, SpringsTerm) or [[]]
        springs = self._springs([term.springs for term in drawn[0]])
        damped = self._terms(bodies, ViscousTerm)
        dampers = self._dampers([[term.elements for term in own] for own in damped])
        damping = self._damping(cases)
        hidden = 3 * len(first.mass.hidden)
        coupled = self._plates(plates, hidden) if plates else ()
        self.elements = Elements(
            _stacked(models, TOPOLOGY)._replace(
                bars=model.bars.astype(np.int32), hinges=model.hinges.astype(np.int32)
            ),
            _codes(model.bar_runs), _codes(model.hinge_runs),
            (*membranes, *[_no_panels()] * (MOST_KINDS - len(membranes))),
            springs, dampers, damping, coupled,
        )  # fmt: skip
        rows, groups = first.system.rows, list(first.body.energy_groups)
        self.counts = Counts(
            rows, self._slots, len(groups),
            groups.index("strain_springs") if "strain_springs" in groups else 0,
            rows if len(damping.column) else 0,
            hidden, len(plates[0].hinges) + 2 * hidden if plates else 0,
        )  # fmt: skip
        self.nodes = self._nodes(cases)

    @staticmethod
    def _terms(bodies: Sequence[Any], kind: type) -> list[list[Any]]:
        """Terms of a kind: for each term, a list over all models."""
        rows = [[term for term in body.others if isinstance(term, kind)] for body in bodies]
        return [list(own) for own in zip(*rows, strict=True)]

    def _add(self, nodes: NDArray) -> None:
        """Reserve slots for vectors that act on these nodes."""
        self._again(nodes, 1, self._slots)
        self._slots += len(nodes)

    def _again(self, nodes: NDArray, plus: int, first: int = 0) -> None:
        """Assign slots from `first` on to nodes, even if already in use; skip negative nodes."""
        slots = first + np.arange(len(nodes))
        own = np.asarray(nodes).astype(np.int64)
        some = own >= 0
        self._entries.append((own[some], (slots if plus else -1 - slots)[some], slots[some]))

    def _membranes(self, own: Sequence[Membranes]) -> Membranes:
        for v in range(own[0].nodes.shape[1]):
            self._add(own[0].nodes[:, v])
        for k in range(own[0].gives.shape[1]):
            self._add(own[0].gives[:, k] // 3)
        return _stacked(own, ("nodes", "ends", "gives"))

    def _springs(self, own: Sequence[Springs]) -> Springs:
        own = own or [NO_SPRINGS]
        lines = own[0].lines
        pieces = np.delete(np.arange(len(lines.node)), lines.first[1:] - 1)
        after = lines.node[np.minimum(pieces + 1, len(lines.node) - 1)]
        for plus, minus in ((own[0].ends[:, 0], own[0].ends[:, 1]), (after, lines.node[pieces])):
            first = self._slots
            self._add(plus)
            self._again(minus, 0, first)
        same = "first", "node", "slack", "scaled", "code", "addresses", "row"
        stacked = _stacked([each.lines for each in own], same)
        plain = [each._replace(lines=()) for each in own]
        return _stacked(plain, ("ends", "row", "lines"))._replace(lines=stacked)

    def _dampers(self, rows: Sequence[Sequence[Viscous]]) -> Viscous:
        own = list(rows[0]) if rows else [NO_DAMPERS]
        axial = len(own[0].axial)
        for v in range(4):
            nodes = own[0].dofs[:, 3 * v] // 3
            nodes[:axial] = nodes[:axial] if v < 2 else -1
            self._add(nodes)
        return _stacked(own, ("dofs",))

    def _damping(self, cases: Sequence[PackedCase]) -> Damping:
        size = 3 * cases[0].system.rows
        own: list[Any] = [
            sum(
                (term.matrix for term in packed.body.others if isinstance(term, DampingMatrix)),
                sparse.csr_array((size, size)),
            )
            for packed in cases
        ]
        if own[0].nnz:
            self._add(np.arange(cases[0].system.rows))
        start, column = own[0].indptr.astype(np.int64), own[0].indices.astype(np.int64)
        return Damping(start, column, _one_or_all([matrix.data for matrix in own]))

    def _plates(self, own: Sequence[BarsPlates], hidden: int) -> Plates:
        model, hinges = own[0], len(own[0].hinges)
        for v in range(4):
            self._add(model.hinges[:, v])
        item = np.where(model.angle < 0, hinges - 1 - model.angle, model.angle)
        order = np.argsort(item, kind="stable")
        plate = np.repeat(np.arange(len(model.start) - 1), np.diff(model.start))
        numbers = {name: _one_or_all([getattr(each, name) for each in own]) for name in OF_PANELS}
        bare: Any = ()
        return Plates(
            model._replace(bars=bare, **numbers), np.array([each.per_reach for each in own]),
            np.searchsorted(item[order], np.arange(hinges + hidden + 1)), order, plate[order],
            np.setdiff1d(np.arange(hidden), model.fold_rotations),
        )  # fmt: skip

    def _nodes(self, cases: Sequence[PackedCase]) -> Nodes:
        node, entry, slot = (np.concatenate(column) for column in zip(*self._entries, strict=True))
        order = np.lexsort((slot, node))
        system, rows = cases[0].system, self.counts.nodes
        start = np.searchsorted(node[order], np.arange(rows + 1))
        support = np.full(3 * rows, -1, np.int64)
        support[system.supported] = np.arange(len(system.supported))
        most = max(len(packed.system.loads.dof) for packed in cases)
        load, load_row = np.zeros((len(cases), most)), np.zeros((len(cases), most), np.int64)
        starts = np.zeros((len(cases), 3 * rows + 1), np.int64)
        for k, packed in enumerate(cases):
            own = packed.system.loads
            load[k, : len(own.dof)] = own.value
            load_row[k, : len(own.dof)] = own.row
            starts[k] = np.searchsorted(own.dof, np.arange(3 * rows + 1))
        return Nodes(
            start.astype(np.int32), entry[order].astype(np.int32), system.order, support,
            _one_or_all([_masses(packed.mass) for packed in cases]),
            _one_or_all([packed.mass.inverse for packed in cases]),
            np.array([packed.system.alpha for packed in cases]),
            starts, load, load_row,
        )  # fmt: skip


def topology(packed: PackedCase) -> tuple[Any, ...]:
    """Properties that all cases of one launch share."""
    arrays = [getattr(_bars([packed])[0], name) for name in TOPOLOGY]
    if isinstance(packed.model, BarsPlates):
        arrays += [np.asarray(getattr(packed.model, name)) for name in OF_PLATES]
    arrays += [packed.system.order, packed.system.supported]
    kinds = []
    for term in packed.body.others:
        kinds.append(type(term).__name__)
        if isinstance(term, MembranesTerm):
            arrays += term.membranes[:3]
        elif isinstance(term, SpringsTerm):
            own = term.springs.lines
            arrays += [term.springs.ends, own.first, own.node, own.slack, own.scaled, own.code]
        elif isinstance(term, DampingMatrix):
            arrays += [term.matrix.indptr, term.matrix.indices]
        elif isinstance(term, ViscousTerm):
            arrays += [term.elements.dofs, np.array(len(term.elements.axial))]
    return (*kinds, *(array.tobytes() for array in arrays))


def _bars(cases: Sequence[PackedCase]) -> list[BarsHinges]:
    """The bars and hinges of cases; of plates, their bars."""
    models = [packed.model for packed in cases]
    return [each.bars if isinstance(each, BarsPlates) else each for each in models]


def _masses(mass: Inertia) -> NDArray:
    """Mass (rows, 3) of nodes, and inertia of the dofs after them, kg."""
    out = np.repeat(mass.diagonal[:, None], 3, axis=1)
    out[len(out) - len(mass.hidden) :] = mass.hidden
    return out


def _one_or_all(arrays: Sequence[NDArray]) -> NDArray:
    """Stack the arrays of all models, or return a single array if all are equal."""
    first = arrays[0]
    alike = all(array is first or np.array_equal(array, first) for array in arrays[1:])
    return np.ascontiguousarray(arrays[0][None] if alike else np.stack(arrays))


def _stacked(own: Sequence[Any], same: Sequence[str]) -> Any:
    """A named tuple whose arrays are stacked over the models, except for the names in `same`."""
    names = [name for name in own[0]._fields if name not in same]
    numbers = {name: _one_or_all([getattr(each, name) for each in own]) for name in names}
    kept = {name: np.ascontiguousarray(getattr(own[0], name)) for name in same}
    return own[0]._replace(**numbers, **kept)


def _with_force(model: BarsHinges) -> BarsHinges:
    """The model with only those bars that have a law; membranes replace the others."""
    count = int(model.bar_runs[:, 1].max(initial=0))
    return model._replace(**{name: getattr(model, name)[:count] for name in OF_BARS})


def _codes(runs: NDArray) -> NDArray:
    """Law code of each element."""
    return np.repeat(runs[:, 2], runs[:, 1] - runs[:, 0])


def _no_panels() -> Membranes:
    nodes, ends, gives = (np.zeros((0, k), np.int64) for k in (1, 2, 0))
    shapes = (1, 0, 3, 0), (1, 0, 0), (1, 0, 0, 0)
    return Membranes(nodes, ends, gives, *map(np.zeros, shapes))  # type: ignore[call-arg]
