"""Bands, the frequencies of Bloch waves in a repeated case: undamped, damped, and their gaps.

Damped waves phi exp(s t) with the phase k solve (s^2 M(k) + s C(k) + K(k)) phi = 0. The lowest s
are found by Arnoldi iteration about a shift on the positive real axis, where the matrix is positive
definite.
"""

from __future__ import annotations

import time
from collections.abc import Mapping, Sequence
from itertools import pairwise
from typing import Any

import numpy as np
import xarray
from numpy.typing import NDArray
from scipy import linalg
from scipy.sparse.linalg import LinearOperator, eigs

from foldyn.cases import State
from foldyn.condensation import Superelements
from foldyn.errors import InputError, ModelRangeWarning, quietly, warn
from foldyn.linear import model_error
from foldyn.linear.bloch import Bloch, null_space
from foldyn.linear.linearized import warn_beyond
from foldyn.linear.linearized_cell import LinearizedCell, linearize_cell
from foldyn.linear.unit_cell import UnitCell, checked_phases
from foldyn.linear.wave_solver import Waves, WaveSolver, check_count, slopes_of, tracked
from foldyn.results.dataset import result_dataset
from foldyn.threads import in_threads
from foldyn.values import flag, number, of_kind, whole

TURN = 2.0 * np.pi
OF_PHASES = ("ticks", "tick_labels", "grid")
"""Attributes of phases that are copied to bands."""
SHIFT = 1e-4  # shift, relative to the square root of the stiffness-to-mass scale
NOISE = 1e-3  # values of s below this, relative to the shift, count as zero
DENSE = 200  # dofs up to which all eigenvalues are computed
SPARE = 4  # eigenvalues computed in addition to the count
COMPARED = 8  # phases at which bars and hinges are compared with superelements
ALL = "all"
"""Name of the direction of full gaps, which are gaps at every phase."""


