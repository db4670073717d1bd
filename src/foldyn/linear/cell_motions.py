"""Motion of each cell of a finite chain or sheet: over time, as waves, and from end to end.

A finite chain is made by repeating the pattern of a cell (`storeys`, `cells`). The motion from a
cell to the next determines which node belongs to which cell, and displacements of cell n are given
in the axes of cell 0, turned back with the screw, as for Bloch waves.
"""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np
import xarray
from numpy.typing import NDArray

from foldyn.errors import InputError
from foldyn.linear.frf import quantity_of
from foldyn.linear.unit_cell import UnitCell
from foldyn.patterns.screw import Screw
from foldyn.results.contents import check_variable
from foldyn.signals import sampling_interval, wavenumber_spectrum
from foldyn.signals.records import Window
from foldyn.values import choice, of_kind

FEWEST = 3  # least number of cells of a chain
AXES = ("x", "y", "z")
COMPONENTS = (*AXES, "rotation")
FLOOR = 1e-8  # amplitudes below this, relative to the largest, are round-off
ENDS = 0.2  # share of the cells at each end, where waves decay from the end


class Cells(NamedTuple):
    """Nodes (n, m) of n cells, in the same order in each; the motion from a cell to the next."""

    nodes: NDArray[np.int64]
    motion: Screw

    def turned(self, vectors: NDArray) -> NDArray:
        """Vectors (..., nodes, 3) as (..., n, m, 3), in the axes of cell 0."""
        back = np.array([self.motion.rotation(-k) for k in range(len(self.nodes))])
        return np.einsum("nij,...nmj->...nmi", back, vectors[..., self.nodes, :])


def cells_of(positions: NDArray, cell: UnitCell, along: int = 0) -> Cells:
    """Cells of a chain or sheet along one motion of its unit cell.

    Parameters
    ----------
    positions : ndarray, shape (nodes, 3)
        Rest positions (m). Nodes without partners, and incomplete cells at the end, are left out.
    cell : UnitCell
    along : int
        Number of the motion, from 0. In a sheet, all cells along the other motion count as one
        cell.

    Raises
    ------
    InputError
        Fewer than 3 cells in a row.
    """
    from scipy.spatial import cKDTree

    along = of_kind("cell", cell, UnitCell).period("along", along)
    motion = cell.motions[along]
    near = cell.tolerance * float(np.ptp(positions, axis=0).max())
    distance, partner = cKDTree(positions).query(motion.images(positions))
    following = np.where(distance <= near, partner, -1)
    rows, left = [], np.ones(len(positions), bool)
    starts = np.setdiff1d(np.arange(len(positions)), following)
    for node in (*starts, *range(len(positions))):  # the remaining nodes lie on closed rings
        if left[node]:
            row = [int(node)]
            while (after := int(following[row[-1]])) >= 0 and after != node:
                row.append(after)
            left[row] = False
            rows.append(row)
    longest = max(map(len, rows), default=0)
    if longest < FEWEST:
        raise InputError(
            f": the structure has at most {longest} of these cells in a row, and needs {FEWEST}; "
            "give a longer chain, and the cell that it repeats",
            "cell",
        )
    rows = [row for row in rows if len(row) >= longest - 1]
    shortest = min(map(len, rows))
    return Cells(np.array([row[:shortest] for row in rows]).T, motion)


