"""A chain of Kresling cells between plates: bands, the two-dof unit, and an impact.

The unit of the literature has two degrees of freedom, the elongation u and the twist phi of a cell
between rigid plates (Yasuda et al., Sci. Adv. 5, eaau2835, 2019). Here the plates are the rings of
a tower: three corners of each ring carry the others (`Link`), stiff springs keep them apart, and
links along the axis keep them level, as the guide of a test rig does.

The paper's dimensions, masses and stiffnesses were not available. The values of `Unit` are ours: a
soft cell that softens in compression and stiffens in tension, like the paper's.
"""

from __future__ import annotations

import warnings
from collections.abc import Iterable
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
import xarray
from numpy.typing import NDArray
from scipy.linalg import eigh

from foldyn.cases import Case, Link, PointMass, Spring, State
from foldyn.dynamics import critical_step, simulate
from foldyn.errors import StretchWarning
from foldyn.linear import LongWaves, UnitCell, bands, long_waves, space_time
from foldyn.patterns import kresling
from foldyn.signals import Pulse, pulse
from foldyn.structures import Sheet, Structure, discretize

SIDES = 6
SUBSTEPS = 4  # time steps per critical step, because cells stiffen in tension
SAMPLES = 1e-3  # s, between samples of a motion
UNTIL = 0.8  # share of a chain that is evaluated, because the end reflects waves
SHARE = 0.85  # smallest peak that counts, relative to the cell's largest strain


@dataclass(frozen=True)
class Unit:
    """A Kresling cell with its plate.

    Attributes
    ----------
    radius, height : float
        Radius of a ring, height of a cell (m).
    twist : float
        Twist of a cell (degrees).
    youngs_modulus, thickness, density : float
        Properties of the sheet (N/m2, m, kg/m3).
    crease : float
        Stiffness per length (N) of mountain creases: the sides and the rings; diagonals have none.
    plate_mass : float
        Mass of a plate (kg), which is placed at the corners of its ring.
    plate_stiffness : float
        Stiffness of the springs between three corners (N/m).
    """

    radius: float = 0.05
    height: float = 0.04
    twist: float = 45.0
    youngs_modulus: float = 1.25e6
    thickness: float = 1e-3
    density: float = 140.0
    crease: float = 0.01
    plate_mass: float = 0.02
    plate_stiffness: float = 3e4

    def structure(self, cells: int) -> Structure:
        """Bars and hinges of a tower of cells."""
        pattern = kresling(SIDES, self.radius, height=self.height, twist=self.twist, storeys=cells)
        sheet = Sheet(self.youngs_modulus, 0.3, self.thickness, self.density)
        creases: Any = {"mountain": self.crease, "valley": 0.0} if self.crease else 0.0
        return discretize(
            pattern,
            sheet,
            mass="panel",
            bar_law="linear",
            fold_law="linear",
            calibration="standard",
            membrane="bars",
            crease_stiffness=creases,
        )

    def case(self, structure: Structure, rings: Iterable[int]) -> Case:
        """A case of a tower with plates at some rings."""
        supports: list[Any] = []
        for r in rings:
            a, b, c, d, e, f = range(SIDES * r, SIDES * (r + 1))
            supports += [
                Link([b, d, f], to=(a, c, e)),
                Link([a, c, e], axes="z"),
                Spring(self.plate_stiffness, between=[(a, c), (c, e), (e, a)]),
            ]
        nodes = [node for r in rings for node in range(SIDES * r, SIDES * (r + 1))]
        return Case(structure, supports, masses=[PointMass(nodes, self.plate_mass / SIDES)])

    def chain(self, cells: int) -> Case:
        """A chain with a plate at each end of each cell."""
        return self.case(self.structure(cells), range(cells + 1))

    @property
    def cell(self) -> UnitCell:
        """Unit cell of the chain; settings of its lower ring also apply to its upper ring."""
        return UnitCell(self.case(self.structure(1), [0]))

    @property
    def two_dofs(self) -> LongWaves:
        """Matrices of a cell for elongation and twist of rigid plates: static stiffness, and mass.

        The lower plate is fixed while the upper plate moves. Creases at the plates, between two
        cells, do not contribute.
        """
        structure = self.structure(1)
        x, y, _ = structure.nodes.T
        motions = np.zeros((2, *structure.nodes.shape))
        motions[0, :, 2] = 1.0
        motions[1, :, 0], motions[1, :, 1] = -y, x
        upper = motions.copy()
        upper[:, :SIDES] = 0.0
        moved = upper.reshape(2, -1)
        stiffness = moved @ (structure.tangent(np.zeros_like(structure.nodes)) @ moved.T)
        plate = np.zeros(len(x))
        plate[:SIDES] = self.plate_mass / SIDES
        mass = structure.mass.toarray() + np.diag(plate)
        inertia = np.einsum("ina,nm,jma->ij", motions, mass, motions)
        return LongWaves((0.0, 0.0, 1.0), stiffness, inertia)