def bands(
    cell: UnitCell,
    phases: Any,
    *,
    count: int = 6,
    state: State | None = None,
    group_velocity: bool = False,
    shape: bool = False,
    polarization: bool = False,
    secant: float | None = None,
    load_factor: float = 1.0,
    track: bool = True,
    check_model: bool = True,
) -> xarray.Dataset:
    """Frequencies of Bloch waves: the bands of a repeated case.

    Solves K(k) phi = lambda M(k) phi for the lowest eigenvalues lambda = (2 pi f)^2, K the tangent
    of the repeated sheet in the state. Damping is ignored; see `damped_bands`.

    Parameters
    ----------
    cell : UnitCell
    phases : array_like, shape (n, d), or DataArray
        Wave vectors as phases (rad) per period, for example from `UnitCell.path` or
        `UnitCell.grid`.
    count : int
        Number of bands, from the lowest on.
    state : State, optional
        State to linearize about, such as `fd.initial_state(path)`: displacements of the nodes of
        the cell that repeat, possibly with other periods; by default the rest state.
    group_velocity : bool
        Whether to return group velocities, by the Hellmann-Feynman theorem.
    shape : bool
        Whether to return the shapes at all nodes.
    polarization : bool
        Whether to return the shares of motions along x, y and z in the kinetic energy.
    secant : float, optional
        Amplitude (degrees) of hinges with the superlinear law; see `modes`.
    load_factor : float
        Load factor of actuated folds in a given state.
    track : bool
        Whether bands follow the shapes of their waves from phase to phase (MAC), through
        crossings; otherwise they are sorted by frequency.
    check_model : bool
        Whether to compare bars and hinges at rest with superelements, at some of the phases, where
        that takes a few seconds at most.

    Returns
    -------
    xarray.Dataset
        Dimensions phase, band, and period, node, axis where needed. `frequency` (Hz; nan for
        unstable waves), `eigenvalue` (rad2/s2); on request `slope` (d omega/d k, rad/s per rad of
        each period; nan if omega is 0), `group_velocity` (m/s, along x, y, z: the slopes times the
        shifts of the periods), `shape` (complex, phi^H M phi = 1 kg m2 in a cell; copy R of a node
        moves as shape exp(i k . R), turned with a screw), and `polarization` (shares along x, y,
        z). Coordinate `wave_vector` (phase, period), rad, and the coordinates and attributes of
        the phases (`distance`; `ticks`, `tick_labels`, `grid`). For the state: `vectors` (period,
        axis), m, and `angles` (period), rad, from a cell to the next, `axes` and `points` (m) of
        screws, and `displacement`. Of superelements also `frequency_error` (Hz), an estimate of the
        largest error relative to a shell on a fine mesh, and the attribute `holds_to` (Hz), up to
        which frequencies are estimated to be within 5 %. Of bars and hinges at rest `model_error`,
        the relative error by comparison with superelements of a low level, in order of frequency,
        at eight phases; nan elsewhere. Like other results, the dataset contains
        its case.

    Raises
    ------
    InputError
        An argument out of range; a state that does not repeat.

    Warns
    -----
    FoldynWarning
        The state is not an equilibrium, or unstable; hinges have no slope.
    ModelRangeWarning
        Bands lie above the range of the model.

    Notes
    -----
    Bloch waves in bar-and-hinge origami: P. P. Pratapa, P. Suryanarayana, G. H. Paulino, J. Mech.
    Phys. Solids 118, 2018.

    Examples
    --------
    >>> import foldyn as fd
    >>> sheet = fd.Sheet(youngs_modulus=1e9, poissons_ratio=0.3, thickness=1e-3, density=1000.0)
    >>> pattern = fd.patterns.miura(a=0.03, b=0.03)
    >>> cell = fd.UnitCell(fd.Case(fd.discretize(pattern, sheet)))
    >>> b = fd.bands(cell, cell.path("G-X-M-G", 12), count=4)
    >>> dict(b.frequency.sizes)
    {'phase': 12, 'band': 4}
    """
    given = checked_phases(phases, of_kind("cell", cell, UnitCell).dimensions)
    asked = [flag(*pair) for pair in (("group_velocity", group_velocity), ("shape", shape),
             ("polarization", polarization), ("track", track))]  # fmt: skip
    count = whole("count", count, least=1)
    began = time.perf_counter()
    linear = linearize_cell(cell, state, secant, load_factor)
    found = WaveSolver(linear.bloch, count).at(given)
    if asked[3]:
        found = tracked(linear.bloch, given, found)
    values = np.array([each.values for each in found])
    unstable = int((values < 0.0).any(axis=0).sum())
    if unstable:
        warn(
            f"the state is unstable: {unstable} of the {count} bands have waves with a negative "
            "eigenvalue, which have no frequency (nan); give a stable state",
            "waves.md#prestressed-and-folded-states",
        )
    with np.errstate(invalid="ignore"):
        frequency = np.sqrt(values) / TURN
    data: dict[str, Any] = {
        "frequency": (("phase", "band"), frequency, {"units": "Hz"}),
        "eigenvalue": (("phase", "band"), values, {"units": "rad2/s2"}),
    }
    holds_to = None
    compared = model_error.beside(cell.case, check_model, state, secant)
    if compared.case is not None:
        errors = _model_errors(cell.with_case(compared.case), given, frequency)
        data["model_error"] = (("phase", "band"), errors, {"units": "1"})
        model_error.warn_of_bands(errors)
    else:
        warn_beyond(cell.case.structure, np.nan_to_num(frequency).max(axis=0), "band")
    if isinstance(cell.case.structure, Superelements):
        errors = model_error.band_errors(linear, given, found)
        data["frequency_error"] = (("phase", "band"), errors, {"units": "Hz"})
        holds_to = _range(frequency, errors)
    each = list(zip(given, found, strict=True))
    if asked[0]:
        slopes = np.array([slopes_of(linear.bloch, phase, waves) for phase, waves in each])
        speeds = slopes @ linear.vectors
        data["slope"] = (("phase", "band", "period"), slopes, {"units": "rad/s"})
        data["group_velocity"] = (("phase", "band", "axis"), speeds, {"units": "m/s"})
    if asked[1]:
        shapes = np.array([linear.expanded(waves.shapes, phase) for phase, waves in each])
        data["shape"] = (("phase", "band", "node", "axis"), shapes, {"units": "m"})
    if asked[2]:
        shares = polarizations(linear, given, found)
        data["polarization"] = (("phase", "band", "axis"), shares, {"units": "1"})
    facts = {
        "count": count,
        "tracked": int(asked[3]),
        "secant": secant,
        "residual": linear.residual,
        "holds_to": holds_to,
        "not_compared": compared.why,
        "wall_seconds": time.perf_counter() - began,
    }
    return _dataset("bands", linear, phases, given, data, facts)


