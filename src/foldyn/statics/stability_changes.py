"""Where a path gains and loses stability, in words: what a warning and the result's facts say.

A limit point that a method with a free load factor has located is what that method is for, and is
marked in the result. Wherever else negative eigenvalues appear, it is told: there a real structure
leaves the path, although the points that follow are equilibria like all others.
"""

from __future__ import annotations

from collections.abc import Sequence
from itertools import pairwise
from typing import Any, NamedTuple

from foldyn.statics.station import Point

MOST_TOLD = 20  # changes that the attribute lists


class Change(NamedTuple):
    """Neighboring points with different counts; without a first one the path begins so."""

    before: Point | None
    after: Point

    @property
    def critical(self) -> Point | None:
        """The located critical point among them."""
        both = (self.before, self.after)
        return next((point for point in both if point and point.kind != "regular"), None)

    @property
    def loses(self) -> bool:
        """Whether there are more of them after it."""
        return self.before is None or self.after.negative > self.before.negative

    def __str__(self) -> str:
        """Counts and load factors."""
        end, at = self.after, self.critical
        if self.before is None:
            return f"{end.negative} from the start, the load factor {end.factor:.4g}"
        start = self.before
        if at is not None:
            what = "limit point" if at.kind == "limit" else at.kind
            where = f"the load factor {at.factor:.4g} ({what})"
            return f"{start.negative} up to {where}, then {end.negative}"
        return (
            f"{start.negative} at the load factor {start.factor:.4g}, {end.negative} at "
            f"{end.factor:.4g}"
        )


def changes(points: Sequence[Point], from_rest: bool) -> list[Change]:
    """Changes of the count along a path; `from_rest`, where there were none, included."""
    counted = [point for point in points if point.negative >= 0]
    found = [Change(a, b) for a, b in pairwise(counted) if a.negative != b.negative]
    if from_rest and counted and counted[0].negative:
        found.insert(0, Change(None, counted[0]))
    return found


def facts(points: Sequence[Point], from_rest: bool) -> dict[str, Any]:
    """Attributes of a path: how many points are unstable, and where the count changes."""
    counts = [point.negative for point in points]
    if max(counts, default=-1) < 0:
        return {"unstable_points": -1, "stability_changes": "not counted"}
    found = [str(change) for change in changes(points, from_rest)]
    more = [f"and {len(found) - MOST_TOLD} more"] if len(found) > MOST_TOLD else []
    return {
        "unstable_points": sum(count > 0 for count in counts),
        "stability_changes": "; ".join([*found[:MOST_TOLD], *more]) or "none",
    }


def warning(points: Sequence[Point], from_rest: bool, free: bool) -> str:
    """What to tell of a path; empty where there is nothing.

    free : whether the method follows a path through limit points, by a free load factor.
    """
    told = [
        change
        for change in changes(points, from_rest)
        if change.loses and not (free and change.critical and change.critical.kind == "limit")
    ]
    if not told:
        return ""
    most = max(point.negative for point in points)
    more = f", and at {len(told) - 1} more places (up to {most})" if len(told) > 1 else ""
    remedy = "switch_branch follows the path that crosses there"
    if told[0].before is None:
        remedy = "start from a stable state"
    elif not any(change.critical for change in told):
        remedy = f"method 'arc_length' locates the point, and {remedy}"
    return (
        f"the path loses stability: the count of negative eigenvalues is {told[0]}{more}. A real "
        f"structure buckles or snaps there and leaves the path; {remedy}"
    )
