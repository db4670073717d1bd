"""`bands`: frequencies of Bloch waves in a repeated case."""

from __future__ import annotations

import time
import warnings
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray
from scipy import linalg, sparse
from scipy.sparse.linalg import LinearOperator, eigsh, splu
from threadpoolctl import threadpool_limits

from foldyn.cases import State
from foldyn.errors import ComputationError, FoldynWarning, InputError
from foldyn.linear.bloch import Bloch, null_space
from foldyn.linear.group_velocity import Waves, slopes_of
from foldyn.linear.linearized_cell import LinearizedCell, linearize_cell
from foldyn.linear.tracking import tracked
from foldyn.linear.unit_cell import UnitCell
from foldyn.linear.zone import checked_phases
from foldyn.values import flag, whole
from foldyn.workers import processors

if TYPE_CHECKING:
    import xarray

DENSE = 500  # dofs up to which a problem is solved with full matrices
GUARD = 3  # waves beyond those asked for, that none is missed where several coincide
EPS = float(np.finfo(float).eps)
ROUNDING = 1e-15  # of |phi|' |K| |phi|: what counts as zero
SHIFT = 1e-6  # of the pencil's scale: the shift below zero
NOISE = 30.0  # times the rounding of the largest entries: what counts as zero, too
TURN = 2.0 * np.pi


@dataclass(frozen=True, eq=False)
class Solver:
    """Solves for the waves of a cell, one phase after the other.

    The dofs that are free keep their order; hidden ones are condensed, constraints met by motions
    that span what they leave.
    """

    bloch: Bloch
    count: int

    @property
    def free(self) -> NDArray[np.int64]:
        """Dofs with mass that are not held."""
        bloch = self.bloch
        return np.flatnonzero(~bloch.held & ~bloch.hidden)

    def waves(self, phase: NDArray) -> Waves:
        """The lowest waves of a phase (d,)."""
        bloch = self.bloch
        if bloch.size > DENSE and bloch.ties.empty:
            return self._sparse(phase)
        factors = bloch.factors(phase)
        stiffness, mass = bloch.stiffness.at(factors), bloch.mass.at(factors)
        free, hidden = self.free, np.flatnonzero(bloch.hidden)
        own = stiffness[np.ix_(free, free)]
        follow = np.zeros((0, len(free)))
        if len(hidden):
            across = stiffness[np.ix_(hidden, free)]
            follow = -linalg.solve(stiffness[np.ix_(hidden, hidden)], across, assume_a="her")
            own = own + across.conj().T @ follow
        inert = mass[np.ix_(free, free)]
        lumped = None if bloch.lumped is None else bloch.lumped[free]
        basis = None
        if not bloch.ties.empty:
            basis = null_space(bloch.ties.at(factors)[:, free])
            own, inert, lumped = basis.conj().T @ own @ basis, basis.conj().T @ inert @ basis, None
        if len(own) < self.count:
            raise InputError(
                f" = {self.count}: supports, links and rigid panels leave {len(own)} motions at "
                f"the phases {phase.round(6).tolist()}; ask for no more bands",
                "count",
            )
        values, motions, noise = lowest_dense(own, inert, lumped, self.count)
        if basis is not None:
            motions = basis @ motions
        shapes = np.zeros((bloch.size, len(values)), complex)
        shapes[free] = motions
        if len(hidden):
            shapes[hidden] = follow @ motions
        return Waves(self._rounded(values, shapes, stiffness, noise), shapes)

    def _rounded(
        self, values: NDArray, shapes: NDArray, stiffness: Any, least: float = 0.0
    ) -> NDArray:
        """Eigenvalues with those that are zero to rounding as zeros."""
        size = np.abs(shapes)
        noise = ROUNDING * np.einsum("ik,ik->k", size, abs(stiffness) @ size)
        return np.where(np.abs(values) <= np.maximum(noise, least), 0.0, values)

    def _sparse(self, phase: NDArray) -> Waves:
        """The same by Lanczos iteration about a shift below zero."""
        bloch = self.bloch
        factors = bloch.factors(phase)
        kept = np.flatnonzero(~bloch.held)
        stiffness = bloch.stiffness.sparse_at(factors)[kept][:, kept]
        mass = bloch.mass.sparse_at(factors)[kept][:, kept]
        scale = stiffness.diagonal().real.sum() / mass.diagonal().real.sum()
        shift = -SHIFT * scale
        factor = splu(sparse.csc_array(stiffness - shift * mass))
        inverse = LinearOperator(stiffness.shape, factor.solve, dtype=complex)
        values, motions = eigsh(
            stiffness, self.count + GUARD, mass, sigma=shift, OPinv=inverse, v0=_start(len(kept))
        )
        order = np.argsort(values)[: self.count]
        motions = motions[:, order]
        size = np.sqrt(np.einsum("ik,ik->k", motions.conj(), mass @ motions).real)
        shapes = np.zeros((bloch.size, self.count), complex)
        shapes[kept] = motions / size
        whole_stiffness = bloch.stiffness.sparse_at(factors)
        return Waves(self._rounded(values[order], shapes, whole_stiffness), shapes)


