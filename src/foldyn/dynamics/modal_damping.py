"""Modal damping as rows g_k on the dofs: C = sum of g_k' g_k.

With M-orthonormal modes Phi on the free dofs f, C_ff = M Phi diag(2 zeta omega) Phi' M, a product
with one row per mode (Wilson and Penzien, Int. J. Numer. Methods Eng. 4, 1972). A quasi-static
motion with the supports s moves the free dofs by -K_ff^-1 K_fs u_s. It is not damped; only the
motion relative to it is. Since Phi' K_ff = Lambda Phi' M_ff,

    g_k = sqrt(2 zeta_k omega_k) (phi_k' M_ff,  phi_k' K_fs / lambda_k),

so that g_k vanishes for rigid translations.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy import sparse
from scipy.sparse import linalg

from foldyn.algebra.eigen import Pencil, Spectrum, lowest
from foldyn.cases import Case, ModalDamping, Origin
from foldyn.cases.added_mass import added_mass_at
from foldyn.cases.history import factor
from foldyn.errors import InputError, warn
from foldyn.materials import Superlinear
from foldyn.mechanics.assembly import Assembly
from foldyn.mechanics.following import following_tangent, joined
from foldyn.statics.rigid import free_rigid_motions, of_all_dofs

# a superlinear hinge with a slope below this share of k is at rest up to rounding: 4e-7 rad from
# rest, which the tolerance of statics leaves undetermined
SOFT = 0.01
MOST_MODES = 2000  # largest number of free dofs with all modes damped
RIGID = 1.0 - 1e-6  # a shape is rigid if more than this share of it is a rigid motion
SLOW = 1e-6  # a rigid shape's eigenvalue is below this share of the largest one found
STILL = 1e-9  # constraints keep a hinge from turning if less than this of its gradient is left
ALIKE = 1e-6  # relative difference below which two squared frequencies are equal
BEYOND = 6  # number of modes to compute in addition, as six may be rigid


def soft_slopes(case: Case, body: Assembly, q: NDArray) -> tuple[sparse.csr_array | None, int]:
    """Tangent correction (m, m) that removes slopes of hinges at rest, and their number."""
    at_rest, slope = soft_at_rest(case, body, q)
    change = np.where(at_rest, -slope, 0.0)
    return (body.sheet.soft_tangent(q, change) if change.any() else None), int(at_rest.sum())


def soft_at_rest(case: Case, body: Assembly, q: NDArray) -> tuple[NDArray[np.bool_], NDArray]:
    """Whether superlinear hinges (h,) stand at their rest angle, and their slopes / k (h,).

    The slope of such hinges is only the root of rounding errors. Hinges that constraints keep from
    turning do not count.
    """
    hinges = body.sheet.soft_hinges(q)
    slope = Superlinear().slope(hinges.offset, np.zeros(len(hinges.offset)))
    return (slope < SOFT) & (hinges.stiffness > 0.0) & _turns(case, hinges.gradient), slope


def _turns(case: Case, gradient: sparse.csr_array) -> NDArray[np.bool_]:
    """Whether constraints let each hinge (h,) turn, given the gradients (h, m) of their angles."""
    ties = case.constraints
    if not ties:
        return np.ones(gradient.shape[0], bool)
    basis = ties.extended(gradient.shape[1])[:, ties.free]
    left, whole = (linalg.norm(each, axis=1) for each in (gradient @ basis, gradient))
    return left > STILL * whole


class ModalRows(NamedTuple):
    """Modal damping as rows over the m dofs."""

    rows: NDArray  # (r, m), sqrt(N s/m)
    rate: float  # largest 2 zeta omega, 1/s
    soft: int  # number of hinges without slope, whose modes are left out
    alike: int = 0  # number of modes that share a frequency and get a mean ratio

    def warn(self) -> None:
        """Warn if modes are left out or share a mean ratio."""
        if self.alike:
            warn(
                f"damping: {self.alike} modes have frequencies in common, but different ratios, or "
                "some have none: as any sum of such modes is a mode too, all modes of a frequency "
                "get the mean ratio; give them the same ratio",
                "damping.md#modal",
            )
        if self.soft:
            warn(
                f"damping: {self.soft} hinges of the superlinear law stand at their rest angle, "
                "where their slope vanishes: motions that only they resist are no modes, and modal "
                'damping leaves them out; take preset = "plate" in place of this law, or Rayleigh '
                "damping in addition",
                "damping.md#modal",
            )


def modal_rows(case: Case, start: Origin | None = None) -> ModalRows:
    """Modal damping of a case for a motion that began at `start` (None: at rest).

    Raises
    ------
    InputError
        The state is unstable, or the structure has fewer modes.
    """
    damping = case.modal_damping
    if damping is None:
        return ModalRows(np.zeros((0, case.elastic_body.size)), 0.0, 0)
    state, body = about(case, start if damping.state == "initial" else None)
    q = body.dofs(state)
    change, soft = soft_slopes(case, body, q)
    stiffness = body.tangent(q) if change is None else sparse.csr_array(body.tangent(q) + change)
    loads = joined((part, k) for k, (part, _) in enumerate(case.following_terms))
    if loads.acts and start is not None and damping.state == "initial":
        factors = np.zeros((len(case.following_terms), 3))
        factors[:, 0] = [factor(history, start.time) for _, history in case.following_terms]
        pushed = following_tangent(loads, q, factors)
        stiffness = sparse.csr_array(stiffness + 0.5 * (pushed + pushed.T))
    return rows_of(damping, case, stiffness, moving_mass(case, state), state)._replace(soft=soft)


def about(case: Case, start: Origin | None) -> tuple[NDArray, Assembly]:
    """Displacement (n, 3) that damping refers to, and the body there; rest without a start."""
    if start is None:
        return np.zeros_like(case.structure.nodes), case.elastic_body
    return start.displacement, case.elastic_body_at(start.time)


def mass_of(case: Case) -> sparse.csr_array:
    """Mass (m, m) of all dofs: the nodal mass, zero for other dofs, or the mass of the sheet."""
    own = case.elastic_body.sheet.mass
    nodal = case.mass if own is None else case.carried
    mass = sparse.csr_array(sparse.kron(nodal, sparse.eye_array(3), format="csr"))
    mass.resize((case.elastic_body.size, case.elastic_body.size))
    return mass if own is None else sparse.csr_array(mass + own)


def moving_mass(case: Case, displacement: NDArray) -> sparse.csr_array:
    """Mass (m, m) of a case, including the fluid around the sheet at a displacement (n, 3)."""
    mass, added = mass_of(case), added_mass_at(case, displacement)
    if added is None:
        return mass
    added.resize(mass.shape)
    return sparse.csr_array(mass + added)


def rows_of(
    damping: ModalDamping, case: Case, stiffness: sparse.csr_array, mass: sparse.csr_array,
    state: NDArray,
) -> ModalRows:  # fmt: skip
    """Modal damping for a stiffness and a mass (m, m) at a displacement (n, 3)."""
    ties = case.constraints
    free = np.concatenate([case.free_dofs, case.elastic_body.hidden])
    mass, stiffness = ties.matrix(mass), ties.matrix(stiffness)
    block = sparse.csc_array(mass[free][:, free])
    pencil = Pencil(sparse.csc_array(stiffness[free][:, free]), block)
    spectrum = _swinging(pencil, damping, case, state, free)
    values, shapes = spectrum.values, spectrum.shapes
    rows = np.zeros((len(values), stiffness.shape[0]))
    rows[:, free] = (block @ shapes).T
    held = np.flatnonzero(ties.determined)
    rows[:, held] = (stiffness[held][:, free] @ shapes).T / values[:, None]
    rows = ties.rows_on_dofs(rows)
    ratios, alike = _ratios(damping, values)
    rates = 2.0 * ratios * np.sqrt(values)
    rows = _canonical((rows * np.sqrt(rates)[:, None])[rates > 0.0])
    return ModalRows(rows, float(rates.max(initial=0.0)), 0, alike)


def _canonical(rows: NDArray) -> NDArray:
    """Rows (r, m) with the same C that depend smoothly on the design, which gradients need.

    The sign of a mode shape is arbitrary, and so is the basis of shapes of equal frequency.
    Orthogonal combinations of rows keep C; the combination chosen here makes the products of the
    rows with r fixed vectors upper triangular with a positive diagonal.
    """
    fixed = np.random.default_rng(0).standard_normal(rows.shape[::-1])
    sums, triangle = np.linalg.qr(rows @ fixed)
    return (sums * np.where(np.diag(triangle) < 0.0, -1.0, 1.0)).T @ rows


def _ratios(damping: ModalDamping, values: NDArray) -> tuple[NDArray, int]:
    """Ratios of modes in order of eigenvalues, and the number of modes that get a mean ratio."""
    ratios = np.zeros(len(values))
    ratios[: damping.modes] = damping.ratios
    first = np.append(True, np.diff(values) > ALIKE * values[1:])
    group = np.cumsum(first) - 1
    mean = (np.bincount(group, ratios) / np.bincount(group))[group]
    differs = np.bincount(group, ~np.isclose(mean, ratios, rtol=1e-9, atol=0.0))[group] > 0
    return np.where(differs, mean, ratios), int(differs.sum())


def _swinging(
    pencil: Pencil, damping: ModalDamping, case: Case, state: NDArray, free: NDArray
) -> Spectrum:
    """The lowest vibration modes: all damped modes, and others as low as the last of them."""
    wanted = damping.modes
    if wanted is None and pencil.finite > MOST_MODES:
        raise InputError(
            f": all modes of {pencil.finite} free dofs are too many: all can be damped up to "
            f"{MOST_MODES}; give count, or a list of ratios",
            "damping.modal",
        )
    sought = pencil.finite if wanted is None else min(wanted + BEYOND, pencil.finite)
    while True:
        spectrum = lowest(pencil, sought, np.zeros((pencil.size, 0)))
        if (spectrum.values < 0.0).any():
            raise InputError(
                f': the state "{damping.state}" is unstable ({int((spectrum.values < 0.0).sum())} '
                "negative eigenvalues), and its modes do not swing; take another state, or "
                "Rayleigh damping",
                "damping.modal",
            )
        swings = (spectrum.values > 0.0) & ~_rigid(pencil, spectrum, case, state, free)
        found, all_known = int(swings.sum()), sought == pencil.finite
        values = spectrum.values[swings]
        last = np.inf if wanted is None or found < wanted else values[wanted - 1] * (1.0 + ALIKE)
        if wanted is None or (found >= wanted and (all_known or values[-1] > last)):
            kept = np.flatnonzero(swings)[values <= last]
            return Spectrum(spectrum.values[kept], spectrum.shapes[:, kept], math.nan, len(kept), 0)
        if all_known:
            raise InputError(
                f": ratios of {wanted} modes, but only {found} swing; give fewer", "damping.modal"
            )
        sought = min(2 * sought, pencil.finite)


def _rigid(
    pencil: Pencil, spectrum: Spectrum, case: Case, state: NDArray, free: NDArray
) -> NDArray:
    """Whether each mode (k,) is a rigid motion with almost no stiffness."""
    x = case.structure.nodes + state
    motions = of_all_dofs(case.elastic_body, x, free_rigid_motions(x, case.constraints))
    space = np.zeros((pencil.size, motions.shape[1]))
    known = free < len(motions)
    space[known] = motions[free[known]]
    if not space.shape[1]:
        return np.zeros(len(spectrum.values), bool)
    carried = pencil.mass @ space
    within = np.linalg.solve(space.T @ carried, carried.T @ spectrum.shapes)
    share = np.einsum("ik,ik->k", carried.T @ spectrum.shapes, within)
    return (share > RIGID) & (spectrum.values < SLOW * spectrum.values.max())
