"""Laws with memory in a motion: the model that includes them, their state and instant stiffness."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray
from scipy import sparse

from foldyn.cases import Case
from foldyn.mechanics.assembly import Assembly, Numbering
from foldyn.mechanics.inelastic import HingeMemory
from foldyn.structures.inelastic_hinges import memory


def with_memory(case: Case, body: Assembly, by: Numbering) -> Assembly:
    """Model of a motion, in memory order, including the branches of laws with memory.

    Raises
    ------
    InputError
        A crease that yields or creeps is actuated.
    """
    parts = case.remembering
    if not parts:
        return body
    case.check_flow()
    state = memory(parts, case.body)
    hinges = {"fold": body.sheet.fold_hinges, "bend": body.sheet.bend_hinges}
    row = np.concatenate([hinges[p.kind]().row[p.rows] for p in parts])
    own = state.own._replace(dofs=by.dofs(state.own.dofs), row=row)
    return body.with_terms(HingeMemory(own, state.settles, body.sheet))


def instant_stiffness(case: Case, u: NDArray) -> sparse.csr_array | None:
    """Instant stiffness (m, m) of the memory branches at u (n, 3); None without branches."""
    parts = case.remembering
    if not parts:
        return None
    body = case.body
    q = body.dofs(u)
    gradient = memory(parts, body).gradients(q, body.size)
    added = [
        part.stiffness * sum(own.relaxed + own.share + own.more for own in part.branches)
        for part in parts
    ]
    return sparse.csr_array(gradient.T @ sparse.diags_array(np.concatenate(added)) @ gradient)