def _start(size: int) -> NDArray[np.complex128]:
    """Where the iteration begins: the same every time."""
    parts = np.random.default_rng(0).normal(size=(2, size))
    return parts[0] + 1j * parts[1]


def lowest_dense(
    stiffness: NDArray, mass: NDArray, lumped: NDArray | None, count: int
) -> tuple[NDArray, NDArray, float]:
    """Lowest eigenvalues (k,), motions (n, k) with phi^H M phi = 1, and rounding of the values."""
    diagonal = np.diag(mass).real if lumped is None else lumped
    noise = NOISE * EPS * float((np.diag(stiffness).real / diagonal).max())
    wanted = [0, count - 1]
    if lumped is None:
        try:
            values, motions = linalg.eigh(
                stiffness, mass, subset_by_index=wanted, check_finite=False
            )
        except linalg.LinAlgError:
            raise ComputationError("a free node of the cell has no mass") from None
        return values, motions, noise
    root = 1.0 / np.sqrt(lumped)
    values, motions = linalg.eigh(
        root[:, None] * stiffness * root, subset_by_index=wanted, driver="evx", check_finite=False
    )
    return values, root[:, None] * motions, noise


def bands(
    cell: UnitCell,
    phases: Any,
    count: int = 6,
    state: State | None = None,
    *,
    group_velocity: bool = False,
    shape: bool = False,
    polarization: bool = False,
    secant: float | None = None,
    load_factor: float = 1.0,
    track: bool = True,
) -> xarray.Dataset:
    """Frequencies of Bloch waves: the bands of a repeated case.

    Solves K(k) phi = lambda M(k) phi for the lowest eigenvalues lambda = (2 pi f)^2, K the tangent
    of the repeated sheet in the state.

    Parameters
    ----------
    cell : UnitCell
    phases : array_like, shape (n, d), or DataArray
        Wave vectors as phases (rad) per period, as `UnitCell.path` and `UnitCell.grid` make them.
    count : int
        How many bands, the lowest ones.
    state : State, optional
        About which: displacements of the cell's own nodes that repeat, maybe with other periods, as
        `fd.initial_state(path)`; by default the rest state.
    group_velocity : bool
        Whether to give group velocities, by the Hellmann-Feynman theorem.
    shape : bool
        Whether to give the motions of all nodes.
    polarization : bool
        Whether to give the shares of the directions in the kinetic energy.
    secant : float, optional
        Amplitude (degrees) of hinges of the superlinear law; see `modes`.
    load_factor : float
        How far actuated folds are folded in a given state.
    track : bool
        Whether bands follow the shapes of their waves from a phase to the next (MAC), through
        crossings; else they are in the order of their frequencies.

    Returns
    -------
    xarray.Dataset
        Dimensions phase, band, and period, node, axis where they are needed. `frequency` (Hz; nan
        of unstable waves), `eigenvalue` (rad2/s2); on request `slope` (d omega/d k, rad/s per rad
        of each period; nan where omega is 0) and `group_velocity` (m/s, along x, y, z: the shifts
        of the periods times their slopes), `shape` (complex, phi^H M phi = 1 kg m2 in a cell; copy
        R of a node moves as shape exp(i k . R), turned with a screw), and `polarization` (shares
        along x, y, z). Coordinate `wave_vector` (phase, period), rad, and what the phases bring
        (`distance`; attributes `ticks`, `tick_labels`, `grid`). Attributes: `vectors` (m) of the
        state, `angles` (degrees), `axes` and `points` (m) of the motions from a cell to the next,
        `residual`.

    Raises
    ------
    InputError
        An argument out of range; a state that does not repeat.

    Warns
    -----
    FoldynWarning
        The state is no equilibrium, or unstable; hinges have no slope.

    Notes
    -----
    Bloch waves in bar-and-hinge origami: P. P. Pratapa, P. Suryanarayana, G. H. Paulino, J. Mech.
    Phys. Solids 118, 2018.

    Examples
    --------
    >>> import foldyn as fd
    >>> sheet = fd.Sheet(youngs_modulus=1e9, poissons_ratio=0.3, thickness=1e-3, density=1000.0)
    >>> pattern = fd.patterns.eggbox(a=0.03, b=0.03)
    >>> cell = fd.UnitCell(fd.Case(fd.discretize(pattern, sheet)))
    >>> b = fd.bands(cell, cell.path("G-X-M-G", 12), count=4)
    >>> dict(b.frequency.sizes)
    {'phase': 12, 'band': 4}
    """
    import xarray

    given = checked_phases(phases, cell.dimensions if isinstance(cell, UnitCell) else 1)
    asked = [flag(*pair) for pair in (("group_velocity", group_velocity), ("shape", shape),
             ("polarization", polarization), ("track", track))]  # fmt: skip
    count = whole("count", count, least=1)
    began = time.perf_counter()
    linear = linearize_cell(cell, state, secant, load_factor)
    solver = Solver(linear.bloch, count)
    found = waves_at(solver, given)
    if asked[3]:
        found = tracked(linear.bloch, given, found)
    values = np.array([each.values for each in found])
    unstable = int((values < 0.0).any(axis=0).sum())
    if unstable:
        warnings.warn(
            f"the state is unstable: {unstable} of the {count} bands have waves with a negative "
            "eigenvalue, which have no frequency (nan)",
            FoldynWarning,
            stacklevel=2,
        )
    with np.errstate(invalid="ignore"):
        frequency = np.sqrt(values) / TURN
    data: dict[str, Any] = {
        "frequency": (("phase", "band"), frequency, {"units": "Hz"}),
        "eigenvalue": (("phase", "band"), values, {"units": "rad2/s2"}),
    }
    if asked[0]:
        slopes = np.array(
            [slopes_of(linear.bloch, k, w) for k, w in zip(given, found, strict=True)]
        )
        data["slope"] = (
            ("phase", "band", "period"), slopes, {"units": "rad/s per rad"},
        )  # fmt: skip
        data["group_velocity"] = (
            ("phase", "band", "axis"), slopes @ linear.vectors, {"units": "m/s"},
        )  # fmt: skip
    if asked[1]:
        shapes = [linear.expanded(w.shapes, k) for k, w in zip(given, found, strict=True)]
        data["shape"] = (("phase", "band", "node", "axis"), np.array(shapes), {"units": "m"})
    if asked[2]:
        shares = [polarizations(linear, k, w) for k, w in zip(given, found, strict=True)]
        data["polarization"] = (("phase", "band", "axis"), np.array(shares), {"units": ""})
    coords: dict[str, Any] = {
        "band": ("band", 1 + np.arange(count)),
        "wave_vector": (("phase", "period"), given, {"units": "rad"}),
    }
    if any("axis" in each[0] for each in data.values()):
        coords["axis"] = ("axis", list("xyz"))
    attributes: dict[str, Any] = {
        "kind": "bands",
        "vectors": linear.vectors,
        "angles": np.array([motion.angle for motion in linear.motions]),
        "axes": np.array([motion.unit for motion in linear.motions]),
        "points": np.array([motion.point for motion in linear.motions]),
        "residual": linear.residual,
        "tracked": int(asked[3]),
    }
    if isinstance(phases, xarray.DataArray):
        if "distance" in phases.coords:
            coords["distance"] = phases.coords["distance"]
        attributes |= {key: phases.attrs[key] for key in ("ticks", "tick_labels", "grid")
                       if key in phases.attrs}  # fmt: skip
    attributes["wall_seconds"] = time.perf_counter() - began
    return xarray.Dataset(data, coords, attributes)


def waves_at(solver: Solver, phases: NDArray) -> list[Waves]:
    """Waves of each phase (n, d), on all processors."""
    with threadpool_limits(1), ThreadPoolExecutor(processors()) as pool:
        return list(pool.map(solver.waves, phases))


def polarizations(linear: LinearizedCell, phase: NDArray, waves: Waves) -> NDArray[np.float64]:
    """Shares (k, 3) of the directions in the kinetic energy of waves."""
    count = 3 * linear.nodes
    momentum = (linear.bloch.mass.sparse_at(linear.bloch.factors(phase)) @ waves.shapes)[:count]
    energy = (waves.shapes[:count].conj() * momentum).real
    shares = energy.reshape(linear.nodes, 3, -1).sum(axis=0).T
    return shares / shares.sum(axis=1, keepdims=True)
