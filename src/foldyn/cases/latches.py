"""Latches of creases, which engage at an angle and open at a moment or a time."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Annotated, Any

import numpy as np

from foldyn.arguments import Check, Key
from foldyn.cases.decode import Part
from foldyn.cases.loads import PerCrease
from foldyn.cases.selection import Creases, refuse_linear
from foldyn.cases.stops import check_open_angles, on_hinges
from foldyn.errors import ModelRangeWarning, warn
from foldyn.materials.latching import Latching
from foldyn.structures.discretized import Discretized
from foldyn.structures.inelastic_hinges import Remembering
from foldyn.values import number

MOST = 1.05  # times too stiff, beyond which a warning is due


@dataclass(frozen=True)
class Latch(Part):
    """A latch of creases: it engages where they pass an angle, and holds them there.

    It engages where the crease passes the angle, coming from the side on which it rests, and then
    has the moment k L (theta - angle), with theta the dihedral between the panels' ends and L the
    length of the crease at rest. Where this moment exceeds `release`, or at the time `until`, it
    opens, and loses what it has stored; it engages again where the crease passes the angle again.

    Parameters
    ----------
    creases : int, sequence of int, or str
        Numbers in the order of `pattern.creases`, or a name: "mountain", "valley", "all" (all
        except flat creases), or a family of the pattern, such as "zigzag".
    angle : float or sequence of float
        Angle at which it holds (degrees, between 0 and 360, flat 180): one for all creases, or one
        for each.
    stiffness : float
        k per length of the crease (N m/rad per m), above 0.
    release : float, optional
        Moment per length of the crease (N m per m) that opens it, above 0; by default none does.
    until : float, optional
        Time (s) after the beginning of the motion at which it opens for good.

    Notes
    -----
    A latch has a memory: results hold it as `memory`, from which motions and paths go on, and
    `foldyn.latched` tells it by crease.
    """

    creases: Creases
    angle: Annotated[PerCrease, Check(check_open_angles, unit="degrees"), Key("latch")]
    stiffness: Annotated[
        float, Check(number, above=0.0, unit="N m/rad per m"), Key("latch_stiffness")
    ]
    release: Annotated[
        float | None, Check(number, above=0.0, unit="N m per m"), Key("latch_release")
    ] = None
    until: Annotated[float | None, Check(number, above=0.0, unit="s"), Key("latch_until")] = None

    missing = {"latch_stiffness": "give it (N m/rad per m of the crease)"}
    apart = "latches of creases are a support of their own"

    def remembering(self, structure: Discretized, place: str) -> Remembering:
        """The latches as hinges with memory."""
        refuse_linear(structure, place, "latches")
        on = on_hinges(self, structure, place)
        folds = structure.body.sheet.fold_hinges().some(on.row)
        hinges = folds._replace(stiffness=on.stiffness, softness=0.0 * on.stiffness)
        limit = (np.inf if self.release is None else self.release) / (self.stiffness * on.share)
        law = Latching(
            tuple((on.angle - hinges.rest).tolist()), tuple((on.side * on.stiffness).tolist()),
            tuple(limit.tolist()), np.inf if self.until is None else self.until,
        )  # fmt: skip
        return Remembering("fold", law, hinges, np.zeros(len(limit)), on.row)


def warn_of_company(parts: Sequence[tuple[str, Any]], structure: Discretized) -> None:
    """Warn where stops and latches act on a crease together, each as if alone beside its panels.

    The panels are springs c in series with all of them: k1 and k2 are (k1 + k2)/(1 + c (k1 + k2)).
    """
    folds = structure.body.sheet.fold_hinges()
    apart, together = np.zeros((2, 2, len(folds.rest)))  # N m/rad, by side: below, above
    for place, part in parts if folds.softness.any() else ():
        on = on_hinges(part, structure, place)
        own = part.stiffness * folds.length[on.row]
        for above in range(2):
            acts = np.isin(on.side, 2 * above - 1) | isinstance(part, Latch)
            together[above, on.row] += acts * own
            apart[above, on.row] += acts * own / (1.0 + folds.softness[on.row] * own)
    ratio = apart * (1.0 + folds.softness * together) / np.where(together > 0.0, together, 1.0)
    if ratio.max(initial=0.0) > MOST:
        crease = folds.fold[int(np.argmax(ratio.max(axis=0)))]
        warn(
            f"crease {crease} has several stops and latches that act together, each as if alone "
            f"beside panels that are springs in series: together they are up to {ratio.max():.3g} "
            'times too stiff; give it one, or take preset = "n5b8e"',
            "supports.md#latches",
            ModelRangeWarning,
        )