def space_time(
    trajectory: xarray.Dataset, cell: UnitCell, *, component: str = "z", along: int = 0
) -> xarray.Dataset:
    """Motion of each cell of a chain over time.

    Parameters
    ----------
    trajectory : xarray.Dataset
        Motion of a chain or sheet made of copies of the cell, from `simulate`.
    cell : UnitCell
    component : {"x", "y", "z", "rotation"}
        Displacement component: along an axis of cell 0 (a screw turns the axis with each cell); or
        the rotation about the axis of the screw, in rad.
    along : int
        Number of the cell's motion along the chain.

    Returns
    -------
    xarray.Dataset
        Dimensions time and cell: `displacement` (m, or rad) and `velocity`, means over the nodes of
        a cell. `strain` (time, gap): elongation between neighboring cells along the motion, divided
        by their distance at rest (equal for all nodes; negative in compression). Coordinates
        `position` (cell), m, along the motion, and `between` (gap), the cell before it plus 1/2.

    Raises
    ------
    InputError
        Not a motion, or not of such cells; a rotation of cells that repeat without a screw.

    Examples
    --------
    >>> import numpy as np
    >>> import foldyn as fd
    >>> sheet = fd.Sheet(youngs_modulus=1e6, poissons_ratio=0.3, thickness=1e-3, density=100.0)
    >>> tower = lambda n: fd.Case(fd.discretize(
    ...     fd.patterns.kresling(radius=0.05, height=0.07, storeys=n), sheet, preset="n5b8e"))
    >>> push = np.zeros((30, 3))
    >>> push[:6, 2] = 0.1
    >>> motion = fd.simulate(tower(4), 1e-3, initial=fd.State(velocity=push))
    >>> found = fd.linear.space_time(motion, fd.UnitCell(tower(1)))
    >>> found.displacement.dims, found.sizes["cell"], found.sizes["gap"]
    (('time', 'cell'), 5, 4)
    """
    choice("component", component, COMPONENTS)
    time, positions = _motion(trajectory)
    cells = cells_of(positions, cell, along)
    moved = trajectory["displacement"].transpose("time", "node", "axis").values
    speed = trajectory["velocity"].transpose("time", "node", "axis").values
    motion, rest = cells.motion, positions[cells.nodes]
    axial = (moved[:, cells.nodes] @ motion.unit).mean(axis=2)
    if component == "rotation":
        values, rates = _rotation(motion, rest, moved[:, cells.nodes], speed[:, cells.nodes])
    else:
        k = AXES.index(component)
        values = cells.turned(moved)[..., k].mean(axis=2)
        rates = cells.turned(speed)[..., k].mean(axis=2)
    unit = "rad" if component == "rotation" else "m"
    number = np.arange(len(cells.nodes))
    variables: dict[str, Any] = {
        "displacement": (("time", "cell"), values, {"units": unit}),
        "velocity": (("time", "cell"), rates, {"units": f"{unit}/s"}),
    }
    if motion.shift:
        strain = np.diff(axial, axis=1) / motion.shift
        variables["strain"] = (("time", "gap"), strain, {"units": "1"})
    coordinates = {
        "time": ("time", time, {"units": "s"}),
        "cell": number,
        "position": ("cell", number * motion.shift, {"units": "m"}),
        "between": ("gap", number[:-1] + 0.5),
    }
    attributes = {"kind": "space_time", "component": component, "shift": motion.shift}
    return xarray.Dataset(variables, coordinates, attributes)


def wave_spectrum(
    trajectory: xarray.Dataset,
    cell: UnitCell,
    *,
    component: str | None = None,
    along: int = 0,
    window: Window = "hann",
) -> xarray.Dataset:
    """Two-dimensional spectrum of a motion; the waves of small motions lie on the bands.

    Parameters
    ----------
    trajectory : xarray.Dataset
        Motion of a chain or sheet made of copies of the cell.
    cell : UnitCell
    component : {"x", "y", "z"}, optional
        Velocity component, as in `space_time`; by default all three.
    along : int
        Number of the cell's motion along the chain.
    window : str, tuple, array_like, or None
        See `signals.wavenumber_spectrum`.

    Returns
    -------
    xarray.Dataset
        `amplitude` (phase, frequency), m/s: square root of the sum of squared velocity amplitudes
        of all nodes of a cell. Coordinates `phase` (rad per cell; positive for waves that travel to
        higher cells) and `frequency` (Hz). Attributes `phase_step` and `frequency_step`: steps of
        these coordinates.

    Raises
    ------
    InputError
        Not a motion, or not of such cells; times that are not evenly spaced.
    """
    if component is not None:
        choice("component", component, AXES)
    time, positions = _motion(trajectory)
    cells = cells_of(positions, cell, along)
    velocity = cells.turned(trajectory["velocity"].transpose("time", "node", "axis").values)
    if component is not None:
        velocity = velocity[..., AXES.index(component)]
    found = wavenumber_spectrum(velocity, sampling_interval(time), window=window)
    return xarray.Dataset(
        {"amplitude": (("phase", "frequency"), found.amplitude, {"units": "m/s"})},
        {
            "phase": ("phase", found.phase, {"units": "rad"}),
            "frequency": ("frequency", found.frequency, {"units": "Hz"}),
        },
        {
            "kind": "wave_spectrum",
            "phase_step": float(found.phase[1] - found.phase[0]),
            "frequency_step": float(found.frequency[1]),
        },
    )


