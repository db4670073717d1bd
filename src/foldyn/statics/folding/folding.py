"""`fold`: from a flat or partly folded pattern to a folded one."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any, Literal

import numpy as np
import xarray
from numpy.typing import NDArray

from foldyn.errors import ComputationError, CrossingWarning, InputError, MotionInterrupted, warn
from foldyn.mechanics.crossings import crossing_panels, pairs_text
from foldyn.patterns import Pattern
from foldyn.patterns.pattern import pattern_of, refuse_junctions
from foldyn.patterns.picture import picture
from foldyn.patterns.transforms import FACE_ORDERS
from foldyn.results import folding_dataset
from foldyn.statics.folding import ways
from foldyn.statics.folding.energy import FoldEnergy, Shape
from foldyn.statics.folding.subdivision import are_slivers, subdivided
from foldyn.statics.folding.targets import fold_targets, full_angles
from foldyn.values import choice, function, whole

MOST_SHOWN = 8  # creases listed in a message
SHUT = 1e-3  # rad from 180 degrees within which a crease counts as closed
CRUMPLED = 0.1  # strain beyond which a state is the last choice
INITIALS = ("auto", "pattern", "folded")


@dataclass(frozen=True, eq=False, repr=False)
class Folding:
    """A folded pattern, the path to it, and its quality.

    Attributes
    ----------
    pattern : Pattern
        The folded state, free of stress: its shape is the shape at rest. Vertices, assignments,
        families, target fold angles and custom data are taken from the pattern that was folded.
        Panels that have bent are cut along their bends, which become welds: the creases are the
        ones that were folded.
    path : xarray.Dataset
        The states on the way, with dimensions step, node, axis and crease: `position` (m),
        `fold_angle` (rad, valleys positive), the largest `strain` of a bar and the largest `bend`
        (rad) of a panel, and `share`, the progress from 0 to 1.
    targets : ndarray, shape (nc,)
        Target fold angle (rad) of each crease; nan if it was free.
    angles : ndarray, shape (nc,)
        Fold angle (rad) reached by each crease.
    wrong : tuple of int
        Mountains and valleys that have not folded as assigned.
    strain, bend : float
        Residuals of the folded state: the largest strain of a bar, and the largest turn (rad)
        within a panel.
    crossings : ndarray of int, shape (k, 2)
        Pairs of panels that pass through each other in the folded state.
    first_crossings : mapping
        New pairs of crossing panels, for each step at which some appear.
    started_from : {"pattern", "folded"}
        Whether the path begins at the pattern as given, or at the folded state found by rotating
        the panels, from which it was opened.
    """

    pattern: Pattern
    path: xarray.Dataset
    targets: NDArray[np.float64]
    angles: NDArray[np.float64]
    wrong: tuple[int, ...]
    strain: float
    bend: float
    crossings: NDArray[np.int64]
    first_crossings: dict[int, NDArray[np.int64]]
    started_from: str

    def __repr__(self) -> str:
        """One line."""
        strain = f", strain {self.strain:.2g}" if self.kind == "stretched" else ""
        return f"<Folding {self.kind}, {self._turned}{strain}>"

    def _repr_html_(self) -> str | None:
        """A picture for notebooks."""
        return picture(self.pattern, repr(self))

    @property
    def kind(self) -> Literal["rigid", "bent", "stretched"]:
        """Whether the panels stay plane, bend without strain, or are stretched."""
        if self.strain > ways.ISOMETRIC:
            return "stretched"
        return "bent" if self.bend > ways.PLANE else "rigid"

    @property
    def error(self) -> float:
        """Largest difference (rad) between a crease and its target; 0 without targets."""
        given = ~np.isnan(self.targets)
        return float(np.abs(self.angles - self.targets)[given].max(initial=0.0))

    @property
    def rigid_path(self) -> bool:
        """Whether panels stay plane and unstrained at every step."""
        strained = self.path["strain"].values > ways.ISOMETRIC
        return not (strained | (self.path["bend"].values > ways.PLANE)).any()

    @property
    def closed(self) -> NDArray[np.int64]:
        """Closed creases (k,), whose panels lie on each other."""
        return np.flatnonzero(np.abs(self.angles) > math.pi - SHUT)

    @property
    def layers(self) -> NDArray[np.int64] | None:
        """Layer order of a flat-folded state; None if the state is not flat.

        Rows (f, g, s), as FOLD's faceOrders: panel f lies on the side of panel g to which the front
        of g faces (s = 1) or on the other (-1). Each pair that overlaps has one row.
        """
        found = self.pattern.custom.get(FACE_ORDERS)
        return None if found is None else np.array(found, np.int64).reshape(-1, 3)

    @property
    def _turned(self) -> str:
        total = sum(letter in "MV" for letter in self.pattern.assignments)
        return f"{total - len(self.wrong)} of {total} mountains and valleys turn their way"

    @property
    def _where_crossed(self) -> str:
        """Where panels cross, in words: from which step on, and in the folded state."""
        step, pairs = min(self.first_crossings.items())
        return (
            f"from step {step} of {len(self.path['step']) - 1} on ({pairs_text(pairs)}); in the "
            f"folded state {pairs_text(self.crossings) or 'none'}"
        )

    def report(self) -> str:
        """Report of a few lines: which creases turn, remaining strain, panels that cross."""
        lines = [self._turned]
        if self.wrong:
            lines[0] += f"; not {_listed([str(k) for k in self.wrong])}"
        if self.kind == "rigid":
            way = "at every step" if self.rigid_path else "in the folded state, not on the way"
            lines.append(f"rigidly foldable: panels are plane and unstrained {way}")
        elif self.kind == "bent":
            lines.append(
                f"folds without strain if panels bend, by up to {math.degrees(self.bend):.3g} "
                "degrees"
            )
        else:
            lines.append(
                f"does not fold without strain: bars keep up to {self.strain:.2g}, with panels "
                f"bent by up to {math.degrees(self.bend):.3g} degrees"
            )
        if not np.isnan(self.targets).all():
            off = math.degrees(self.error)
            lines.append(f"angles are up to {off:.3g} degrees off their targets")
        if self.started_from == "folded":
            lines.append("the path opens from the folded state, which rotations of the panels give")
        if len(self.closed):
            if self.layers is not None:
                order = f"in an order without crossings ({len(self.layers)} pairs that overlap)"
            elif self.first_crossings:
                order = "in an unknown order, since panels cross"
            else:
                order = "in the order in which they arrived"
            lines.append(f"{len(self.closed)} creases are closed: panels lie on each other {order}")
        if self.first_crossings:
            lines.append(f"panels cross {self._where_crossed}")
        else:
            lines.append("no panels cross")
        return "\n".join(lines)


def fold(
    pattern: Pattern,
    angles: Any = None,
    *,
    fraction: float | str | None = None,
    steps: int = 20,
    initial: Literal["auto", "pattern", "folded"] = "auto",
    panels: Literal["whole", "subdivided"] = "whole",
    progress: Callable[[int, int], None] | None = None,
) -> Folding:
    """Fold a flat or partly folded pattern.

    Creases are springs whose rest angles move to the angles wanted, in stiff panels (see
    `foldyn.statics.folding.energy`); mountains and valleys are pushed back if they would turn the
    wrong way. Then the springs are released, which leaves a nearby isometric state if there is one.
    If panels do not stay plane, or creases turn the wrong way, panels that bend more easily are
    tried as well.

    Parameters
    ----------
    pattern : Pattern
    angles : float, mapping or sequence, optional
        Fold angles (degrees, 0 flat, 180 closed). One number is the size for all mountains and
        valleys, each its own way. A mapping gives creases by assignment ("mountain", "valley",
        "all") or family, by size, and by pairs of vertices, valleys positive: {"zigzag": 90, (3,
        4): -60}. A sequence has one for each crease, valleys positive. A pattern with the same
        creases, such as another frame of a file, gives the angles of its state. Creases that are
        left out, or None, are free: mountains and valleys fold their way as far as the others move
        them; flat creases belong to the panels.
    fraction : float or str, optional
        Alternatively, 0.8 or "80%" of `pattern.fold_angles`, and of 180 degrees for mountains and
        valleys without one. Without either the pattern is folded to its own fold angles.
    steps : int
        States on the way, 1 to 1000.
    initial : {"auto", "pattern", "folded"}
        Where the path begins. "folded" takes the state found by rotating the panels by the full
        angles, if it closes, and opens it to the angles wanted. "auto" folds the pattern as given,
        and if creases turn the wrong way also tries the folded state: this is taken if all creases
        open from there.
    panels : {"whole", "subdivided"}
        "subdivided" cuts panels from their middles to their corners and edge midpoints, so that
        they bend as paper does where whole panels, cut once, stretch. The path and the folded
        pattern then have more vertices, after the others, and each crease becomes two.
    progress : callable, optional
        Called with a step and the number of steps; steps restart with each new attempt.

    Returns
    -------
    Folding

    Raises
    ------
    InputError
        An argument out of range; angles that contradict the assignments; a flat-folded state
        with no valid layer order, or none that agrees with the pattern's file.
    MotionInterrupted
        From the keyboard (Ctrl-C); its `partial` is the folding up to the last step done.

    Warns
    -----
    FoldynWarning
        Mountains or valleys that have not folded their own way; creases that stay closed in a
        path from the folded state.
    CrossingWarning
        Panels that pass through each other in a state of the path.

    Notes
    -----
    A pattern of one degree of freedom with an angle for one crease is folded to round-off. Angles
    that no state can have together (in a Miura-ori, the same fraction of 180 degrees everywhere)
    are met as closely as springs of equal stiffness per length allow.

    Examples
    --------
    >>> import foldyn as fd
    >>> flat = fd.Pattern([(0, 0), (1, 0), (1, 1), (0, 1)], [(0, 1, 2), (0, 2, 3)], ["V"])
    >>> folding = fd.fold(flat, 90)
    >>> folding.kind, folding.pattern.dihedrals.round(6)
    ('rigid', array([1.570796]))
    """
    pattern = pattern_of(pattern)
    function("progress", progress)
    if pattern.boards is not None:
        raise InputError(
            ": has thick panels, which hinge off its planes; fold the thin pattern, then thicken",
            "pattern",
        )
    if not len(pattern.creases):
        raise InputError(": has no creases to fold", "pattern")
    refuse_junctions(
        pattern, "and fold turns single sheets only; give the case fd.Actuate, and trace it"
    )
    steps = whole("steps", steps, least=1, most=1000)
    choice("initial", initial, INITIALS)
    choice("panels", panels, tuple(ways.BENDING))
    targets = fold_targets(pattern, angles, fraction)
    if panels == "subdivided":
        pattern, rows = subdivided(pattern)
        targets = targets[rows]
    letters = np.array(pattern.assignments)
    energy = FoldEnergy(pattern, (letters == "F") & (np.nan_to_num(targets) == 0.0))

    def tell(step: int) -> None:
        if progress is not None:
            progress(step, steps)

    try:
        way = _best_way(pattern, energy, ways.BENDING[panels], targets, steps, initial, tell)
    except ways.WayInterrupted as stop:
        done = len(stop.way.shapes) - 1
        partial = _result(pattern, energy, stop.way, targets) if done else None
        raise MotionInterrupted(f"interrupted after {done} of {steps} steps", partial) from None
    folding = _result(pattern, energy, way, targets)
    _warn(folding)
    return folding


def _best_way(
    pattern: Pattern, energy: FoldEnergy, bending: ways.Bending, targets: NDArray,
    steps: int, initial: str, tell: Callable[[int], None],
) -> ways.Way:  # fmt: skip
    """The best way: fewest creases turned wrong, then no strain, then closest to the targets.

    The folded state is used only if all its creases open and end closer to the targets.
    """

    def cost(way: ways.Way) -> tuple[bool, int, bool, float]:
        last = way.shapes[-1]
        strain, wrong = ways.largest_strain(last), len(ways.wrong_ways(energy, last.turns, targets))
        return strain > CRUMPLED, wrong, strain > ways.ISOMETRIC, _off(energy, way, targets)

    best = None
    if initial != "folded":
        stiffest, *others = bending.folding
        best = ways.from_pattern(energy, stiffest, targets, steps, tell)
        for softer in others:
            bend = energy.bent(best.shapes[-1].turns).max(initial=0.0)
            if any(cost(best)[:3]) or bend > ways.SLIGHT:
                best = min(best, ways.from_pattern(energy, softer, targets, steps, tell), key=cost)
        if initial == "pattern" or not any(cost(best)[:3]):
            return best
    way = ways.from_folded(
        energy, bending.opening, pattern, full_angles(pattern), targets, steps, tell
    )
    if best is not None:
        if way is None or len(_unopened(energy, way, targets)):
            return best
        if _off(energy, way, targets) >= _off(energy, best, targets):
            return best
        return min(best, way, key=cost)
    if way is None:
        raise InputError(
            ' = "folded": the panels do not close when they are rotated by the full angles about '
            'the creases, or the pattern is not flat; take "pattern"',
            "initial",
        )
    return way


def _off(energy: FoldEnergy, way: ways.Way, targets: NDArray) -> float:
    """Mean difference (rad) between creases and their targets; 0 without targets."""
    off = np.abs(energy.creases(way.shapes[-1].turns) - targets)
    return float(np.nansum(off) / max(1, np.isfinite(off).sum()))


def _unopened(energy: FoldEnergy, way: ways.Way, targets: NDArray) -> NDArray[np.int64]:
    """Creases that should open on the way and have hardly done so."""
    first, last = (energy.creases(way.shapes[k].turns) for k in (0, -1))
    return ways.unopened(first, last, targets)


def _result(pattern: Pattern, energy: FoldEnergy, way: ways.Way, targets: NDArray) -> Folding:
    """Make the `Folding` of a way: crossings, angles, layers."""
    from foldyn.statics.folding.layer_order import with_layers  # loads a library

    path = path_of(pattern, energy, way)
    states = zip(path["position"].values, path["fold_angle"].values, strict=True)
    crossed = [_crossed(pattern, energy, x, turns) for x, turns in states]
    first, before = {}, set()
    for step, pairs in enumerate(crossed):
        now = set(map(tuple, pairs.tolist()))
        if now - before:
            first[step] = np.array(sorted(now - before))
        before = now
    last = way.shapes[-1]
    angles = energy.creases(last.turns).copy()
    folded = folded_pattern(pattern, energy, last, path["position"].values[-1])
    given = pattern.custom.get(FACE_ORDERS, ()) if folded.faces == pattern.faces else ()
    return Folding(
        pattern=with_layers(folded, angles, math.pi - SHUT, given),
        path=path,
        targets=targets,
        angles=angles,
        wrong=tuple(ways.wrong_ways(energy, last.turns, targets).tolist()),
        strain=ways.largest_strain(last),
        bend=float(energy.bent(last.turns).max(initial=0.0)),
        crossings=crossed[-1],
        first_crossings=first,
        started_from=way.origin,
    )


def _crossed(pattern: Pattern, energy: FoldEnergy, x: NDArray, turns: NDArray) -> NDArray[np.int64]:
    """Pairs of panels that cross in a state, or whose crease has passed 180 degrees."""
    beyond = pattern.crease_faces[np.abs(turns) > math.pi + ways.PLANE]
    pairs = crossing_panels(x, energy.triangles, energy.triangle_panel)
    return np.unique(np.concatenate([pairs, np.sort(beyond, axis=1)]), axis=0)


def _warn(folding: Folding) -> None:
    """Warn about creases folded wrong or left closed, and about panels that cross."""
    if folding.wrong:
        said = f"{len(folding.wrong)} mountains or valleys do not turn their way: creases"
        warn(f"{said} {_named(folding, folding.wrong)}", "folding.md#what-the-report-means")
    first = folding.path["fold_angle"].values[0]
    shut = ways.unopened(first, folding.angles, folding.targets).tolist()
    if folding.started_from == "folded" and shut:
        said = f"{len(shut)} creases stay closed that were to open: creases"
        warn(f"{said} {_named(folding, shut)}", "folding.md#what-the-report-means")
    if folding.first_crossings:
        text = f"panels pass through each other {folding._where_crossed}"
        warn(text, "results.md#panels-that-cross", CrossingWarning)


def _named(folding: Folding, creases: Sequence[int]) -> str:
    pairs = folding.path["crease_vertices"].values[list(creases)].tolist()
    return _listed([f"{k} ({a}, {b})" for k, (a, b) in zip(creases, pairs, strict=True)])


def _listed(items: Sequence[str]) -> str:
    more = len(items) - MOST_SHOWN
    return ", ".join(items[:MOST_SHOWN]) + (f" and {more} more" if more > 0 else "")


def path_of(pattern: Pattern, energy: FoldEnergy, way: ways.Way) -> xarray.Dataset:
    """States of a way, each placed as close as possible to the previous one."""
    place, positions = pattern.vertices, []
    for shape in way.shapes:
        place = placed(energy.place(shape.x), place)
        positions.append(place)
    values = {
        "displacement": np.array(positions) - pattern.vertices,
        "position": positions,
        "fold_angle": [energy.creases(shape.turns) for shape in way.shapes],
        "strain": [ways.largest_strain(shape) for shape in way.shapes],
        "bend": [energy.bent(shape.turns).max(initial=0.0) for shape in way.shapes],
    }
    return folding_dataset(pattern, way.shares, values, {"started_from": way.origin})


def placed(x: NDArray, near: NDArray) -> NDArray:
    """Points x (n, 3), moved as a rigid body as close as possible to `near` (Kabsch)."""
    middle, target = x.mean(axis=0), near.mean(axis=0)
    left, _, right = np.linalg.svd((x - middle).T @ (near - target))
    way = np.diag([1.0, 1.0, np.sign(np.linalg.det(left @ right))])
    return (x - middle) @ (left @ way @ right) + target


def folded_pattern(pattern: Pattern, energy: FoldEnergy, shape: Shape, x: NDArray) -> Pattern:
    """The pattern at positions x (n, 3), with bent panels cut along their bends.

    Panels that would leave slivers, such as with three corners on a line, stay whole.
    """
    bent = np.abs(shape.turns - energy.rest)[: len(energy.diagonals)] > ways.PLANE
    slivers = energy.triangle_panel[are_slivers(x[energy.triangles])]
    cut = np.setdiff1d(energy.diagonal_panel[bent], slivers)
    whole = np.ones(len(pattern.faces), bool)
    whole[cut] = False
    faces = [face for face, kept in zip(pattern.faces, whole, strict=True) if kept]
    pieces = energy.triangles[np.isin(energy.triangle_panel, cut)]
    inside = np.sort(energy.diagonals[np.isin(energy.diagonal_panel, cut)], axis=1)
    welds = np.concatenate([pattern.welds, inside])
    try:
        return pattern.changed(vertices=x, faces=[*faces, *pieces.tolist()], welds=welds)
    except InputError as error:
        raise ComputationError(
            f"the folded state is no sound pattern ({error}): fold it less"
        ) from None
