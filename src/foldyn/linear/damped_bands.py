"""Damped Bloch waves: complex frequencies at real phases.

Waves phi exp(s t) of a phase k solve (s^2 M(k) + s C(k) + K(k)) phi = 0. The lowest s are found by
Arnoldi iteration about a shift on the positive real axis, where the matrix is positive definite.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray
from scipy import linalg
from scipy.sparse.linalg import LinearOperator, eigs

from foldyn.cases import State
from foldyn.linear.bloch import Bloch, null_space
from foldyn.linear.linearized_cell import linearize_cell
from foldyn.linear.model_range import warn_beyond
from foldyn.linear.unit_cell import UnitCell
from foldyn.linear.wave_solver import check_count
from foldyn.linear.zone import checked_phases, of_phases
from foldyn.results.dataset import result_dataset
from foldyn.threads import in_threads
from foldyn.values import of_kind, whole

if TYPE_CHECKING:
    import xarray

SHIFT = 1e-4  # of the square root of the stiffness-to-mass scale
NOISE = 1e-3  # of the shift: smaller s count as zero
DENSE = 200  # dofs up to which all eigenvalues are computed
SPARE = 4  # extra eigenvalues beyond the count
TURN = 2.0 * np.pi


def damped_bands(
    cell: UnitCell,
    phases: Any,
    *,
    count: int = 6,
    state: State | None = None,
    secant: float | None = None,
    load_factor: float = 1.0,
) -> xarray.Dataset:
    """Bands of a repeated case with its damping: complex frequencies at real phases.

    Parameters
    ----------
    cell, phases, count, state, secant, load_factor
        As in `bands`.

    Returns
    -------
    xarray.Dataset
        Dimensions phase, band, sorted by abs(s). `rate` (s, complex, 1/s), `frequency` (Hz,
        abs(Im s) / 2 pi; 0 for overdamped waves) and `damping_ratio` (-Re s / abs(s); 1 for
        overdamped waves; nan for rigid motions). Coordinates and attributes as in `bands`.

    Raises
    ------
    InputError
        As in `bands`.

    Examples
    --------
    >>> import foldyn as fd
    >>> sheet = fd.Sheet(youngs_modulus=1e9, poissons_ratio=0.3, thickness=1e-3, density=1000.0)
    >>> pattern = fd.patterns.miura(a=0.03, b=0.03)
    >>> case = fd.Case(fd.discretize(pattern, sheet), damping=fd.Rayleigh(alpha=100.0))
    >>> found = fd.linear.damped_bands(fd.UnitCell(case), [[1.0, 0.0]], count=1)
    >>> round(float(found.rate.real[0, 0]), 6)
    -50.0
    """
    given = checked_phases(phases, of_kind("cell", cell, UnitCell).dimensions)
    count = whole("count", count, least=1)
    linear = linearize_cell(cell, state, secant, load_factor)
    rates = np.array(in_threads(lambda phase: damped_rates(linear.bloch, phase, count), given))
    size = np.abs(rates)
    warn_beyond(cell.case.structure, size.max(axis=0) / TURN, "band")
    ratio = np.divide(-rates.real, size, out=np.full(size.shape, np.nan), where=size > 0.0)
    along, attributes = of_phases(phases, given)
    along["band"] = ("band", 1 + np.arange(count))
    data: dict[str, Any] = {
        "rate": (("phase", "band"), rates, {"units": "1/s"}),
        "frequency": (("phase", "band"), np.abs(rates.imag) / TURN, {"units": "Hz"}),
        "damping_ratio": (("phase", "band"), ratio, {"units": "1"}),
    }
    facts = {"count": count, "secant": secant}
    result = result_dataset("damped_bands", cell.case, data | linear.variables, along, facts)
    return result.assign_attrs(attributes)


def damped_rates(bloch: Bloch, phase: NDArray, count: int) -> NDArray[np.complex128]:
    """The lowest s (count,), 1/s, by |s|, one of each complex pair."""
    factors = bloch.factors(phase)
    free = np.flatnonzero(~bloch.held)
    basis = np.eye(len(free))
    if not bloch.ties.empty:
        basis = null_space(bloch.ties.at(factors)[:, free])
    stiffness, damping, mass = (
        basis.conj().T @ part.at(factors)[np.ix_(free, free)] @ basis
        for part in (bloch.stiffness, bloch.damping, bloch.mass)
    )
    size = len(stiffness)
    most = size - int(bloch.hidden.sum())
    check_count(count, most, phase)
    wanted = min(2 * count + SPARE, 2 * most)
    scale = np.trace(stiffness).real / np.trace(mass).real
    shift = SHIFT * np.sqrt(scale)
    factor = linalg.lu_factor(stiffness + shift * damping + shift**2 * mass)

    def solve(x: NDArray) -> NDArray:
        """(A - shift B)^-1 B x of the linearized problem in phi and s phi."""
        f, g = x[:size], x[size:]
        u = -linalg.lu_solve(factor, mass @ g + damping @ f + shift * (mass @ f))
        return np.concatenate([u, f + shift * u])

    if (
        size <= DENSE or wanted >= 2 * size - 1
    ):  # iterations over clusters of bands may not converge
        inverse = linalg.eigvals(solve(np.eye(2 * size)))
        found = shift + 1.0 / inverse[np.argsort(-np.abs(inverse))[:wanted]]
    else:
        start = np.random.default_rng(0).normal(size=2 * size) + 0j
        operator = LinearOperator((2 * size, 2 * size), solve, dtype=complex)
        found = shift + 1.0 / eigs(operator, wanted, v0=start, return_eigenvectors=False)
    noise = NOISE * shift  # a double root of zero is accurate to the square root of round-off
    found = np.where(np.abs(found) <= noise, 0.0, found)
    upper = found[np.imag(found) >= -noise]
    return upper[np.argsort(np.abs(upper), kind="stable")][:count]
