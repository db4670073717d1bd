"""Springs as a term: along fixed directions, to the ground or between nodes, and elastic lines.

A directed spring pulls with k (u_a - u_b) . d along a fixed direction d; without b it is attached
to the ground. Springs along the current line between their ends, struts and cables are lines
(`mechanics.lines`). The stiffness of a spring may follow a history.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from functools import cached_property, partial
from itertools import compress
from typing import Any, ClassVar, NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy import sparse

from foldyn.jit.compiled import inner_scalar
from foldyn.jit.context import Context, numbers_at, rows_at
from foldyn.mechanics.block_matrix import blocks_of_ends, pairs_of_ends, places_of
from foldyn.mechanics.lines import (
    GROUND,
    JUST_TAUT,
    Lines,
    differentiate_lines,
    drive_lines,
    line_blocks,
    line_rates,
    lines_energy,
    pull_lines,
    pull_on_average,
    put_tensions,
    until_turn,
)
from foldyn.mechanics.model import ranks
from foldyn.mechanics.pullback import Arrays, Pulled, arrays_of, pullback, zeros_for
from foldyn.mechanics.term import (
    ENERGIES,
    FORCES,
    LIMIT,
    MEAN_FORCES,
    PLACE_OBSTACLES,
    CompiledTerm,
    Term,
    Unstrained,
    energies,
    forces,
    limit,
    mean_forces,
    nodal,
    place_obstacles,
)

GROUP = "strain_springs"
STEADY = ("change", "now", "addresses")  # arrays of lines without influence on steady ones


class Springs(NamedTuple):
    """Arrays of d directed springs, and lines."""

    ends: NDArray  # (d, 2) a and b; `GROUND` in place of b
    direction: NDArray  # (d, 3) unit vectors
    stiffness: NDArray  # (d,) N/m
    row: NDArray  # (d,) row of the history of k, -1 for none
    now: NDArray  # (d, 2) current factor of k, and its rate, 1/s
    lines: Lines


@inner_scalar
def directed_extension(springs, u, s):
    """(u_a - u_b) . d of a directed spring, m."""
    a, b = springs.ends[s, 0], springs.ends[s, 1]
    extension = 0.0
    for c in range(3):
        moved = u[a, c] - (u[b, c] if b >= 0 else 0.0)
        extension += moved * springs.direction[s, c]
    return extension


@inner_scalar
def _add_directed(springs, s, pull, force):
    """Add the force `pull` (N) of a directed spring to its ends."""
    a, b = springs.ends[s, 0], springs.ends[s, 1]
    for c in range(3):
        force[a, c] += pull * springs.direction[s, c]
        if b >= 0:
            force[b, c] -= pull * springs.direction[s, c]


class _Backward(NamedTuple):
    springs: Springs
    out: Springs  # gradients
    rows: int  # number of rows up to the last node


@pullback
def _pullback(own, u, v, t, weight, product, rate):
    springs, out, added = own.springs, own.out, rows_at(product, own.rows)
    moved, weights = rows_at(u, own.rows), rows_at(weight, own.rows)
    for s in range(springs.stiffness.size):
        a, b, k = springs.ends[s, 0], springs.ends[s, 1], springs.stiffness[s]
        extension = directed_extension(springs, moved, s)
        growth = directed_extension(springs, weights, s)
        out.stiffness[s] += extension * growth
        _add_directed(springs, s, k * growth, added)
        for c in range(3):
            apart = moved[a, c] - (moved[b, c] if b >= 0 else 0.0)
            weighs = weights[a, c] - (weights[b, c] if b >= 0 else 0.0)
            out.direction[s, c] += k * (apart * growth + weighs * extension)
    differentiate_lines(springs.lines, out.lines, moved, weights, added)


class _Context(NamedTuple):
    springs: Springs
    group: int  # energy group
    rows: int
    histories: int


@forces
def _forces(own, u, v, t, force, powers):
    springs, moved, out = own.springs, rows_at(u, own.rows), rows_at(force, own.rows)
    power = pull_lines(springs.lines, moved, out)
    for s in range(springs.stiffness.size):
        extension = directed_extension(springs, moved, s)
        _add_directed(springs, s, springs.stiffness[s] * springs.now[s, 0] * extension, out)
        power += 0.5 * springs.stiffness[s] * springs.now[s, 1] * extension * extension
    numbers_at(powers, 1)[0] += power


@energies
def _energies(own, u, out):
    springs, moved = own.springs, rows_at(u, own.rows)
    energy = lines_energy(springs.lines, moved)
    for s in range(springs.stiffness.size):
        extension = directed_extension(springs, moved, s)
        energy += 0.5 * springs.stiffness[s] * springs.now[s, 0] * extension * extension
    numbers_at(out, own.group + 1)[own.group] = energy


@mean_forces
def _mean_forces(own, u0, u1, before, h, t, force, powers):
    springs, out = own.springs, rows_at(force, own.rows)
    start, end = rows_at(u0, own.rows), rows_at(u1, own.rows)
    power = pull_on_average(springs.lines, start, end, h, out)
    for s in range(springs.stiffness.size):
        first, last = directed_extension(springs, start, s), directed_extension(springs, end, s)
        mean = 0.5 * springs.stiffness[s] * springs.now[s, 0] * (first + last)
        _add_directed(springs, s, mean, out)
        squares = first * first + last * last
        power += 0.25 * springs.stiffness[s] * springs.now[s, 1] * squares
    numbers_at(powers, 1)[0] += power


@limit
def _limit(own, u, v, a, h, beta, energy, lightness):
    rows = own.rows
    return until_turn(own.springs.lines, rows_at(u, rows), rows_at(v, rows), rows_at(a, rows), h)


@place_obstacles
def drive_springs(own, factors):
    """Set the springs and lines of a context to factors of its histories."""
    springs, found = own.springs, rows_at(factors, own.histories)
    for s in range(springs.row.size):
        if springs.row[s] >= 0:
            for k in range(2):
                springs.now[s, k] = found[springs.row[s], k]
    drive_lines(springs.lines, found)


class SpringsTerm(Term):
    """Springs, struts and cables as a term, with their own energy group.

    Parameters
    ----------
    springs : Springs
    histories : sequence of History
        What their rows number.
    limits : ndarray, shape (c,)
        Forces (N) with which lines may be pressed.
    """

    energy_groups: ClassVar[Mapping[str, str]] = {GROUP: "strain energy of springs and cables"}
    undifferentiated: ClassVar[str] = "springs and cables that follow a history"

    def __init__(
        self, springs: Springs, histories: Sequence[Any] = (), limits: NDArray | None = None
    ) -> None:
        self.springs, self.histories = springs, tuple(histories)
        self.limits = np.full(len(springs.lines.stiffness), np.inf) if limits is None else limits

    def driven_by(self, histories: Sequence[Any]) -> SpringsTerm:
        """See `Term`."""
        if not self.histories:
            return self
        row = np.array([*map(histories.index, self.histories), -1])  # -1 stays
        lines = self.springs.lines._replace(row=row[self.springs.lines.row])
        own = self.springs._replace(row=row[self.springs.row], lines=lines)
        return SpringsTerm(_copied(own), histories)

    def at(self, factor: Callable[[Any], float]) -> SpringsTerm:
        """See `Term`."""
        own, factors = _copied(self.springs), np.zeros((len(self.histories) + 1, 3))
        factors[:, 0] = [*map(factor, self.histories), 1.0]
        own.now[:, 0] = factors[own.row, 0]
        own.lines.now[:, 0] = own.lines.change * factors[own.lines.row[:, 0], 0]
        own.lines.now[:, 2] = factors[own.lines.row[:, 1], 0]
        return SpringsTerm(own, self.histories)

    def compiled(self, part: Any, kept: Any, group: int) -> CompiledTerm:
        """See `Term`."""
        own = Context(_Context(self.springs, group, int(part.own[1]), len(self.histories)))
        kernels = {FORCES: _forces, ENERGIES: _energies, MEAN_FORCES: _mean_forces}
        kernels |= {LIMIT: _limit} if self.springs.lines.slack.any() else {}
        kernels |= {PLACE_OBSTACLES: drive_springs} if self.histories else {}
        return CompiledTerm(own, kernels)

    def arrays(self) -> Arrays:
        """See `Term`."""
        return arrays_of(self.springs, *STEADY)

    def pulled(self) -> Pulled | None:
        """See `Term`."""
        if self.histories:
            return None
        nodes = self.springs.ends, self.springs.lines.node
        rows = 1 + max(int(own.max(initial=GROUND)) for own in nodes)
        out = zeros_for(self.springs, "now", "lines")
        out = out._replace(lines=zeros_for(self.springs.lines, *STEADY))
        own = Context(_Backward(self.springs, out, rows))
        return Pulled(own, _pullback, arrays_of(out, *STEADY).numbers)

    @cached_property
    def dofs(self) -> list[NDArray]:
        """Dofs (3k,) of the k points of each line, negative on the ground."""
        dofs = (3 * self.springs.lines.node[:, None] + np.arange(3)).ravel()
        return np.split(dofs, 3 * self.springs.lines.first[1:-1]) if len(dofs) else []

    @cached_property
    def _line_places(self) -> NDArray:
        """Rows and columns (2, k) of the entries of the lines' blocks, negative on the ground."""
        none = np.zeros((2, 0), np.int64)
        pairs = (np.stack(np.broadcast_arrays(d[:, None], d)).reshape(2, -1) for d in self.dofs)
        return np.concatenate([none, *pairs], axis=1)

    @cached_property
    def moves(self) -> NDArray[np.bool_]:
        """Mask (k,) of the entries of the lines' blocks without the ground."""
        return np.all(self._line_places >= 0, axis=0)

    @cached_property
    def places(self) -> tuple[NDArray, NDArray]:
        """See `Term`."""
        row, column = places_of(pairs_of_ends(self.springs.ends))
        lines = self._line_places[:, self.moves]
        return np.concatenate([row, lines[0]]), np.concatenate([column, lines[1]])

    def entries(self, q: NDArray, floor: float = -np.inf) -> NDArray:
        """See `Term`."""
        return self._entries(q, loose=False)

    def _entries(self, q: NDArray, loose: bool) -> NDArray:
        """Tangent entries; loose : see `line_blocks`."""
        springs = self.springs
        stiffness, direction = springs.stiffness * springs.now[:, 0], springs.direction
        along = np.einsum("s,sa,sb->sab", stiffness, direction, direction)
        lines = np.zeros(self._line_places.shape[1])
        line_blocks(springs.lines, nodal(q), loose, lines)
        return np.concatenate([blocks_of_ends(self.springs.ends, along).ravel(), lines[self.moves]])

    def unstrained(self, q: NDArray) -> Unstrained:
        """See `Term`."""
        size = (q.size, q.size)
        tangent = sparse.csr_array(sparse.coo_array((self._entries(q, True), self.places), size))
        lines = self.springs.lines.stiffness * self._acts(q)
        own = np.concatenate([self.springs.stiffness, lines]), *self._rows(q)
        return Unstrained(tangent, sparse.csr_array(size), partial(_stretch, *own))

    def _rows(self, q: NDArray) -> tuple[list[NDArray], list[NDArray]]:
        """Nodes (k,) of each spring and line, and its growth (k, 3) per motion of these.

        Growths are zero for springs that pull in all directions.
        """
        springs, lines, at = self.springs, self.springs.lines, nodal(q)
        nodes = [pair[pair >= 0] for pair in springs.ends]
        pairs = zip(nodes, springs.direction, strict=True)
        rates = [np.array([d, -d])[: len(own)] for own, d in pairs]
        for s in range(len(lines.stiffness)):
            own = np.zeros((lines.first[s + 1] - lines.first[s], 3))
            if lines.natural[s] > 0.0:
                line_rates(lines, at, s, own)
            node = lines.node[lines.first[s] : lines.first[s + 1]]
            nodes.append(node[node >= 0])
            rates.append(own[node >= 0])
        return nodes, rates

    def tensions(self, q: NDArray) -> NDArray[np.float64]:
        """Tensions (c,) of the lines, N."""
        out = np.zeros(len(self.springs.lines.stiffness))
        put_tensions(self.springs.lines, nodal(q), out)
        return out

    def pulls(self, q: NDArray) -> NDArray[np.float64]:
        """Tensions (c,) of the lines, N, zero of slack ones."""
        found = self.tensions(q)
        return np.where(self.springs.lines.slack, np.maximum(found, 0.0), found)

    def add_scale(self, scale: NDArray) -> None:
        """Add force scales of lines, as for bars; see `Term`."""
        lines = self.springs.lines
        force = np.repeat(lines.stiffness * (lines.natural + lines.stretch), np.diff(lines.first))
        here = lines.node >= 0
        np.add.at(scale, 3 * lines.node[here, None] + np.arange(3), force[here, None])

    def holds(self, q: NDArray) -> sparse.csr_array:
        """Internal constraints: directed springs, and lines to the ground; see `Term`."""
        nodes, rates = self._rows(q)
        grounded = np.array([(each < 0).any() for each in self.dofs], bool)
        acts = [*np.ones(len(self.springs.ends), bool), *(grounded & self._acts(q))]
        found = [pair for pair in compress(zip(nodes, rates, strict=True), acts) if pair[1].any()]
        for s in np.flatnonzero(self.tensions(q) > 0.0):  # taut pieces to the ground hold all ways
            own = self.springs.lines.node[slice(*self.springs.lines.first[s : s + 2])]
            ground = np.concatenate([[0], own, [0]]) < 0
            beside = own[(own >= 0) & (ground[:-2] | ground[2:])]
            found += [(one[None], axis[None]) for one in beside for axis in np.eye(3)]
        dofs = [(3 * node[:, None] + np.arange(3)).ravel() for node, _ in found]
        unit = [rate.ravel() / np.linalg.norm(rate) for _, rate in found]
        start = np.cumsum([0, *map(len, dofs)])
        flat = (np.concatenate([np.zeros(0), *own]) for own in (unit, dofs))
        return sparse.csr_array((*flat, start), (len(found), q.size))

    def _acts(self, q: NDArray) -> NDArray[np.bool_]:
        """Whether each line (c,) acts: it is no cable, or taut."""
        lines = self.springs.lines
        return ~lines.slack | (self.tensions(q) >= -JUST_TAUT * lines.stiffness * lines.natural)

    def nominal(self, q: NDArray) -> SpringsTerm:
        """Cables as if they were taut; see `Term`."""
        lines = self.springs.lines
        if not lines.slack.any():
            return self
        off = np.minimum(self.tensions(q) / lines.stiffness, 0.0) * lines.slack
        slack = lines._replace(slack=np.zeros_like(lines.slack), stretch=lines.stretch - off)
        return SpringsTerm(self.springs._replace(lines=slack), self.histories)

    def placed(self, order: NDArray, before: Any) -> SpringsTerm:
        """See `Term`."""
        rank, springs = np.append(ranks(order), GROUND), self.springs  # the ground keeps its index
        lines = springs.lines._replace(node=rank[springs.lines.node])
        own = springs._replace(ends=rank[springs.ends], lines=lines)
        return SpringsTerm(own, self.histories)


def _stretch(
    stiffness: NDArray, nodes: list[NDArray], rates: list[NDArray], motion: NDArray
) -> float:
    """Stretch, for `Unstrained.stretch`, of springs and lines as in `SpringsTerm._rows`."""
    u = nodal(motion)
    most = np.array([np.linalg.norm(u[own], axis=1).sum() for own in nodes])
    along = np.array([(u[own] * rate).sum() for own, rate in zip(nodes, rates, strict=True)])
    along = np.where([rate.any() for rate in rates], along, most)
    whole = float((stiffness * most**2).sum())
    return np.sqrt(float((stiffness * along**2).sum()) / whole) if whole > 0.0 else 0.0


def _copied(springs: Springs) -> Springs:
    """Springs that change by themselves."""
    lines = springs.lines._replace(now=springs.lines.now.copy())
    return springs._replace(now=springs.now.copy(), lines=lines)
