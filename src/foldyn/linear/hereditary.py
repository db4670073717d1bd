"""Laws with memory in small vibrations: a complex stiffness that depends on the frequency.

About a state at rest a hinge resists a turn exp(s t) with k (relaxed + sum share s / (s + rate)) in
addition to its elastic part; for s = i w this is the complex modulus of its branches. Modes solve

    (s^2 M + K + K_b(s)) x = 0

for each s near a mode of K and M: the frequency is |s| / 2 pi, the damping ratio -Re s/|s|.
Iterations are Rayleigh quotients, which for symmetric matrices converge to the third order (H. Voss
in Handbook of Linear Algebra, 2nd ed. 2014, chapter 115).
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy import sparse

from foldyn.algebra.superlu import SingularTangentError, factorize
from foldyn.cases import Case
from foldyn.errors import ComputationError
from foldyn.mechanics.sheet_term import CreaseTurns
from foldyn.structures.inelastic_hinges import memory, remembering

MOST = 40  # most iterations for a mode
SETTLED = 1e-11  # relative change of s at convergence
OSCILLATES = 1e-6  # least imaginary part of s, relative to |s|
BESIDE = 1e-7  # relative offset from s if the matrix at s is singular


@dataclass(frozen=True, eq=False)
class Branches:
    """Branches of h hinges on nf free dofs.

    Attributes
    ----------
    gradient : (h, nf)
        Gradients of the hinge angles, 1/m.
    relaxed : (h,)
        Relaxed stiffness that branches add to K, N m/rad.
    share, rate : (h, b)
        Stiffness (N m/rad) and rate (1/s) of each branch; 0 and 1 for missing branches.
    viscous : (h,)
        Part of the branches' damping that is counted elsewhere, N m s/rad.
    """

    gradient: sparse.csr_array
    relaxed: NDArray
    share: NDArray
    rate: NDArray
    viscous: NDArray

    def weights(self, s: complex) -> NDArray:
        """Complex stiffness (h,), N m/rad, at a complex angular frequency, rad/s."""
        relaxing = (self.share * (s / (s + self.rate))).sum(axis=1)
        return self.relaxed + relaxing - s * self.viscous

    def slopes(self, s: complex) -> NDArray:
        """Derivative of `weights` with respect to s."""
        return (self.share * (self.rate / (s + self.rate) ** 2)).sum(axis=1) - self.viscous

    def stiffness(self, s: complex) -> sparse.csc_array:
        """Stiffness (nf, nf) of the branches, N/m."""
        weights = sparse.diags_array(self.weights(s))
        return sparse.csc_array(self.gradient.T @ weights @ self.gradient)


def branches_of(case: Case, q: NDArray, free: NDArray, dampers: bool = False) -> Branches | None:
    """Branches of a case about the dofs q (m,), on the free dofs of all unknowns.

    dampers : whether to include the branches of damped creases, minus the quasi-static part that
        `dynamics.dampers` counts.
    """
    parts = case.remembering
    if not dampers:
        parts = remembering(case.structure, case.body)
    if not parts:
        return None
    turns = case.elastic_body.sheet.crease_turns
    if turns is None:
        gradient = memory(parts, case.body).gradients(q, case.body.size)
        turns = CreaseTurns(gradient, np.arange(gradient.shape[0]))
    gradient, of = turns
    if case.elastic_body.sheet.crease_turns is not None:  # of all folds, in their order
        place, rows = np.full(len(case.structure.folds), -1), [part.rows for part in parts]
        place[np.concatenate(rows)] = np.arange(sum(map(len, rows)))
        remembers = place[of] >= 0
        gradient, of = gradient[remembers], place[of[remembers]]
    if ties := case.constraints:
        gradient = sparse.csr_array(gradient @ ties.extended(gradient.shape[1]))
    most = max(len(part.branches) for part in parts)
    relaxed, share, rate, viscous = [], [], [], []
    for part in parts:
        stiffness, branches = part.stiffness, part.branches
        own = 1.0 - part.hinges.softness * part.hinges.stiffness
        viscous.append(part.damping * own**2)
        relaxed.append(stiffness * sum(branch.relaxed for branch in branches))
        missing = most - len(branches)
        rows = [branch.share * stiffness for branch in branches]
        share.append(np.stack([*rows, *[0.0 * stiffness] * missing], axis=1))
        rows = [branch.rate for branch in branches]
        rate.append(np.stack([*rows, *[np.ones(len(stiffness))] * missing], axis=1))
    relaxed, share, rate, viscous = map(np.concatenate, (relaxed, share, rate, viscous))
    gradient = sparse.csr_array(gradient[:, free])
    return Branches(gradient, relaxed[of], share[of], rate[of], viscous[of])


def damped_mode(
    stiffness: sparse.csc_array, mass: sparse.csc_array, branches: Branches, value: float,
    shape: NDArray,
) -> tuple[complex, NDArray[np.complex128]]:  # fmt: skip
    """Complex frequency s (rad/s) and shape (nf,), x' M x = 1, of the mode near an elastic mode.

    value, shape : eigenvalue (rad2/s2), above 0, and shape of the mode without memory.

    Raises
    ------
    ComputationError
        The iteration does not converge, or converges to an overdamped motion.
    """
    x = shape.astype(complex)
    s = _quotient(stiffness, mass, branches, 1j * _swinging(branches, value, shape), x)
    for _ in range(MOST):
        x = _next(stiffness, mass, branches, s, x)
        before, s = s, _quotient(stiffness, mass, branches, s, x)
        if abs(s - before) <= SETTLED * abs(s):
            if s.imag > OSCILLATES * abs(s):
                return s, x
            break
    raise ComputationError(
        f"the mode near {np.sqrt(value) / (2.0 * np.pi):.6g} Hz is not found with the memory of "
        "its creases: they damp it so strongly that it does not vibrate"
    )


def _swinging(branches: Branches, value: float, shape: NDArray) -> float:
    """Angular frequency (rad/s) of a shape with the storage modulus at this frequency.

    The frequency without memory may be so far below this that damping dominates there.
    """
    turns, omega = (branches.gradient @ shape) ** 2, float(np.sqrt(value))
    for _ in range(MOST):
        square = value + float(np.real(branches.weights(1j * omega)) @ turns)
        omega = float(np.sqrt(max(square, 0.0))) or omega
    return omega


def _quotient(
    stiffness: sparse.csc_array, mass: sparse.csc_array, branches: Branches, s: complex, x: NDArray
) -> complex:
    """Solution near s of x' (s^2 M + K + K_b(s)) x = 0, by Newton's method."""
    k, m, turns = x @ (stiffness @ x), x @ (mass @ x), branches.gradient @ x
    for _ in range(MOST):
        value = s * s * m + k + (branches.weights(s) * turns * turns).sum()
        slope = 2.0 * s * m + (branches.slopes(s) * turns * turns).sum()
        step = value / slope
        s = s - step
        if abs(step) <= 0.1 * SETTLED * abs(s):
            break
    return complex(s)


def _next(
    stiffness: sparse.csc_array, mass: sparse.csc_array, branches: Branches, s: complex, x: NDArray
) -> NDArray:
    """Shape after an inverse iteration at s."""
    for at in (s, s * (1.0 + BESIDE)):
        matrix = sparse.csc_array(stiffness + branches.stiffness(at) + at * at * mass)
        try:
            x = factorize(matrix, symmetric=False).solve(mass @ x)
            break
        except SingularTangentError:
            continue
    return x / np.sqrt(x @ (mass @ x))