def transmission(response: xarray.Dataset, cell: UnitCell, *, along: int = 0) -> xarray.Dataset:
    """Transmission of a vibration along a chain, from its frequency response.

    Parameters
    ----------
    response : xarray.Dataset
        From `frf`: to forces, or to a moving base.
    cell : UnitCell
    along : int
        Number of the cell's motion that leads along the chain, away from the drive.

    Returns
    -------
    xarray.Dataset
        Dimensions frequency and cell: `amplitude`, the root mean square response over the nodes of
        a cell (in its unit); `ratio` (frequency), the amplitude of the last cell divided by that of
        the first; and `decay` (frequency), nepers per cell, the slope of the logarithmic amplitude
        along the cells (median for all pairs of cells). A fifth of the cells at each end, and
        amplitudes at round-off, are left out. In a gap, `decay` is the imaginary phase of the
        slowest-decaying wave that the drive excites; in a band it is near zero.

    Raises
    ------
    InputError
        Not a frequency response, or not of a chain of such cells.
    """
    from scipy.stats import theilslopes

    name = quantity_of(response)
    positions = check_variable(response, "rest_position", ("node", "axis")).values
    cells = cells_of(positions, cell, along)
    values = response[name].transpose("frequency", "node", "axis").values
    size = np.linalg.norm(values[:, cells.nodes], axis=3)
    amplitude = np.sqrt(np.mean(size**2, axis=2))
    decay = np.full(len(amplitude), np.nan)
    count = amplitude.shape[1]
    inner = np.arange(count)[int(ENDS * count) : count - int(ENDS * count)]
    for k, row in enumerate(amplitude):
        seen = inner[row[inner] > FLOOR * row.max()]
        seen = seen if len(seen) >= FEWEST else np.flatnonzero(row > FLOOR * row.max())
        if len(seen) >= FEWEST:
            decay[k] = -theilslopes(np.log(row[seen]), seen)[0]
    units = response[name].attrs.get("units", "1")
    with np.errstate(invalid="ignore"):
        ratio = amplitude[:, -1] / amplitude[:, 0]
    return xarray.Dataset(
        {
            "amplitude": (("frequency", "cell"), amplitude, {"units": units}),
            "ratio": ("frequency", ratio, {"units": "1"}),
            "decay": ("frequency", decay, {"units": "Np"}),
        },
        {
            "frequency": ("frequency", response["frequency"].values, {"units": "Hz"}),
            "cell": np.arange(count),
        },
        {"kind": "transmission", "response": name},
    )


def _motion(trajectory: Any) -> tuple[NDArray, NDArray]:
    """Times (s) and rest positions (m) of a motion."""
    for name in ("displacement", "velocity"):
        if name not in getattr(trajectory, "data_vars", ()) or "time" not in trajectory.dims:
            raise InputError(f": has no {name} over time; give a motion", "trajectory")
    positions = check_variable(trajectory, "rest_position", ("node", "axis")).values
    return trajectory["time"].values, positions


def _rotation(
    motion: Screw, rest: NDArray, moved: NDArray, speed: NDArray
) -> tuple[NDArray, NDArray]:
    """Mean rotation (times, n), rad, of nodes (n, m, 3) about a screw's axis, and its rate."""
    if not motion.turns:
        raise InputError(
            ' = "rotation": the cell repeats under a translation, without an axis; take x, y or z',
            "component",
        )
    unit = motion.unit
    first = rest - np.array(motion.point)
    arm = first + moved
    radial, start = (each - (each @ unit)[..., None] * unit for each in (arm, first))
    if np.linalg.norm(start, axis=-1).min() == 0.0:
        raise InputError(' = "rotation": a node lies on the axis; take x, y or z', "component")
    across = np.cross(np.broadcast_to(start, radial.shape), radial) @ unit
    angle = np.unwrap(np.arctan2(across, (start * radial).sum(axis=-1)), axis=0)
    rate = (np.cross(radial, speed) @ unit) / (radial**2).sum(axis=-1)
    return angle.mean(axis=2), rate.mean(axis=2)
