"""Cables that rub on the points in between, as ropes on bollards: kernels and term.

Over a point that it wraps by the angle a, a cable that slides has tensions in the ratio exp(mu a)
(Euler 1769, Eytelwein 1808), the larger one where it slides to. All pieces are strained alike, so
that L = l0 X lies before a point, with X the share of the pieces before it in the length l, and the
cable slides on at the rate s = -dL/dt: a winch sits at the last point. With ln(T_i / T_(i-1)) =
mu a tanh(s / v0) at each point, and tensions T_j whose mean over the length is the tension T of the
cable without friction (`mechanics.lines`), which stays the derivative of its energy, friction takes
the power

    sum (T_j - T) dl_j/dt = (l / l0) [sum (T_i - T_(i-1)) s_i + (T_last - T) dl0/dt].

The first sum is lost, and never negative; the rest is work of the winch.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Any, ClassVar, NamedTuple

import numpy as np
from numpy.typing import NDArray

from foldyn.jit.compiled import inner_scalar
from foldyn.jit.context import Context, numbers_at, rows_at
from foldyn.mechanics.lines import add_pull, along, growth_of
from foldyn.mechanics.springs import Springs, SpringsTerm, drive_springs
from foldyn.mechanics.term import FORCES, PLACE_OBSTACLES, CompiledTerm, Term, forces


class Capstan(NamedTuple):
    """Arrays of c cables with p points in all, and results of the last evaluation."""

    springs: Springs  # the cables as lines
    rub: NDArray  # (c, 2) mu, and v0, m/s
    slide: NDArray  # (p,) memory: rate s at which the cable slides over each point, m/s
    slope: NDArray  # (p,) memory: derivative of mu a tanh(s / v0) by s, s/m
    ratio: NDArray  # (p,) memory: T_j / T_0 of the piece after each point
    rows: int = 0
    histories: int = 0


@inner_scalar
def wrap(lines, u, i, before, after):
    """Angle (rad) between the pieces before and after point i, of these lengths (m)."""
    apart, both = 0.0, 0.0
    for c in range(3):
        one, other = along(lines, u, i - 1, c) * after, along(lines, u, i, c) * before
        apart, both = apart + (one - other) ** 2, both + (one + other) ** 2
    return 2.0 * math.atan2(math.sqrt(apart), math.sqrt(both))


@inner_scalar
def spread(cables, s, u, v):
    """Evaluate how a cable slides and spreads its tension; return l / l0, and T and T_0, N."""
    lines, whole, growth, level, mean = cables.springs.lines, 0.0, 0.0, 0.0, 0.0
    first, last, natural = (
        lines.first[s],
        lines.first[s + 1] - 1,
        lines.natural[s] + lines.now[s, 0],
    )
    for i in range(first, last):
        grown, length = growth_of(lines, u, v, i)
        whole, growth = whole + length, growth + grown
    share, grows, before = 0.0, 0.0, 0.0  # of the pieces before a point, and the last of these
    for i in range(first, last):
        grown, length = growth_of(lines, u, v, i)
        slide = -lines.now[s, 1] * share - natural * (grows - share * growth) / whole
        grip = cables.rub[s, 0] * wrap(lines, u, i, before, length) if i > first else 0.0
        flow = math.tanh(slide / cables.rub[s, 1])
        level += grip * flow
        cables.slide[i], cables.slope[i] = slide, grip * (1.0 - flow * flow) / cables.rub[s, 1]
        cables.ratio[i] = math.exp(level)
        mean += cables.ratio[i] * length / whole
        share, grows, before = share + length / whole, grows + grown, length
    tension = lines.stiffness[s] * lines.natural[s] * max(whole / natural - 1.0, 0.0)
    return whole / natural, tension, tension / mean


@forces
def _forces(own, u, v, t, force, powers):
    lines, ratio, total = own.springs.lines, own.ratio, numbers_at(powers, 2)
    moved, speed, out = rows_at(u, own.rows), rows_at(v, own.rows), rows_at(force, own.rows)
    for s in range(own.rub.shape[0]):
        first, last = lines.first[s], lines.first[s + 1] - 1
        stretch, mean, start = spread(own, s, moved, speed)
        for i in range(first, last):
            length = growth_of(lines, moved, speed, i)[1]
            pull = (start * ratio[i] - mean) / length if length > 0.0 else 0.0
            add_pull(lines, i, pull, moved, moved, out)
            total[1] += stretch * start * (ratio[i] - ratio[max(i - 1, first)]) * own.slide[i]
        total[0] -= stretch * (start * ratio[last - 1] - mean) * lines.now[s, 1]


class CapstanTerm(Term):
    """Friction of cables as a term, whose memory is in `Capstan`; see `Term`.

    Parameters
    ----------
    springs : SpringsTerm
        The cables, and nothing else.
    rub : ndarray, shape (c, 2)
        See `Capstan`.
    """

    damps = True
    symmetric = False
    undifferentiated: ClassVar[str] = "friction of cables"

    def __init__(self, springs: SpringsTerm, rub: NDArray) -> None:
        self.springs, self.histories = springs, springs.histories
        slide, slope, ratio = np.zeros((3, len(springs.springs.lines.node)))
        self.cables = Capstan(springs.springs, rub, slide, slope, ratio)

    def compiled(self, part: Any, kept: Any, group: int) -> CompiledTerm:
        """See `Term`."""
        own = self.cables._replace(rows=int(part.own[1]), histories=len(self.histories))
        drive = {PLACE_OBSTACLES: drive_springs} if self.histories else {}
        return CompiledTerm(Context(own), {FORCES: _forces} | drive)

    @property
    def places(self) -> tuple[NDArray, NDArray]:
        """See `Term`."""
        return self.springs.places

    damping_places = places

    def entries(self, q: NDArray, floor: float = -np.inf) -> NDArray:
        """Derivative by displacement for constant ratios of the tensions; see `Term`."""
        return self._derivatives(q)[1]

    def damping_entries(self, q: NDArray, hidden: float = 1.0) -> NDArray:
        """Derivative by velocity, for the velocities of the last evaluation; see `Term`."""
        return self._derivatives(q)[0]

    def _derivatives(self, q: NDArray) -> NDArray:
        """Entries (2, k) of the derivatives by velocity and by displacement."""
        lines, u, found = self.cables.springs.lines, np.append(q, np.zeros(3)), [np.zeros((2, 0))]
        for s, dofs in enumerate(self.springs.dofs):  # those of the ground come last
            own = slice(lines.first[s], lines.first[s + 1] - 1)
            ratio, slope = self.cables.ratio[own], self.cables.slope[own]
            vector = lines.vector[own] + np.diff(u[dofs].reshape(-1, 3), axis=0)
            length, natural = np.linalg.norm(vector, axis=1), lines.natural[s] + lines.now[s, 0]
            unit, whole = vector / np.where(length > 0.0, length, 1.0)[:, None], length.sum()
            if not ratio.any():  # not evaluated yet: all sticks
                turns = np.arccos(np.clip((unit[1:] * unit[:-1]).sum(axis=1), -1.0, 1.0))
                slope = np.append(0.0, turns * self.cables.rub[s, 0] / self.cables.rub[s, 1])
                ratio = np.ones(len(slope))
            ratio = ratio * whole / (ratio @ length)  # to the mean
            after, ends = np.tri(len(ratio)), np.diff(np.eye(len(ratio) + 1), axis=0)
            rates = np.einsum("ja,jx->jax", ends, unit).reshape(len(ratio), -1)  # of the lengths
            k = lines.stiffness[s] * lines.natural[s] / natural * (whole > natural)
            slides = after.T @ rates - np.outer(after.T @ length / whole, rates.sum(axis=0))
            # what slides faster pulls harder after the point, and less before it for the same mean
            turn = slope * ratio[:, None] * (after - (ratio * length) @ after / whole)
            damping = k * (whole - natural) * natural / whole * (rates.T @ turn @ slides)
            stiffness = k * np.outer((ratio - 1.0) @ rates, rates.sum(axis=0))
            found.append(np.stack([damping, stiffness]).reshape(2, -1))
        return np.concatenate(found, axis=1)[:, self.springs.moves]

    def nominal(self, q: NDArray) -> CapstanTerm:
        """The term where all sticks; see `Term`."""
        return CapstanTerm(self.springs, self.cables.rub)

    def driven_by(self, histories: Sequence[Any]) -> CapstanTerm:
        """See `Term`."""
        return CapstanTerm(self.springs.driven_by(histories), self.cables.rub)

    def placed(self, order: NDArray, before: Any) -> CapstanTerm:
        """See `Term`."""
        return CapstanTerm(self.springs.placed(order, before), self.cables.rub)