def _model_errors(reference: UnitCell, phases: NDArray, frequency: NDArray) -> NDArray[np.float64]:
    """Relative errors (n, k) of bands, by comparison with a cell of superelements; see `bands`."""
    chosen = np.unique(np.linspace(0, len(phases) - 1, COMPARED).round().astype(int))
    with quietly():
        linear = linearize_cell(reference, None, None, 1.0)
        found = WaveSolver(linear.bloch, frequency.shape[1]).at(phases[chosen])
    true = np.sqrt(np.array([each.values for each in found]).clip(min=0.0)) / TURN
    out = np.full(frequency.shape, np.nan)
    out[chosen] = model_error.errors_of_bands(frequency[chosen], true)
    return out


def _range(frequency: NDArray, errors: NDArray) -> float:
    """Frequency (Hz) up to which bands hold; warns if it is below the highest of theirs."""
    holds, top = model_error.first_doubtful(frequency, errors), float(frequency.max())
    if holds <= top:
        warn(
            f"the bands are estimated to hold up to {holds:.4g} Hz: frequencies from there on are "
            f"doubtful by more than {model_error.DOUBTFUL:.0%}; take a higher level or fewer bands",
            "superelements.md#errors",
            ModelRangeWarning,
        )
    return min(holds, top)


def _dataset(
    kind: str, linear: LinearizedCell, phases: Any, given: NDArray, data: Mapping[str, Any],
    facts: Mapping[str, Any],
) -> xarray.Dataset:  # fmt: skip
    """Bands at given phases (n, d), with coordinates and attributes that describe the phases."""
    along: dict[str, Any] = {
        "wave_vector": (("phase", "period"), given, {"units": "rad"}),
        "band": ("band", 1 + np.arange(facts["count"])),
    }
    if "distance" in getattr(phases, "coords", ()):
        along["distance"] = phases.coords["distance"]
    result = result_dataset(kind, linear.cell.case, {**data, **linear.variables}, along, facts)
    told = getattr(phases, "attrs", {})
    return result.assign_attrs({key: told[key] for key in OF_PHASES if key in told})


def polarizations(
    linear: LinearizedCell, phases: NDArray, waves: Sequence[Waves]
) -> NDArray[np.float64]:
    """Shares (n, k, 3) of motions along x, y, z in the kinetic energy of waves at phases (n, d)."""
    patch, size = linear.patch, 3 * linear.nodes
    case, structure = patch.case, patch.case.structure
    panels, added = [], 0.0
    if isinstance(structure, Superelements):
        base = [min(patch.step[list(face)].tolist()) for face in structure.pattern.faces]
        own = np.flatnonzero([not any(step) for step in base])  # panels of cell 0
        each = structure.along_axes(case.held_edges, own)
        panels = [(linear.reach.gathered(amplitudes), masses) for amplitudes, masses in each]
        added = np.repeat(case.point_masses[patch.own_nodes], 3)[:, None]
    out = []
    for phase, (_, shapes, momentum) in zip(phases, waves, strict=True):
        pushed = added * shapes[:size] if panels else momentum[:size]
        energy = np.real(shapes[:size].conj() * pushed).reshape(linear.nodes, 3, -1).sum(axis=0)
        for amplitudes, masses in panels:
            moved = amplitudes.sparse_at(linear.bloch.factors(phase)) @ shapes
            energy += [np.real(moved.conj() * (mass @ moved)).sum(axis=0) for mass in masses]
        out.append((energy / energy.sum(axis=0)).T)
    return np.array(out)


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
    data: dict[str, Any] = {
        "rate": (("phase", "band"), rates, {"units": "1/s"}),
        "frequency": (("phase", "band"), np.abs(rates.imag) / TURN, {"units": "Hz"}),
        "damping_ratio": (("phase", "band"), ratio, {"units": "1"}),
    }
    return _dataset("damped_bands", linear, phases, given, data, {"count": count, "secant": secant})


