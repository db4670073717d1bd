"""`bands`: frequencies of Bloch waves in a repeated case."""

from __future__ import annotations

import time
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from foldyn.cases import State
from foldyn.errors import warn
from foldyn.linear.group_velocity import Waves, slopes_of
from foldyn.linear.linearized_cell import linearize_cell
from foldyn.linear.model_range import warn_beyond
from foldyn.linear.tracking import tracked
from foldyn.linear.unit_cell import UnitCell
from foldyn.linear.wave_solver import WaveSolver
from foldyn.linear.zone import checked_phases, of_phases
from foldyn.results.dataset import result_dataset
from foldyn.values import flag, of_kind, whole

if TYPE_CHECKING:
    import xarray

TURN = 2.0 * np.pi


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
) -> xarray.Dataset:
    """Frequencies of Bloch waves: the bands of a repeated case.

    Solves K(k) phi = lambda M(k) phi for the lowest eigenvalues lambda = (2 pi f)^2, K the tangent
    of the repeated sheet in the state. Damping is ignored; see `damped_bands`.

    Parameters
    ----------
    cell : UnitCell
    phases : array_like, shape (n, d), or DataArray
        Wave vectors as phases (rad) per period, as from `UnitCell.path` and `UnitCell.grid`.
    count : int
        Number of bands, the lowest ones.
    state : State, optional
        State to linearize about: displacements of the cell's own nodes that repeat, possibly with
        other periods, as `fd.initial_state(path)`; by default the rest state.
    group_velocity : bool
        Whether to return group velocities, by the Hellmann-Feynman theorem.
    shape : bool
        Whether to return the shapes at all nodes.
    polarization : bool
        Whether to return the shares of the axes in the kinetic energy.
    secant : float, optional
        Amplitude (degrees) of hinges of the superlinear law; see `modes`.
    load_factor : float
        Load factor of actuated folds in a given state.
    track : bool
        Whether bands follow the shapes of their waves from phase to phase (MAC), through
        crossings; otherwise they are sorted by frequency.

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
        screws, and `displacement`. Like other results it contains its case.

    Raises
    ------
    InputError
        An argument out of range; a state that does not repeat.

    Warns
    -----
    FoldynWarning
        The state is not an equilibrium, or unstable; hinges have no slope.

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
    warn_beyond(cell.case.structure, np.nan_to_num(frequency).max(axis=0), "band")
    data: dict[str, Any] = {
        "frequency": (("phase", "band"), frequency, {"units": "Hz"}),
        "eigenvalue": (("phase", "band"), values, {"units": "rad2/s2"}),
    }
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
        shares = np.array([polarizations(linear.nodes, waves) for waves in found])
        data["polarization"] = (("phase", "band", "axis"), shares, {"units": "1"})
    along, attributes = of_phases(phases, given)
    along["band"] = ("band", 1 + np.arange(count))
    facts = {
        "count": count,
        "tracked": int(asked[3]),
        "secant": secant,
        "residual": linear.residual,
        "wall_seconds": time.perf_counter() - began,
    }
    result = result_dataset("bands", cell.case, data | linear.variables, along, facts)
    return result.assign_attrs(attributes)


def polarizations(nodes: int, waves: Waves) -> NDArray[np.float64]:
    """Shares (k, 3) of the axes in the kinetic energy of waves of a number of nodes."""
    energy = (waves.shapes.conj() * waves.momentum)[: 3 * nodes]
    shares = np.real(energy).reshape(nodes, 3, -1).sum(axis=0).T
    return shares / shares.sum(axis=1, keepdims=True)
