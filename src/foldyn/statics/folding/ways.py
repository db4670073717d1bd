"""The way from the start to the target angles, step by step, and the release of the springs.

A way starts on a branch that leaves the flat state, or at the folded state itself.

In the flat state bars do not feel displacements across the sheet, and fold angles are linear in
them. A first least-squares step toward small angles of the assigned signs therefore costs no
energy; minimizing the energy with its one-sided terms then closes the panels again. The result is a
branch on which every mountain and valley folds as assigned, if there is one.

Some patterns have no such branch with plane panels (in a crane, vertices make conflicting demands
on a crease). Their folded state may still be isometric, if the rotations across the creases around
every vertex close. It is found by composing these rotations panel by panel, and opened to the
angles wanted.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from itertools import product
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from foldyn.patterns import Pattern
from foldyn.patterns.frames import composed
from foldyn.statics.folding.energy import Aim, FoldEnergy, Shape, Stiffness
from foldyn.statics.folding.minimum import lowest, minimum, settled

PLATES = Stiffness(bends=0.3, creases=1e-3, sides=0.1)  # panels hardly bend
PAPER = Stiffness(bends=0.03, creases=5e-3, sides=0.1)  # panels bend, creases are driven harder
THIN = Stiffness(bends=1e-3, creases=1e-3, sides=1.0)
CLOSING = 10.0  # stiffness of `sides` that keeps closed creases within 180 degrees
AJAR = math.radians(179.8)  # largest turn of creases that open from the folded state
OPENED = 0.1  # a crease counts as closed if it opens by less than this share of what is wanted
FREE_MARGIN = math.radians(1.0)  # margin of mountains and valleys without a target
WEAKER = (0.1, 0.01, 0.001)  # factors on the springs, in turn, before they are released
ENOUGH = 60  # iterations per step before the last step, at which springs need not be released
LESS = 0.3  # largest share of the strain that may remain with the weakest springs
HELD = 0.3  # largest change by the release, as a share of the turns so far
TURNED = 1e-3  # rad, least turn that counts
ISOMETRIC = 1e-9  # strain below which a state counts as isometric
PLANE = 1e-6  # rad, bend below which a panel counts as plane
SLIGHT = 0.01  # rad, largest bend of panels that only drawing errors keep from being plane
CLOSES = 0.02  # largest closing error of a folded state, relative to the size of the pattern
FIRST_TURN = math.radians(8.0)
PERTURBED = Stiffness(bends=30.0, creases=1.0, sides=0.0)  # bars hardly matter


class Bending(NamedTuple):
    """Stiffnesses tried in turn to fold with, and the one to open the folded state with."""

    folding: tuple[Stiffness, ...]
    opening: Stiffness


BENDING = {
    "whole": Bending((PLATES, PAPER), PLATES._replace(sides=CLOSING)),
    "subdivided": Bending((THIN,), THIN._replace(sides=CLOSING)),
}


class Way(NamedTuple):
    """Shapes from first to last, their progress (0 to 1), and where the way began."""

    shapes: list[Shape]
    shares: list[float]
    origin: str  # "pattern" or "folded"


class WayInterrupted(KeyboardInterrupt):
    """A way was interrupted from the keyboard: `way` is the part computed so far."""

    def __init__(self, way: Way) -> None:
        super().__init__()
        self.way = way


def wrong_ways(energy: FoldEnergy, turns: NDArray, targets: NDArray) -> NDArray[np.int64]:
    """Mountains and valleys that have not folded as assigned, unless they are to stay flat."""
    flat = np.abs(np.nan_to_num(targets, nan=1.0)) <= TURNED
    late = energy.signs * energy.creases(turns) <= TURNED
    return np.flatnonzero((energy.signs != 0.0) & late & ~flat)


def unopened(first: NDArray, turns: NDArray, targets: NDArray) -> NDArray[np.int64]:
    """Creases that should open from their first turns (nc,) and have hardly done so."""
    asked = np.abs(first) - np.abs(targets)  # nan where a crease is free
    return np.flatnonzero((asked > TURNED) & (np.abs(first) - np.abs(turns) < OPENED * asked))


def from_pattern(
    energy: FoldEnergy, stiffness: Stiffness, targets: NDArray, steps: int,
    progress: Callable[[int], None],
) -> Way:  # fmt: skip
    """Fold from the pattern as given."""
    first = energy.creases(energy.start.turns)
    start = opened(energy, stiffness)
    way = Way([energy.start], [0.0], "pattern")
    return _followed(way, energy, stiffness, start, (first, targets), steps, progress)


def from_folded(
    energy: FoldEnergy, stiffness: Stiffness, pattern: Pattern, full: NDArray, targets: NDArray,
    steps: int, progress: Callable[[int], None],
) -> Way | None:  # fmt: skip
    """Open from the folded state; None if the panels of a flat pattern do not close in it."""
    folded = np.nan_to_num(full)
    if (np.abs(energy.start.turns) > PLANE).any():
        return None
    vertices, gap = composed(pattern, folded)
    if gap > CLOSES * pattern.size:
        return None
    turns = np.concatenate([np.zeros(energy.bends), folded])
    x = (vertices - vertices.mean(axis=0)) / energy.size
    shape = energy.moved(energy.start._replace(turns=turns), x)
    start = ajar(energy, shape)
    way = Way([shape], [0.0], "folded")
    return _followed(way, energy, stiffness, start, (folded, targets), steps, progress, AJAR)


def _followed(
    way: Way, energy: FoldEnergy, stiffness: Stiffness, shape: Shape,
    angles: tuple[NDArray, NDArray], steps: int, progress: Callable[[int], None],
    most: float = math.pi,
) -> Way:  # fmt: skip
    """Minimize the energy step by step, from `shape`, while rest angles go from first to second.

    If the springs cannot be released at a step, or not without bending panels, this is not tried
    again until the last step.
    """
    before, plane, lets_go, kept = shape, True, True, None
    try:
        for k in range(1, steps + 1):
            aimed = angles[0] + (angles[1] - angles[0]) * (k / steps)
            aim, last = _aim(energy, aimed, most), k == steps
            ahead = 2.0 * shape.x - before.x
            before, shape = shape, lowest(energy, shape, ahead, aim, stiffness)
            iterations, least = (150, 1e-10) if last else (ENOUGH, 1e-4)
            shape = minimum(energy, shape, aim, stiffness, iterations, least)
            if lets_go or last:
                plane = plane or last
                kept, plane = relaxed(energy, stiffness, shape, kept, aim, angles[0], plane)
            lets_go = kept is not None
            if last and kept is None:
                kept = eased(energy, stiffness, shape, aim, angles[0])
            way.shapes.append(shape if kept is None else kept)
            way.shares.append(k / steps)
            progress(k)
    except KeyboardInterrupt:
        raise WayInterrupted(Way(way.shapes[: len(way.shares)], *way[1:])) from None
    return way


def relaxed(
    energy: FoldEnergy, stiffness: Stiffness, shape: Shape, before: Shape | None, aim: Aim,
    first: NDArray, plane: bool,
) -> tuple[Shape | None, bool]:  # fmt: skip
    """The shape with its springs released, if it stays near; and whether panels stay plane.

    The allowed distance is a fraction of the turns since the `first` state. The released shape of
    the previous step, `before`, usually leads to it within a few Newton steps.

    First, if `plane` is allowed, panels keep their stiffness. This suits rigidly foldable patterns,
    even if drawing errors bend the panels slightly in the end. If it fails, panels bend freely, as
    thin paper does.
    """
    wrong = len(wrong_ways(energy, shape.turns, aim.angles))
    most = max(ISOMETRIC, LESS * largest_strain(shape))
    turned = np.abs(energy.creases(shape.turns) - first).sum() + TURNED
    aim = aim._replace(least=np.zeros_like(energy.signs))
    free = aim._replace(angles=np.full_like(aim.angles, np.nan))
    for thin, start in product((False, True) if plane else (True,), (before, shape)):
        if start is None:
            continue
        bends = stiffness.bends * (WEAKER[-1] if thin else 1.0)
        weak = stiffness._replace(bends=bends, creases=stiffness.creases * WEAKER[-1])
        if start is not shape:
            kept = settled(energy, start, aim, weak, 1e-6)
        else:  # in stages: weak springs from the start take many steps
            kept = shape
            for weaker in WEAKER:
                if weaker == WEAKER[-1] and largest_strain(kept) > most:
                    break
                weak = weak._replace(creases=stiffness.creases * weaker)
                kept = minimum(energy, kept, aim, weak)
        if kept is None or largest_strain(kept) > most:
            continue  # strained more than with springs
        for held in (0.0,) if thin else (bends, 0.0):
            let = settled(energy, kept, free, weak._replace(bends=held, creases=0.0), 1e-10)
            if let is not None and largest_strain(let) <= ISOMETRIC:
                break
        else:
            continue
        kept = let
        if not thin and energy.bent(kept.turns).max(initial=0.0) > SLIGHT:
            continue
        if np.abs(energy.creases(kept.turns - shape.turns)).sum() > HELD * turned:
            continue  # too far away
        if len(wrong_ways(energy, kept.turns, aim.angles)) <= wrong:
            return kept, not thin
    return None, False


def eased(
    energy: FoldEnergy, stiffness: Stiffness, shape: Shape, aim: Aim, first: NDArray
) -> Shape:
    """The shape with springs and bends as weak as possible while it stays near and strains fall."""
    turned = np.abs(energy.creases(shape.turns) - first).sum() + TURNED
    wrong, kept = len(wrong_ways(energy, shape.turns, aim.angles)), shape
    for weaker in WEAKER:
        weak = stiffness._replace(
            bends=stiffness.bends * weaker, creases=stiffness.creases * weaker
        )
        weakened = minimum(energy, kept, aim, weak)
        moved = np.abs(energy.creases(weakened.turns - shape.turns)).sum()
        if moved > HELD * turned or largest_strain(weakened) > largest_strain(kept):
            break
        if len(wrong_ways(energy, weakened.turns, aim.angles)) > wrong:
            break
        kept = weakened
    return kept


def largest_strain(shape: Shape) -> float:
    """Largest size of a bar's strain."""
    return float(np.abs(shape.strains).max(initial=0.0))


