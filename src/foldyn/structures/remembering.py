"""The hinges of a structure whose laws have memory."""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from foldyn.materials.law import PARAMETERS
from foldyn.materials.memory_law import VARIABLES, Branch, MemoryLaw, memory_of
from foldyn.mechanics.body import Body, FoldHinges
from foldyn.mechanics.inelastic import MemoryHinges
from foldyn.mechanics.inelastic_body import Memory
from foldyn.mechanics.viscous import WIDTH, hinge_dofs


class Remembering(NamedTuple):
    """Hinges of one kind whose law has memory."""

    kind: str  # "fold" or "bend"
    law: MemoryLaw
    hinges: FoldHinges

    @property
    def count(self) -> int:
        """Number of its branches."""
        return len(self.hinges.rest) * len(self.branches)

    @property
    def branches(self) -> tuple[Branch, ...]:
        """Branches of the law, of all hinges."""
        return self.law.branches(self.hinges.stiffness, self.hinges.length)


def remembering(structure: Any, body: Body | None = None) -> tuple[Remembering, ...]:
    """What of a structure remembers: its folds, its bends, both or nothing.

    body : the structure's, or one that has it within.
    """
    laws = {"fold": structure.fold_law, "bend": getattr(structure, "bend_law", None)}
    out = []
    for kind, given in laws.items():
        law = memory_of(given)
        if law is None:
            continue
        whole = structure.body if body is None else body
        hinges = whole.fold_hinges() if kind == "fold" else whole.bend_hinges()
        out.append(Remembering(kind, law, hinges))
    return tuple(out)


def memory(parts: tuple[Remembering, ...], body: Body) -> Memory:
    """State of the branches of these parts of a body, which begins at rest."""
    columns: dict[str, list[NDArray]] = {name: [] for name in MemoryHinges._fields}
    settles, count = [], 0
    for part in parts:
        hinges, branches = part.hinges, part.branches
        n, b = len(hinges.rest), len(branches)
        group = body.energy_groups.index(f"strain_{part.kind}s")
        own = {
            "dofs": hinge_dofs(hinges.nodes, hinges.hidden),
            "corners": hinges.corners,
            "per_hidden": np.where(hinges.hidden[:, 0] >= 0, hinges.per_hidden, 0.0),
            "rest": hinges.rest,
            "stiffness": hinges.stiffness,
            "group": np.full(n, group),
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
    columns["lost"], columns["elapsed"] = [np.zeros(2)], [np.zeros(1)]
    columns["gradient"] = [np.zeros(WIDTH)]
    shapes = {"corners": (-1, 4, 3), "parameters": (-1, PARAMETERS)}
    whole = ("dofs", "group", "first", "code")
    arrays = {
        name: np.ascontiguousarray(
            np.concatenate([part.reshape(shapes.get(name, part.shape)) for part in parts]),
            np.int64 if name in whole else float,
        )
        for name, parts in columns.items()
    }
    return Memory(MemoryHinges(**arrays), np.concatenate(settles))
