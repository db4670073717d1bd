"""`modes`: natural frequencies and shapes of a case about a state.

What a mode means for motions of the base: with shapes of the modal mass 1, the participation
factor along an axis is phi' M r, r the unit translation of the free dofs along it, and its square
the effective mass. Over all modes effective masses add up to r' M r, the mass that is free to move
along the axis.
"""

from __future__ import annotations

import time
import warnings
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from foldyn.cases import Case, State
from foldyn.errors import FoldynWarning
from foldyn.linear.eigen import Pencil, Spectrum, lowest
from foldyn.linear.linearized import Linearized, linearize
from foldyn.linear.rigid_modes import rigid_share, rigid_space, unresisted
from foldyn.memory import check_memory
from foldyn.results import modes_dataset
from foldyn.statics.stability import oriented
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
    space, along = rigid_space(linear), _unit_translations(linear)
    spectrum = lowest(pencil, count, unresisted(linear, space), verify)
    _warn(spectrum)
    statistics = {
        "count": count,
        "state": state if isinstance(state, str) else "rest" if state is None else "given",
        "secant": linear.secant,
        "free_dofs": pencil.finite,
        "free_mass": np.einsum("ia,ia->a", along, linear.mass @ along),
        "residual": linear.residual,
        "soft_hinges": linear.soft,
        "complete": spectrum.checked,
        "shift": None if np.isnan(spectrum.shift) else spectrum.shift,
        "solver": pencil.backend if pencil.factorizations else "dense",
        "factorizations": pencil.factorizations,
        "largest_residual": float(pencil.residuals(spectrum.values, spectrum.shapes).max()),
        "rounding": _rounding(pencil, spectrum),
        "wall_seconds": time.perf_counter() - began,
    }
    return modes_dataset(case, _variables(linear, spectrum, space, along), statistics)


def _variables(
    linear: Linearized, spectrum: Spectrum, space: NDArray, along: NDArray
) -> dict[str, Any]:
    values, shapes = spectrum.values, oriented(spectrum.shapes)
    with np.errstate(invalid="ignore"):
        omega = np.sqrt(values)
    modal = np.einsum("ik,ik->k", shapes, linear.damping @ shapes)
    with np.errstate(divide="ignore", invalid="ignore"):
        ratio = np.where(omega > 0.0, modal / (2.0 * omega), np.nan)
    share = rigid_share(linear, space, shapes)
    factors = shapes.T @ (linear.mass @ along)
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


def _unit_translations(linear: Linearized) -> NDArray:
    """Unit translations (nf, 3) of the free dofs along x, y, z."""
    on_nodes = linear.free < linear.displacement.size
    return (on_nodes[:, None] & (linear.free[:, None] % 3 == np.arange(3))).astype(float)


def _rounding(pencil: Pencil, spectrum: Spectrum) -> float:
    """Largest bound on the rounding of the eigenvalues that are not zero, as a fraction of each."""
    finite = spectrum.values != 0.0
    noise = pencil.noise(spectrum.shapes[:, finite])
    return float((noise / np.abs(spectrum.values[finite])).max(initial=0.0))


def _warn(spectrum: Spectrum) -> None:
    unstable = int((spectrum.values < 0.0).sum())
    if unstable:
        warnings.warn(
            f"the state is an unstable equilibrium: {unstable} of the {len(spectrum.values)} modes "
            "have a negative eigenvalue and no frequency (nan)",
            FoldynWarning,
            stacklevel=3,
        )
    if spectrum.missed:
        warnings.warn(
            f"the count of eigenvalues differs by {abs(spectrum.missed)} from the modes found: "
            "frequencies may be missing; ask for another count of modes",
            FoldynWarning,
            stacklevel=3,
        )
