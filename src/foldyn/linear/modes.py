"""`modes`: natural frequencies and shapes of a case about a state."""

from __future__ import annotations

import time
import warnings
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from foldyn.cases import Case, State
from foldyn.errors import FoldynWarning, InputError
from foldyn.linear.eigen import Spectrum, lowest
from foldyn.linear.linearized import Linearized, linearize
from foldyn.linear.participation import free_mass, participation_factors
from foldyn.linear.pencil import Pencil
from foldyn.linear.rigid_modes import rigid_share, rigid_space, unresisted
from foldyn.memory import check_memory
from foldyn.results import modes_dataset
from foldyn.values import whole

if TYPE_CHECKING:
    import xarray

COPIES = 4  # of the shapes, while they are found and stored
RIGID = 1.0 - 1e-6  # share of a shape in the space of rigid motions from which it is one


def modes(
    case: Case,
    count: int = 6,
    state: State | str | None = None,
    secant: float | None = None,
    *,
    load_factor: float = 1.0,
    verify: bool = True,
    solver: str = "auto",
) -> xarray.Dataset:
    """Natural frequencies and mode shapes of a case about an equilibrium.

    Solves K phi = lambda M phi on the free dofs, K the tangent in the state, for the lowest
    eigenvalues lambda = (2 pi f)^2.

    Parameters
    ----------
    case : Case
        Its loads and imposed displacements are preloads; histories play no part.
    count : int
        How many modes, the lowest ones, rigid and unstable ones included.
    state : State or "equilibrium", optional
        About which: a state, as `fd.initial_state(path)`; the equilibrium under the loads in full;
        without it the rest state, in which no load acts.
    secant : float, optional
        Amplitude (degrees) by which hinges turn: those of the superlinear law, without slope at
        rest, then have the slope equivalent to an oscillation of that amplitude.
    load_factor : float
        How far actuated folds are folded in a given state.
    verify : bool
        Whether to prove by one more factorization that no mode was missed. It costs about as much
        as the first one; few dofs are solved in full and need no proof.
    solver : {"auto", "superlu", "pardiso"}
        Backend of the sparse factorization, as of the settings of `trace`.

    Returns
    -------
    xarray.Dataset
        Dimensions mode, node, axis; `mode` counts from 1. `frequency` (Hz; 0 of rigid modes, nan
        of unstable ones), `eigenvalue` (rad2/s2; negative: unstable; 0: zero to rounding), `shape`
        (phi' M phi = 1 kg m2, the entry of largest size positive), `rigid`, `rigid_share` (of the
        shape in the space of rigid motions), `damping_ratio` (phi' C phi / (2 omega), nan where
        the frequency is 0 or nan), `participation`, `effective_mass`, and `displacement` of the
        state. Attributes: `free_mass` (kg along x, y, z), `complete` (how many of the lowest modes
        are proven to be all there are), `soft_hinges`, `residual` of the state, `rounding` (a
        bound on that of the eigenvalues, as a fraction) and facts about the computation.

    Raises
    ------
    InputError
        An argument out of range; nothing can move; a free node without mass.
    ComputationError
        No equilibrium is found; the modes do not converge.

    Warns
    -----
    FoldynWarning
        The state is no equilibrium, or an unstable one; loads do not act at rest; hinges have no
        slope; a mode was missed.
    """
    count = whole("count", count, least=1)
    check_memory(
        "count", f"{float(count):.3g} modes", 8.0 * COPIES * count * case.structure.nodes.size,
        "take fewer",
    )  # fmt: skip
    began = time.perf_counter()
    linear = linearize(case, state, secant, load_factor)
    pencil = Pencil(linear.stiffness, linear.mass, solver)
    if count > pencil.finite:
        raise InputError(f" = {count}: the case has only {pencil.finite} free dofs", "count")
    space = rigid_space(linear)
    found = lowest(pencil, count, unresisted(linear, space), verify)
    _warn(found)
    statistics = {
        "count": count,
        "state": state if isinstance(state, str) else "rest" if state is None else "given",
        "secant": linear.secant,
        "free_dofs": pencil.finite,
        "free_mass": free_mass(linear),
        "residual": linear.residual,
        "soft_hinges": linear.soft,
        "complete": found.checked,
        "shift": None if np.isnan(found.shift) else found.shift,
        "solver": pencil.backend if pencil.factorizations else "dense",
        "factorizations": pencil.factorizations,
        "largest_residual": float(pencil.residuals(found.values, found.shapes).max()),
        "rounding": _rounding(pencil, found),
        "wall_seconds": time.perf_counter() - began,
    }
    return modes_dataset(case, _variables(linear, found, space), statistics)


def _variables(linear: Linearized, found: Spectrum, space: NDArray) -> dict[str, Any]:
    values, shapes = found.values, _oriented(found.shapes)
    with np.errstate(invalid="ignore"):
        omega = np.sqrt(values)
    modal = np.einsum("ik,ik->k", shapes, linear.damping @ shapes)
    with np.errstate(divide="ignore", invalid="ignore"):
        ratio = np.where(omega > 0.0, modal / (2.0 * omega), np.nan)
    share = rigid_share(linear, space, shapes)
    factors = participation_factors(linear, shapes)
    full = np.zeros((len(values), linear.displacement.size))
    on_nodes = linear.free < full.shape[1]
    full[:, linear.free[on_nodes]] = shapes[on_nodes].T
    return {
        "frequency": omega / (2.0 * np.pi),
        "eigenvalue": values,
        "shape": full.reshape(-1, *linear.displacement.shape),
        "rigid": (values == 0.0) & (share > RIGID),
        "rigid_share": share,
        "damping_ratio": ratio,
        "participation": factors,
        "effective_mass": factors**2,
        "displacement": linear.displacement,
    }


def _rounding(pencil: Pencil, found: Spectrum) -> float:
    """Largest bound on the rounding of the eigenvalues that are not zero, as a fraction of each."""
    finite = found.values != 0.0
    noise = pencil.noise(found.shapes[:, finite])
    return float((noise / np.abs(found.values[finite])).max(initial=0.0))


def _oriented(shapes: NDArray) -> NDArray:
    """Shapes (n, k) with the entry of largest size positive; the first of equal ones counts."""
    size = np.abs(shapes)
    first = np.argmax(size > (1.0 - 1e-6) * size.max(axis=0), axis=0)
    return shapes * np.sign(shapes[first, np.arange(shapes.shape[1])])


def _warn(found: Spectrum) -> None:
    unstable = int((found.values < 0.0).sum())
    messages = []
    if unstable:
        messages.append(
            f"the state is an unstable equilibrium: {unstable} of the {len(found.values)} modes "
            "have a negative eigenvalue and no frequency (nan)"
        )
    if found.missed:
        messages.append(
            f"the count of eigenvalues differs by {abs(found.missed)} from the modes found: "
            "frequencies may be missing; ask for another count of modes"
        )
    for message in messages:
        warnings.warn(message, FoldynWarning, stacklevel=3)