def two_dof_frequencies(unit: LongWaves, phases: NDArray) -> NDArray[np.float64]:
    """omega = 2 |sin(kappa/2)| sqrt(eig(M^-1 K)), in Hz, (n, 2), at phases (n,), rad."""
    values = eigh(unit.stiffness, unit.mass, eigvals_only=True)
    return 2.0 * np.abs(np.sin(0.5 * phases))[:, None] * np.sqrt(values) / (2.0 * np.pi)


def guided(found: xarray.Dataset) -> NDArray[np.float64]:
    """Frequencies (n, 2), Hz, of the bands in which plates move along the axis and rotate about it.

    In other bands plates slide sideways: their corners have a mean motion along x or y.
    """
    shapes = found["shape"].values[:, :, :SIDES]
    sideways = np.abs(shapes.mean(axis=2)[..., :2]).sum(axis=-1)
    size = np.linalg.norm(shapes, axis=(2, 3))
    order = np.argsort(sideways / size, axis=1)[:, :2]
    return np.sort(np.take_along_axis(found["frequency"].values, order, axis=1), axis=1)


def dispersion(unit: Unit, count: int = 41) -> xarray.Dataset:
    """Bands of the chain and of the two-dof unit.

    Variables over phase (0 to pi) and branch, in Hz: `bands` of the chain and `two_dof` of the
    unit; `free` and `free_two_dof`, the same without creases.
    """
    phases = np.linspace(0.0, np.pi, count)
    free = replace(unit, crease=0.0)
    data = {}
    for name, one in (("", unit), ("free_", free)):
        found = bands(one.cell, phases[1:], count=4, shape=True, track=False)
        start = np.zeros((1, 2))
        data[f"{name}bands"] = np.concatenate([start, guided(found)])
        data[f"{name}two_dof"] = two_dof_frequencies(one.two_dofs, phases)
    variables = {key: (("phase", "branch"), each, {"units": "Hz"}) for key, each in data.items()}
    return xarray.Dataset(variables, {"phase": phases, "branch": [1, 2]})


def impact(unit: Unit, cells: int, velocity: float, duration: float) -> xarray.Dataset:
    """Motion of each cell after an initial velocity (m/s) of the free chain's first plate.

    The result has the variables of `space_time`, the rotation of the plates (rad), and energies (J)
    and momentum (kg m/s) over time; attributes are the error of the energy balance and the speeds
    of long waves (cells per s).
    """
    case = unit.chain(cells)
    start = np.zeros_like(case.structure.nodes)
    start[:SIDES, 2] = velocity
    steps = np.ceil(SAMPLES * SUBSTEPS / critical_step(case))
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", StretchWarning)  # the unit of the literature is a truss
        motion = simulate(
            case, duration, method="rk4", dt=SAMPLES / steps, interval=SAMPLES,
            initial=State(velocity=start),
        )  # fmt: skip
    cell = unit.cell
    found = space_time(motion, cell)
    turned = space_time(motion, cell, component="rotation")["displacement"]
    found["rotation"] = (("time", "cell"), turned.values, {"units": "rad"})
    momentum = motion["velocity"].sel(axis="z").values @ np.asarray(case.mass.sum(axis=0)).ravel()
    found["momentum"] = ("time", momentum, {"units": "kg m/s"})
    for name in ("kinetic", "strain_bars", "strain_folds", "strain_springs"):
        found[name] = motion[name]
    found.attrs |= {
        "energy_error": motion.attrs["energy_error"],
        "long_waves": long_waves(cell).speeds,
        "velocity": velocity,
    }
    return found


@dataclass(frozen=True)
class Overtaking:
    """A rarefaction that overtakes a compression.

    Attributes
    ----------
    compression, rarefaction : Pulse
        Pulses of strain in the cells, except those at the end.
    cell : int
        Cell that best divides the chain: before it compression peaks first, from it on tension.
    share : float
        Share of the cells from `cell` on in which tension peaks first.
    before : float
        Largest compression of a cell before its highest tension, relative to that tension; median
        over the last third of the cells.
    """

    compression: Pulse
    rarefaction: Pulse
    cell: int
    share: float
    before: float


def overtaking(found: xarray.Dataset) -> Overtaking:
    """Follow the first high peaks of compression and of tension through the chain."""
    last = int(UNTIL * found.sizes["gap"])
    strain = found["strain"].values[:, :last]
    time = found["time"].values
    pressed, pulled = (pulse(time, strain, sign=sign, share=SHARE) for sign in (-1, 1))
    ahead = pulled.arrival < pressed.arrival
    wrong = [int(ahead[:k].sum() + (~ahead[k:]).sum()) for k in range(last + 1)]
    cell = int(np.argmin(wrong))
    before = [
        -strain[: int(np.searchsorted(time, pulled.arrival[k])) + 1, k].min() / pulled.peak[k]
        for k in range(2 * last // 3, last)
        if np.isfinite(pulled.arrival[k])
    ]
    share = float(ahead[cell:].mean()) if cell < last else 0.0
    return Overtaking(pressed, pulled, cell, share, float(np.median(before)) if before else np.nan)
