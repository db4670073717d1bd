"""Hinges with memory in a structure: through their laws, or through dampers of creases."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from foldyn.materials.inelastic_law import VARIABLES, Branch, MemoryLaw
from foldyn.materials.latching import Latching
from foldyn.materials.law import PARAMETERS
from foldyn.materials.prony import CODE as MAXWELL
from foldyn.materials.prony import CreaseDampers, in_series, maxwell
from foldyn.mechanics.assembly import Assembly
from foldyn.mechanics.inelastic import HingeMemory, MemoryHinges
from foldyn.mechanics.sheet_term import FoldHinges
from foldyn.mechanics.viscous import WIDTH, hinge_dofs
from foldyn.structures.discretized import Discretized

LEAST = 1e-9  # least stiffness of a crease, relative to the stiffness of its panels


class Remembering(NamedTuple):
    """Hinges of one kind whose law has memory.

    damping : damping (k,) of the creases, N m s/rad, if adjacent panels are compliant.
    rows : (k,) rows of these hinges among all of the kind.
    """

    kind: str  # "fold" or "bend"
    law: MemoryLaw
    hinges: FoldHinges
    damping: NDArray
    rows: NDArray

    @property
    def latches(self) -> bool:
        """Whether the hinges have latches in the place of a law."""
        return isinstance(self.law, Latching)

    @property
    def count(self) -> int:
        """Number of branches."""
        return len(self.hinges.rest) * len(self.branches)

    @property
    def stiffness(self) -> NDArray:
        """Stiffness (k,), N m/rad, to which the parameters of branches are relative."""
        stiffness, softness = self.hinges.stiffness, self.hinges.softness
        least = np.divide(LEAST, softness, out=np.zeros_like(softness), where=softness > 0.0)
        return np.maximum(stiffness, least)

    @property
    def branches(self) -> tuple[Branch, ...]:
        """Branches of the law, for all hinges.

        Yielding or creeping elements are in series with the crease, and so with the panels.
        Relaxing elements are parallel to the crease, and in series with part of the panels.
        """
        stiffness = self.stiffness
        own = self.law.branches(stiffness, self.hinges.length)
        share = 1.0 - self.hinges.softness * stiffness
        if (share == 1.0).all() or any(branch.code != MAXWELL for branch in own):
            return own
        none = np.zeros((len(share), 0))
        ratio = np.column_stack([none, *[branch.share for branch in own]])
        rate = np.column_stack([none, *[branch.rate for branch in own]])
        ratio, rate = in_series(share, ratio, rate, self.damping * share / stiffness)
        there = ratio.any(axis=0)
        return maxwell(ratio[:, there], rate[:, there])


def remembering(
    structure: Discretized, body: Assembly | None = None, damping: NDArray | None = None
) -> tuple[Remembering, ...]:
    """Hinges of a structure that have memory: its folds, its bends, both or none.

    body : the structure's body, or a body with further terms.
    damping : damping (nf,) of the structure's creases, N m s/rad per m; none by default.
    """
    laws = {"fold": structure.fold_law, "bend": getattr(structure, "bend_law", None)}
    out, sheet = [], (structure.body if body is None else body).sheet
    damped = damping is not None and damping.any() and bool(sheet.offsets)
    for kind, given in laws.items():
        if given is None or (given.elastic is given and not (damped and kind == "fold")):
            continue
        whole = sheet.fold_hinges() if kind == "fold" else sheet.bend_hinges()
        for law, rows in given.at(whole.fold).parts:
            hinges, number = whole.some(rows), np.arange(len(whole.rest))[rows]
            dampers = np.zeros(len(number))
            if damping is not None and kind == "fold":
                dampers = np.where(hinges.remembers, damping[hinges.fold] * hinges.length, 0.0)
            relaxes = isinstance(law, MemoryLaw) and law.relaxes
            if isinstance(law, MemoryLaw):
                own = dampers if relaxes else 0.0 * dampers
                out.append(Remembering(kind, law, hinges, own, number))
            if dampers.any() and not relaxes:
                out.append(Remembering(kind, CreaseDampers(), hinges, dampers, number))
    return tuple(out)


def memory(parts: tuple[Remembering, ...], body: Assembly) -> HingeMemory:
    """State of the branches of the given parts of a body, starting at rest."""
    columns: dict[str, list[NDArray]] = {name: [] for name in MemoryHinges._fields}
    settles, count = [], 0
    for part in parts:
        hinges, branches = part.hinges, part.branches
        n, b = len(hinges.rest), len(branches)
        own = {
            "dofs": hinge_dofs(hinges.nodes, hinges.hidden),
            "corners": hinges.corners,
            "hidden_turn": hinges.hidden_turn,
            "rest": hinges.rest,
            "row": hinges.row,
            "stiffness": part.stiffness,
            "group": np.full(n, list(body.energy_groups).index(f"strain_{part.kind}s")),
            "arm": _arms(hinges.corners),
            "first": count + b * np.arange(n),
            "code": np.tile([branch.code for branch in branches], n),
            "parameters": np.stack([branch.parameters for branch in branches], axis=1),
        }
        for name, values in own.items():
            columns[name].append(values)
        settles.append(np.full(n * b, part.law.relaxes))
        count += n * b
    columns["first"].append(np.array([count]))
    hinges = sum(len(part.hinges.rest) for part in parts)
    for name in ("angle", "turned", "moment", "slope", "stored"):
        columns[name].append(np.zeros(hinges))
    for name in ("state", "reached"):
        columns[name].append(np.zeros((count, VARIABLES)))
    for name in ("rate", "mean"):
        columns[name].append(np.zeros((hinges, 2)))
    columns["lost"], columns["elapsed"] = [np.zeros(2)], [np.zeros(1)]
    columns["gradient"] = [np.zeros(WIDTH)]
    shapes = {"corners": (-1, 4, 3), "parameters": (-1, PARAMETERS)}
    whole = ("dofs", "row", "group", "first", "code")
    arrays = {
        name: np.ascontiguousarray(
            np.concatenate([part.reshape(shapes.get(name, part.shape)) for part in parts]),
            np.int64 if name in whole else float,
        )
        for name, parts in columns.items()
    }
    return HingeMemory(MemoryHinges(**arrays), np.concatenate(settles), body.sheet)


def _arms(corners: NDArray) -> NDArray:
    """Distance (h,) of each hinge's farther wing from the axis, m; corners as in `MemoryHinges`."""
    along = corners[:, 1] - corners[:, 0]
    off = np.cross(corners[:, 2:] - corners[:, :1], along[:, None])
    return np.linalg.norm(off, axis=2).max(axis=1) / np.linalg.norm(along, axis=1)
