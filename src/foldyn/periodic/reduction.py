"""Few unknowns for large sheets: modes, and how they change as the sheet moves along them.

In a folded sheet, bars and panels that hardly stretch make nodes follow arcs; each mode moves nodes
along straight lines. Modal derivatives add the second order (Idelsohn and Cardona, Comput. Methods
Appl. Mech. Eng. 49, 1985): with K the tangent and dK/dq_i its change along mode i,

    theta_ij = -K^-1 (dK/dq_j) phi_i.

The static responses to the drive complete the basis. Moving supports carry the sheet along
quasi-statically.
"""

from __future__ import annotations

import copy

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import cho_factor, cho_solve

from foldyn.errors import ComputationError, InputError
from foldyn.periodic.equation import Equation, Instants, Tangents

PROBE = 1e-3  # step for derivatives: largest motion of a node, relative to the sheet's size
LITTLE = 1e-4  # fraction of the drive that is applied to find the static response
DEPENDENT = 1e-6  # relative singular value below which vectors count as dependent


def reduced(equation: Equation, modes: int, displacement: NDArray) -> Equation:
    """The equation projected on the lowest modes about a state and their modal derivatives.

    Parameters
    ----------
    equation : Equation
    modes : int
    displacement : ndarray, shape (n, 3)
        The state, m.

    Returns
    -------
    Equation
        The reduced equation; its attribute `whole` is the given equation.
    """
    still, place = equation.undriven(displacement)
    if modes >= equation.heavy:
        raise InputError(
            f" = {modes}: must be below the number of unknowns, {equation.heavy}", "modes"
        )
    stiffness = still.tangents(place[None])[0]
    try:
        factors = cho_factor(stiffness)
    except np.linalg.LinAlgError:
        raise ComputationError(
            "modes: the sheet is not stable in the state about which its modes are taken, or has "
            "bends without stiffness there; start from a stable state, with bend_law = 'linear'"
        ) from None
    shapes = equation.vibrations(stiffness, 0, modes - 1)[1]
    vectors = [*shapes.T, *_derivatives(equation, still, place, shapes, factors)]
    vectors += _static(equation, place, factors)
    return _projected(equation, place, _independent(equation.mass, np.array(vectors).T), factors)


def _derivatives(
    equation: Equation, still: Instants, place: NDArray, shapes: NDArray, factors
) -> list[NDArray]:
    """Modal derivatives (k,) of all pairs of shapes (k, r)."""
    found = []
    for j, shape in enumerate(shapes.T):
        nodes = equation.nodal((equation.basis @ shape)[None])
        step = PROBE * equation.length / np.linalg.norm(nodes, axis=2).max()
        up, down = (still.tangents((place + s * shape)[None])[0] for s in (step, -step))
        change = (up - down) / (2.0 * step)
        found += [cho_solve(factors, -change @ other) for other in shapes.T[: j + 1]]
    return found


def _static(equation: Equation, place: NDArray, factors) -> list[NDArray]:
    """Static responses to small drives, at two phases a quarter period apart."""
    phase = np.array([0.0, 0.5 * np.pi])
    there = np.tile(place, (2, 1))
    none, little = (equation.at(phase, level).forces(there) for level in (0.0, LITTLE))
    return [cho_solve(factors, -force) for force in (little - none) / LITTLE if force.any()]


def _independent(mass: NDArray, vectors: NDArray) -> NDArray:
    """M-orthonormal basis (k, r) of the span of vectors, without dependent vectors."""
    vectors = vectors / np.sqrt(np.einsum("ij,ik,kj->j", vectors, mass, vectors))
    value, turned = np.linalg.eigh(vectors.T @ mass @ vectors)
    kept = value > DEPENDENT**2 * value[-1]
    return vectors @ (turned[:, kept] / np.sqrt(value[kept]))


def _projected(equation: Equation, place: NDArray, basis: NDArray, factors) -> Equation:
    """The equation projected on a basis (k, r) about a place (k,)."""
    out = copy.copy(equation)
    for name in ("rounding", "length"):  # cached for the whole equation
        out.__dict__.pop(name, None)
    out.whole, out.drive = equation, copy.copy(equation.drive)
    out.drive.moves = [
        (_carried(equation, place, np.ravel(shape), factors), history)
        for shape, history in equation.drive.moves
    ]
    out.tangents = Tangents(equation.body, equation.basis, basis)
    out.basis = equation.basis @ basis
    out.offset = equation.basis @ place
    out.size = out.heavy = basis.shape[1]
    out.mass, out.damping = (basis.T @ part @ basis for part in (equation.mass, equation.damping))
    mass, drag = equation._moved
    out._moved = basis.T @ mass, basis.T @ drag
    out._back = basis.T @ equation.mass
    return out


def _carried(equation: Equation, place: NDArray, shape: NDArray, factors) -> NDArray:
    """Displacements (m,) of all dofs if supports move quasi-statically by a shape (m,)."""
    tangent = equation.body.tangent(equation.basis @ place)
    full = np.zeros(tangent.shape[0])
    full[: len(shape)] = shape
    return full - equation.basis @ cho_solve(factors, equation.basis.T @ (tangent @ full))