def _aim(energy: FoldEnergy, angles: NDArray, most: float) -> Aim:
    """Target angles, with the least and largest turns of mountains and valleys toward them."""
    least = np.where(np.isnan(angles), FREE_MARGIN, np.minimum(FIRST_TURN, 0.5 * np.abs(angles)))
    turned = np.abs(np.nan_to_num(angles))
    return Aim(angles, np.where(energy.signs == 0.0, 0.0, least), np.maximum(most, turned))


def opened(energy: FoldEnergy, stiffness: Stiffness) -> Shape:
    """Shape near the start, in which mountains and valleys have begun to fold as assigned."""
    turned = energy.creases(energy.start.turns)
    least = np.where(energy.signs == 0.0, 0.0, FIRST_TURN)
    if (energy.signs * turned >= least).all():
        return energy.start
    wish = np.where(energy.signs * turned < least, energy.signs * least, turned)
    wish = np.where(energy.signs == 0.0, np.nan, wish)
    most = np.full(len(least), math.pi)
    perturbed = minimum(energy, energy.start, Aim(wish, least, most), PERTURBED, iterations=3)
    free = Aim(np.full(len(least), np.nan), least, most)
    return minimum(energy, perturbed, free, stiffness, iterations=100)


def ajar(energy: FoldEnergy, folded: Shape) -> Shape:
    """Shape near a folded one, in which creases have begun to open."""
    turns = energy.creases(folded.turns)
    none, most = np.zeros_like(turns), np.full(len(turns), math.pi)
    aim = Aim(turns - FIRST_TURN * np.sign(turns), none, most)
    return minimum(energy, folded, aim, PERTURBED, iterations=3)
