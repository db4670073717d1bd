"""Damping of a case as terms: dashpots, creases, strain rates, beta K0, modes; air drag.

The drag alpha M v is not a term: `dynamics.equation` adds it.

Dashpots with a fixed direction, and isotropic dashpots to ground, have a constant matrix. Creases,
and dashpots along the line between two nodes, are terms of `mechanics.viscous`.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray
from scipy import sparse

from foldyn.cases import Case, History, Origin
from foldyn.dynamics.modal_damping import ModalRows, about
from foldyn.errors import InputError
from foldyn.mechanics.air_drag import AirDragTerm, air_drag
from foldyn.mechanics.assembly import Assembly
from foldyn.mechanics.block_matrix import assembled, blocks_of_ends, pairs_of_ends
from foldyn.mechanics.constant_damping import DampingMatrix, DampingRows
from foldyn.mechanics.sheet_term import NO_DOF, no_fold_hinges
from foldyn.mechanics.term import Term
from foldyn.mechanics.viscous import Viscous, ViscousTerm, viscous
from foldyn.mechanics.viscous_panels import ViscousPanelsTerm


def damping_terms(case: Case, start: Origin | None, modal: ModalRows) -> list[Term]:
    """All damping terms of a motion that began at `start` (None: rest); `modal`: modal damping."""
    terms, rayleigh = dampers(case), case.rayleigh
    if rayleigh.beta > 0.0:
        state, body = about(case, start if rayleigh.state == "initial" else None)
        tangent = _tangent(body, body.dofs(state))
        terms.insert(0, DampingMatrix(tangent * rayleigh.beta, body.hidden))
    modal.warn()
    return [*terms, DampingRows(modal.rows)] if len(modal.rows) else terms


def air_terms(case: Case, histories: Sequence[History]) -> list[Term]:
    """Air drag of a case, in a wind that follows one of `histories`."""
    if case.air is None or not case.air.drag:
        return []
    structure, air = case.structure, case.air
    half = 0.5 * air.density * air.coefficient(structure)
    wind = np.array(air.velocity, float)
    term = AirDragTerm(air_drag(structure.nodes, structure.triangles, wind), half)
    return [
        term.driven(histories.index(history), len(histories)) for _, history in case.wind_terms
    ] or [term]


def _tangent(body: Assembly, q: NDArray) -> sparse.csr_array:
    """Tangent (m, m) at the dofs q (m,), with an entry for all pairs of dofs that can couple.

    Explicit zeros stay, so that the sparsity pattern does not depend on the values.
    """
    parts = [term.tangent(q).tocoo() for term in body.terms]
    data, rows, columns = (
        np.concatenate([getattr(part, name) for part in parts]) for name in ("data", "row", "col")
    )
    return sparse.csr_array(sparse.coo_array((data, (rows, columns)), (q.size, q.size)))


def damping_matrix(
    case: Case, q: NDArray, quasi_static: bool = False, most: bool = False
) -> sparse.csr_array:
    """Matrix (m, m), N s/m, of `dampers` at the dofs q (m,); with all that may act if `most`."""
    none, terms = sparse.csr_array((q.size, q.size)), dampers(case, quasi_static)
    if most:
        terms = [term.nominal(q) or term for term in terms]
    return sum((term.damping(q) for term in terms), none)


def dampers(case: Case, quasi_static: bool = False) -> list[Term]:
    """Dashpots, damped creases, stops and strains, and rubbing cables of a case, on its m dofs.

    Dampers of creases between compliant panels are left out: their hinges have memory instead
    (`Case.remembering`). In slow motions such a hinge is damped by the damper of its crease times
    the square of the crease's share of the turn; `quasi_static` includes it with this value.

    Raises
    ------
    InputError
        The structure does not list the hinges of a damped crease.
    """
    body = case.elastic_body
    pairs, strength = [np.zeros((0, 2), np.int64)], [np.zeros(0)]
    constant = sparse.csr_array((body.size, body.size))
    for place, dashpot in case.dashpots:
        ends = dashpot.ends(case.structure, place)
        if dashpot.coefficient == 0.0:
            continue
        along = dashpot.directions
        if along is None:
            pairs.append(ends)
            strength.append(np.full(len(ends), dashpot.coefficient))
            continue
        block = dashpot.coefficient * (along.T @ along)
        blocks = blocks_of_ends(ends, np.tile(block, (len(ends), 1, 1)))
        constant = constant + assembled(pairs_of_ends(ends), blocks, body.size)
    turns, hinged = body.sheet.crease_turns, case.crease_damping
    if turns is not None and hinged.any():
        hinges = body.sheet.fold_hinges()
        own = (hinged * hinges.length)[turns.fold]
        constant = sparse.csr_array(constant + turns.rows.T @ (turns.rows * own[:, None]))
    ends = np.concatenate(pairs)
    terms: list[Term] = [DampingMatrix(constant)] if constant.nnz else []
    elements = _elements(case, body, ends, np.concatenate(strength), quasi_static)
    if len(elements.coefficient):
        terms.append(ViscousTerm(elements))
    terms += [own for own in (case.damped_stops, case.rubbing_cables) if own is not None]
    strains = body.strains() if case.strain_damping else None
    for own in () if strains is None else strains.membranes:
        resisting = own._replace(stiffness=case.strain_damping * own.stiffness)
        terms.append(ViscousPanelsTerm(resisting))
    return terms


def _elements(
    case: Case, body: Assembly, pairs: NDArray, strength: NDArray, quasi_static: bool
) -> Viscous:
    """Axial dashpots between pairs (p, 2) of nodes, damped creases, and strain damping."""
    damping = case.crease_damping
    if body.sheet.crease_turns is not None:
        damping = np.zeros_like(damping)
    hinges = body.sheet.fold_hinges() if damping.any() else no_fold_hinges()
    unknown = np.setdiff1d(np.flatnonzero(damping), hinges.fold)
    if unknown.size:
        raise InputError(f"damping: this structure cannot damp crease {unknown[0]}: leave it out")
    coefficient = damping[hinges.fold] * hinges.length
    share = 1.0 - hinges.softness * hinges.stiffness
    coefficient = coefficient * np.where(hinges.remembers, share**2 * quasi_static, 1.0)
    damped = coefficient > 0.0
    own, nodes = hinges.some(damped), case.structure.nodes
    along = nodes[pairs[:, 1]] - nodes[pairs[:, 0]]
    turned = own.nodes, own.corners, own.hidden, own.hidden_turn, coefficient[damped]
    parts = [(pairs, along, strength, *turned)]
    if beta := case.strain_damping:
        strains = body.strains()
        assert strains is not None  # otherwise the case would have been refused
        stiff, alone = strains.hinge_stiffness > 0.0, strains.bar_stiffness > 0.0
        none = np.full((int(stiff.sum()), 2), NO_DOF)
        stretched = strains.bars[alone], strains.vector[alone], beta * strains.bar_stiffness[alone]
        turned = strains.hinges[stiff], strains.corners[stiff], none, np.zeros(none.shape)
        parts.append((*stretched, *turned, beta * strains.hinge_stiffness[stiff]))
    return viscous(*map(np.concatenate, zip(*parts, strict=True)))