def damped_rates(bloch: Bloch, phase: NDArray, count: int) -> NDArray[np.complex128]:
    """The values s (count,), 1/s, with the least |s|, one from each complex pair."""
    factors = bloch.factors(phase)
    free = np.flatnonzero(~bloch.held)
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

    # iterations may not converge for clusters of bands
    if size <= DENSE or wanted >= 2 * size - 1:
        inverse = linalg.eigvals(solve(np.eye(2 * size)))
        found = shift + 1.0 / inverse[np.argsort(-np.abs(inverse))[:wanted]]
    else:
        start = np.random.default_rng(0).normal(size=2 * size) + 0j
        operator = LinearOperator((2 * size, 2 * size), solve, dtype=complex)
        found = shift + 1.0 / eigs(operator, wanted, v0=start, return_eigenvectors=False)
    noise = NOISE * shift  # a double root at zero has the error sqrt(round-off)
    found = np.where(np.abs(found) <= noise, 0.0, found)
    upper = found[np.imag(found) >= -noise]
    return upper[np.argsort(np.abs(upper), kind="stable")][:count]


def band_gaps(bands: Any, least: float = 1e-3) -> xarray.Dataset:
    """Gaps between bands: full gaps, and gaps along each leg of a path.

    Parameters
    ----------
    bands : xarray.Dataset
        From `foldyn.bands`. For reliable gaps, phases must be dense and cover the zone
        (`UnitCell.grid`).
    least : float
        Least width of a listed gap, divided by the frequency at its middle.

    Returns
    -------
    xarray.Dataset
        A row along `gap` for each gap: `direction` ("all" for full gaps, "G-X" for a gap on this
        leg only), `below` and `above` (numbers of the bands in the order of frequency; 0 below the
        first band), `bottom`, `top`, `middle` and `width` (Hz), and `relative_width`. Full gaps
        come first; in each direction, frequencies increase. `to_dataframe()` gives a table.

    Raises
    ------
    InputError
        Not a result of `foldyn.bands`.
    """
    frequency = frequencies_of(bands)
    least = number("least", least, least=0.0)
    found = []
    for direction, rows in legs(bands).items():
        gaps = _gaps(frequency[rows], least)
        # a gap below the first band concerns the whole zone, or does not exist
        found += [(direction, *gap) for gap in gaps if gap[0] or direction == ALL]
    direction, below, bottom, top = ([gap[k] for gap in found] for k in range(4))
    low, high = np.array(bottom, float), np.array(top, float)
    middle, width = 0.5 * (low + high), high - low
    numbers = np.array(below, np.int64)
    return xarray.Dataset(
        {
            "direction": ("gap", np.array(direction, np.str_)),
            "below": ("gap", numbers),
            "above": ("gap", numbers + 1),
            "bottom": ("gap", low, {"units": "Hz"}),
            "top": ("gap", high, {"units": "Hz"}),
            "middle": ("gap", middle, {"units": "Hz"}),
            "width": ("gap", width, {"units": "Hz"}),
            "relative_width": ("gap", width / np.where(middle > 0.0, middle, 1.0)),
        }
    )


def frequencies_of(bands: Any) -> NDArray[np.float64]:
    """Frequencies (phase, band), Hz, sorted at each phase; 0 for unstable waves."""
    if not hasattr(bands, "data_vars") or "frequency" not in bands or "band" not in bands.dims:
        raise InputError(f": got {type(bands).__name__}; give what foldyn.bands returns", "bands")
    values = bands["frequency"].transpose("phase", "band").values
    return np.sort(np.nan_to_num(values, nan=0.0), axis=1)


def legs(bands: Any) -> dict[str, NDArray[np.int64]]:
    """Rows of phases by direction: all rows, and the rows on each leg of a path."""
    every = np.arange(bands.sizes["phase"])
    found = {ALL: every}
    if "ticks" not in bands.attrs or "distance" not in bands.coords:
        return found
    names, ticks = bands.attrs["tick_labels"].split("-"), np.atleast_1d(bands.attrs["ticks"])
    distance = bands["distance"].values
    for k, (a, b) in enumerate(pairwise(ticks.tolist())):
        slack = 1e-9 * distance[-1]
        rows = every[(distance >= a - slack) & (distance <= b + slack)]
        name = f"{names[k]}-{names[k + 1]}"
        found[name] = np.union1d(found.get(name, rows), rows)
    return found


def _gaps(frequency: NDArray, least: float) -> list[tuple[int, float, float]]:
    """For each gap at the given phases: number of the band below, bottom and top (Hz)."""
    tops = frequency.min(axis=0)
    bottoms = np.concatenate([[0.0], frequency.max(axis=0)[:-1]])
    wide = tops - bottoms > np.maximum(least * 0.5 * (tops + bottoms), 0.0)
    return [(int(k), float(bottoms[k]), float(tops[k])) for k in np.flatnonzero(wide)]
