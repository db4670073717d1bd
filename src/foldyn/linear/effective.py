"""`effective`: repeated sheets as plates, chains and tubes as beams, and solids.

The strain energy of a cell under mean strains e, relaxed, is 1/2 e . C e per area or length. For a
plate e = (E_xx, E_yy, 2 E_xy, k_xx, k_yy, 2 k_xy), with the curvature k = -grad grad w about the
plane through the center of mass, and C = [[A, B], [B', D]]. For a beam e is its stretch, its twist
and its curvatures about two axes across it (rad/m). Bending a screw chain is a wave whose phase is
the angle of the screw, in axes that turn with the cells: it couples with stretch and twist only if
this angle vanishes, and is the same about all axes unless it is half a turn. For a solid e holds
the six mean strains, and the energy is that per volume.

M. Schenk, S. D. Guest, Proc. Natl. Acad. Sci. 110, 2013; Z. Y. Wei, Z. V. Guo, L. Dudte,
H. Y. Liang, L. Mahadevan, Phys. Rev. Lett. 110, 2013.

Under mean strains all cells deform alike, but for a rigid motion of each: with w and t linear in R,
the power of exp(w, a + t) that takes cell 0 to cell R moves its points x by

    w x (x - a) + t + w x a / 2,

a the shift of the cell. The mean curvature of a plate turns cell R by w = n x (kappa a), a beam by
R times its twist and curvature per cell. Only the elements of one cell count for the energy, and
its second derivative is exact: internal forces in the state do work in terms of second order.
"""

from __future__ import annotations

import time
from collections.abc import Callable
from dataclasses import replace
from typing import Any, NamedTuple

import numpy as np
import xarray
from numpy.typing import NDArray
from scipy import sparse

from foldyn.algebra.superlu import SingularTangentError, unsymmetric
from foldyn.cases import State
from foldyn.errors import InputError, ModelRangeWarning, quietly, warn
from foldyn.linear import moduli
from foldyn.linear.linearized import amplitude_of, slope_change
from foldyn.linear.linearized_cell import LinearizedCell, linearize_cell
from foldyn.linear.model_error import DOUBTFUL, LINEAR, beside
from foldyn.linear.unit_cell import UnitCell
from foldyn.linear.wave_solver import WaveSolver
from foldyn.results.dataset import result_dataset
from foldyn.strength.resultants import for_stresses
from foldyn.values import of_kind

STRAINS = ("xx", "yy", "xy")
BEAM = ("stretch", "twist", "bend_1", "bend_2")
SOLID = ("xx", "yy", "zz", "yz", "xz", "xy")
SAME = 1e-9  # sine of a screw's angle below which it counts as zero
STRAINED = 1e-6  # mean strains below this, by which a state would relax, are round-off
LEFT = 1e-6  # largest force that relaxing leaves, relative to the forces of the mean strains,
ROUNDING = 1e-12  # and, of a unit strain, to the stiffest dof
LEAST, NONE = 0.01, 3e-5  # smallest entries, and roots of stiffness, that are compared


def effective(
    cell: UnitCell,
    state: State | None = None,
    *,
    secant: float | None = None,
    load_factor: float = 1.0,
    check_model: bool = True,
) -> xarray.Dataset:
    """Stiffness of the plate, beam or solid that is equivalent to a repeated sheet.

    Creases and panels of a cell are relaxed under each mean strain and curvature. Poisson's ratios
    and moduli of stretching are those of a sheet that stays flat, those of bending of one without
    mean forces: neither depends on the reference plane.

    Parameters
    ----------
    cell : UnitCell
        Cell under two translations (a sheet), under one translation or screw (a chain or tube), or
        under three translations (a solid), without supports.
    state : State, optional
        Equilibrium of the repeated sheet, as `fd.linear.relaxed` finds it; by default rest.
    secant, load_factor : float
        As in `bands`.
    check_model : bool
        Whether to compare bars and hinges at rest with superelements, where that takes a few
        seconds at most once the panels are condensed.

    Returns
    -------
    xarray.Dataset
        Of a sheet, along its axes x and y, the first two rows of `frame` (3, 3), which are those of
        space for a sheet in its xy plane: `membrane` A (N/m), `coupling` B (N) and `bending` D
        (N m), (load, strain) in the order xx, yy, xy, with N = A e + B k and M = B' e + D k, shear
        and twist counted twice; `modulus` and `bending_modulus` (direction): N/m and N m per strain
        or curvature along x and y, the other free; `poissons_ratio` and `bending_poissons_ratio`
        (direction): minus the strain (curvature) across, divided by that along x, and along y;
        `shear_modulus` (N/m) and `twisting_modulus` (N m); `modulus_along` and
        `bending_modulus_along` (angle): moduli along directions at angles (degrees) from x;
        `density` (kg/m2, if the sheet has one); `center` (m), a point of the reference plane.
        Of a chain: `stiffness` (load, strain) in the order stretch, twist, bend_1, bend_2: forces
        (N) and moments (N m) per stretch and per turn (rad/m) about the rows of `frame`: the axis,
        and two axes across it; `axial_stiffness` EA (N), `torsional_stiffness` GJ (N m2) with the
        other strains held, `stretch_twist` (N m); `bending_stiffness` EI (axis, N m2), the lesser
        and the greater, about axes through the neutral point; `density` (kg/m).
        Of a solid: `stiffness` (load, strain), Pa, in the order xx, yy, zz, yz, xz, xy, shear
        counted twice, along the axes of space; `modulus` (direction) and `shear_modulus` (plane),
        Pa; `poissons_ratio` (pair): of "xy", minus the strain along y divided by that along x,
        under a stress along x; `density` (kg/m3). Of all `mean_load`, forces, moments or stresses
        in the state, whether that is `stable`, and its variables as in `bands`. Of bars and hinges
        at rest `model_error` (row, column): relative errors of the stiffness C, of a sheet
        [[A, B], [B', D]] with strains and curvatures as rows, by comparison with superelements; nan
        for entries C_ij of less than 1 % of sqrt(C_ii C_jj).

    Raises
    ------
    InputError
        Supports, rigid panels; a screw beside a vector, or without a shift; parts of the cell that
        move without any force.

    Warns
    -----
    FoldynWarning
        The state is unstable, is no equilibrium, or has mean forces; a mean strain costs no energy,
        so that moduli are 0 and Poisson's ratios its own, or nan if there are two.
    ModelRangeWarning
        Entries of the stiffness of bars and hinges are more than 5 % off.

    Examples
    --------
    >>> import foldyn as fd
    >>> pattern = fd.patterns.miura(a=0.03, b=0.03, panel_angle=60, dihedral=100)
    >>> sheet = fd.Sheet(youngs_modulus=1e9, poissons_ratio=0.3, thickness=1e-3)
    >>> cell = fd.UnitCell(fd.Case(fd.discretize(pattern, sheet, crease_stiffness=0.1)))
    >>> found = fd.effective(cell)
    >>> bool(found.poissons_ratio[0] < 0.0 < found.bending_poissons_ratio[0])
    True
    """
    began = time.perf_counter()
    case = for_stresses(of_kind("cell", cell, UnitCell).case)
    structure = case.structure
    if case.supports or getattr(structure.options, "clamped", ()):
        raise InputError(": has supports or clamped edges, and a free material has none", "cell")
    weighed = structure.sheet.density is not None
    if not weighed:
        case = replace(case, structure=structure.altered(sheet=structure.sheet.weighed))
    compared = beside(case, check_model, state, secant, stiffness=True)
    linear = linearize_cell(cell.with_case(case), state, secant, load_factor)
    if not linear.bloch.ties.empty:
        raise InputError(
            ": has rigid panels, whose sheet can have an infinite stiffness; take panels much "
            "stiffer than the creases",
            "cell",
        )
    energy = CellEnergy(linear, amplitude_of(secant))
    kind = KINDS[cell.dimensions]
    frame, size = kind.frame(linear)
    whole, loads = kind.stiffness(linear, energy, frame)
    matrix = whole / size
    stable = _warn_of(linear, kind, matrix, loads / size)
    found = kind.properties(matrix, loads / size) | {"stable": ((), stable, {})}
    along = kind.coordinates | {"strain": kind.coordinates["load"]}
    if compared.case is not None:
        with quietly():
            other = linearize_cell(cell.with_case(for_stresses(compared.case)), None, None, 1.0)
            true = kind.stiffness(other, CellEnergy(other, None), frame)[0] / size
        error = _errors(linear, kind, matrix, true)
        found["model_error"] = ("row", "column"), error, {"units": "1"}
        along |= {"row": kind.names, "column": kind.names}
    if weighed:
        found["density"] = (), energy.mass.sum() / size, {"units": kind.density}
    found["center"] = "axis", energy.center, {"units": "m"}
    found["frame"] = ("own_axis", "axis"), frame, {"units": "1"}
    facts = {"residual": linear.residual, "not_compared": compared.why}
    facts["wall_seconds"] = time.perf_counter() - began
    return result_dataset("effective", cell.case, found | linear.variables, along, facts)


# ---------------------------------------------------------------------- mean strains of a cell
def _plate_frame(linear: LinearizedCell) -> tuple[NDArray, float]:
    """Axes x, y and normal (3, 3) of a sheet, and the area (m2) of a cell."""
    if any(motion.turns for motion in linear.motions):
        raise InputError(
            ": turns from cell to cell along one of two motions, as a bent sheet does; a plate has "
            "two translations, and a tube one motion: take a ring of cells as the cell",
            "cell",
        )
    across = np.cross(*linear.vectors)
    area = float(np.linalg.norm(across))
    normal = across / area * np.sign(across[np.abs(across).argmax()])
    first = np.eye(3)[0 if abs(normal[0]) < 0.9 else 1]
    x = first - (first @ normal) * normal
    x /= np.linalg.norm(x)
    return np.array([x, np.cross(normal, x), normal]), area


def _beam_frame(linear: LinearizedCell) -> tuple[NDArray, float]:
    """Axis of a chain and two axes across it (3, 3), and the length (m) of a cell."""
    (shift,) = linear.vectors
    length = float(np.linalg.norm(shift))
    if length == 0.0:
        raise InputError(": repeats about an axis without a shift; a ring is no beam", "cell")
    axis = shift / length
    one = np.cross(axis, np.eye(3)[np.abs(axis).argmin()])
    one /= np.linalg.norm(one)
    return np.array([axis, one, np.cross(axis, one)]), length


def _strains(linear: LinearizedCell, turn: NDArray, move: NDArray, center: NDArray) -> MeanStrains:
    """Mean strains from turns and moves (d, p, 3) per cell along each motion, about a center."""
    steps = linear.reach.steps
    turn, move = (np.tensordot(steps, each, 1) for each in (turn, move))
    return MeanStrains(turn, move - np.cross(turn, center), steps @ linear.vectors)


def _plate(linear: LinearizedCell, energy: CellEnergy, frame: NDArray) -> tuple[NDArray, NDArray]:
    """Stiffness (6, 6) and loads (6,), J, of a cell under membrane strains and curvatures."""
    x, y, normal = frame
    tensors = [np.outer(x, x), np.outer(y, y), 0.5 * (np.outer(x, y) + np.outer(y, x))]
    stretched = np.stack([linear.vectors @ each for each in tensors], axis=1)
    turned, none = np.cross(normal, stretched), np.zeros_like(stretched)
    turn, move = np.hstack([none, turned]), np.hstack([stretched, none])
    strains = _strains(linear, turn, move, energy.center)
    still = energy.rigid(np.zeros((3, 3)), np.eye(3))
    return energy.stiffness(strains, np.zeros(2), still), energy.loads(strains)


def _beam(linear: LinearizedCell, energy: CellEnergy, frame: NDArray) -> tuple[NDArray, NDArray]:
    """Stiffness (4, 4) and loads (4,), J m, of a cell under stretch, twist and two curvatures."""
    (motion,), (shift,), axis = linear.motions, linear.vectors, frame[0]
    center = np.array(motion.point) if motion.turns else energy.center
    length, none, each = float(shift @ axis), np.zeros(3), np.eye(4)
    turn = length * np.array([[none, *frame]])
    strains = _strains(linear, turn, length * np.array([[axis, none, none, none]]), center)
    angle = np.radians(motion.angle) * (motion.unit @ axis)
    still = energy.rigid(np.array([none, axis]), np.array([axis, np.cross(center, axis)]))
    sideways = energy.rigid(np.zeros((2, 3)), frame[1:])
    straight, bends = (each[:, :2], 0.0, still), each[:, 2:]
    if abs(np.sin(angle)) > SAME:
        wave = np.array([[1.0], [1.0j]])
        parts = [straight, (bends @ wave, angle, sideways @ wave)]
    elif np.cos(angle) < 0.0:
        parts = [straight, (bends, np.pi, sideways)]
    else:
        parts = [(each, 0.0, np.hstack([still, sideways]))]
    out = np.zeros((4, 4))
    for ways, phase, fixed in parts:
        own = energy.stiffness(strains @ ways, np.array([phase]), fixed)
        mean = 0.5 if np.iscomplexobj(ways) else 1.0  # of the square of a wave along the beam
        out += mean * np.real(ways @ own @ ways.conj().T)
    loads = energy.loads(strains)
    if len(parts) > 1:  # moments across the beam turn with the screw
        loads[2:] = 0.0
    return out, loads


def _solid_frame(linear: LinearizedCell) -> tuple[NDArray, float]:
    """Axes of space (3, 3), and the volume (m3) of a cell."""
    return np.eye(3), abs(float(np.linalg.det(linear.vectors)))


def _solid(linear: LinearizedCell, energy: CellEnergy, frame: NDArray) -> tuple[NDArray, NDArray]:
    """Stiffness (6, 6) and loads (6,), J, of a cell under strains."""
    tensors = np.zeros((6, 3, 3))
    for k, (i, j) in enumerate([(0, 0), (1, 1), (2, 2), (1, 2), (0, 2), (0, 1)]):
        tensors[k, i, j] += 0.5
        tensors[k, j, i] += 0.5
    move = np.einsum("di,kij->dkj", linear.vectors, tensors)
    strains = _strains(linear, np.zeros_like(move), move, energy.center)
    still = energy.rigid(np.zeros((3, 3)), np.eye(3))
    return energy.stiffness(strains, np.zeros(3), still), energy.loads(strains)


def _warn_of(linear: LinearizedCell, kind: Equivalent, matrix: NDArray, loads: NDArray) -> bool:
    """Whether the state is stable; warn if not, of strains without stiffness, of mean forces."""
    names, (unit, scale) = kind.names, _scale(linear, kind, matrix)
    values, ways = np.linalg.eigh(matrix / np.outer(scale, scale))
    lowest = WaveSolver(linear.bloch, 1).waves(np.zeros(len(linear.motions))).values[0]
    stable = bool(lowest >= 0.0 and values[0] >= -moduli.SOFT * values[-1])
    if not stable:
        warn(
            "the state is unstable: the cell moves away from it by itself, and the stiffness is "
            "that of small motions about it; give a stable state",
            "effective.md#states",
        )
    soft = np.abs(values) <= moduli.SOFT * values[-1]
    if soft.any():
        share = np.abs(ways[:, soft]).max(axis=1)
        of = ", ".join(name for name, own in zip(names, share, strict=True) if own > 0.1)
        warn(
            f"a mean strain costs no energy: one of {of}, or a combination. Moduli along it are "
            "0, and Poisson's ratios its own; give creases a stiffness if they have one",
            "effective.md#how",
        )
    firm = ways[:, ~soft]
    back = unit / scale * (firm @ (firm.T @ (loads / scale) / values[~soft]))
    worst = int(np.abs(back).argmax())
    if abs(back[worst]) > STRAINED:
        warn(
            f"the state has mean forces or moments: let go, it would change by {back[worst]:.2g} "
            f"({names[worst]}; curvature times the pattern's size). The stiffness is that under "
            "these loads",
            "effective.md#states",
        )
    return stable


def _scale(linear: LinearizedCell, kind: Equivalent, matrix: NDArray) -> tuple[NDArray, NDArray]:
    """Units (n,) of strains, and with them roots of the stiffness of the stiffest (n,)."""
    size = linear.cell.case.structure.pattern.size
    unit = np.where(np.arange(len(kind.names)) < kind.straight, 1.0, size)  # curvatures, twists
    stiff = np.abs(np.diag(matrix)) / unit**2
    stiffest = stiff.reshape(2, 3).max(axis=1).repeat(3) if kind.straight == 3 else stiff.max()
    return unit, unit * np.sqrt(stiffest)


def _errors(linear: LinearizedCell, kind: Equivalent, own: NDArray, true: NDArray) -> NDArray:
    """Relative errors (n, n) of a stiffness, beside that of superelements; warns of large ones."""
    root, scale = np.sqrt(np.diag(true).clip(min=0.0)), _scale(linear, kind, true)[1]
    root[root < NONE * scale] = np.inf
    counts = np.abs(true) > LEAST * np.outer(root, root)
    error = np.divide(own, true, out=np.full_like(own, np.nan), where=counts) - 1.0
    worst = np.unravel_index(np.abs(np.nan_to_num(error)).argmax(), error.shape)
    if abs(error[worst]) > DOUBTFUL:
        warn(
            f"entry ({', '.join(kind.names[k] for k in worst)}) of the stiffness is "
            f"{own[worst]:.4g}, and {true[worst]:.4g} with superelements ({error[worst]:+.0%}): "
            f"{LINEAR}",
            "effective.md#bars-and-hinges-beside-superelements",
            ModelRangeWarning,
        )
    return error


# ---------------------------------------------------------------------- kinds
class Equivalent(NamedTuple):
    """An equivalent plate, beam or solid.

    Attributes
    ----------
    names : of its mean strains, of which the first `straight` have no unit.
    density : unit
    """

    frame: Callable[[LinearizedCell], tuple[NDArray, float]]
    stiffness: Callable[[LinearizedCell, CellEnergy, NDArray], tuple[NDArray, NDArray]]
    properties: Callable[[NDArray, NDArray], dict[str, Any]]
    names: list[str]
    straight: int
    density: str
    coordinates: dict[str, Any]


KINDS = {
    1: Equivalent(
        _beam_frame, _beam, moduli.of_beam, list(BEAM), 1, "kg/m",
        {"load": list(BEAM), "bend": ["least", "greatest"]},
    ),
    2: Equivalent(
        _plate_frame, _plate, moduli.of_plate,
        [f"{of} {name}" for of in ("strain", "curvature") for name in STRAINS], 3, "kg/m2",
        {
            "load": list(STRAINS), "direction": ["x", "y"],
            "angle": ("angle", moduli.ANGLES, {"units": "degrees"}),
        },
    ),
    3: Equivalent(
        _solid_frame, _solid, moduli.of_solid, [f"strain {name}" for name in SOLID], 6, "kg/m3",
        {
            "load": list(SOLID), "direction": ["x", "y", "z"], "plane": list(SOLID[3:]),
            "pair": ["".join("xyz"[k] for k in pair) for pair in moduli.PAIRS],
        },
    ),
}  # fmt: skip
"""What is equivalent to a sheet, by the number of its periods."""


class MeanStrains(NamedTuple):
    """Rigid motions of s cells per unit of p mean strains.

    Attributes
    ----------
    turn, move : (s, p, 3)
        w (rad) and t (m).
    shift : (s, 3)
        a, m.
    """

    turn: NDArray
    move: NDArray
    shift: NDArray

    def __matmul__(self, combined: NDArray) -> MeanStrains:
        """Rigid motions of combinations (p, c) of the strains."""
        turn, move = (np.einsum("spx,pc->scx", each, combined) for each in (self.turn, self.move))
        return MeanStrains(turn, move, self.shift)

    def at(self, number: NDArray, points: NDArray) -> NDArray:
        """Displacements (n, p, 3) of points (n, 3), m, of the cells with these numbers (n,)."""
        turn, shift = self.turn[number], self.shift[number][:, None]
        return np.cross(turn, points[:, None] - 0.5 * shift) + self.move[number]

    def second(self, number: NDArray, points: NDArray, force: NDArray) -> NDArray:
        """Work (p, p), J, of forces (n, 3) in second derivatives of the displacements."""
        turn, move, shift = self.turn[number], self.move[number], self.shift[number][:, None]
        moved = np.cross(turn, points[:, None] - shift * 2.0 / 3.0) + move
        # f . w x v = (f x w) . v
        total = np.einsum("npx,ncx->pc", np.cross(force[:, None], turn.conj()), moved)
        return 0.5 * (total + total.conj().T)


class CellEnergy:
    """The energy of one cell's elements, to second order in its dofs and in mean strains.

    Attributes
    ----------
    points : (n, 3)
        Nodes of the patch in the state, m.
    mass : (k,)
        Masses of the nodes of a cell, kg.
    center : (3,)
        Their center, m.

    Parameters
    ----------
    linear : LinearizedCell
    amplitude : float or None
        Amplitude (rad) of superlinear hinges that `linear` has.
    """

    def __init__(self, linear: LinearizedCell, amplitude: float | None) -> None:
        reach, size = linear.reach, 3 * len(linear.patch.unit)
        self._reach, self._bloch, self._number = reach, linear.bloch, reach.number
        body = reach.body.anchored(reach.number - np.flatnonzero((reach.steps == 0).all(axis=1)))
        change, _ = slope_change(linear.patch.case, body, linear.dofs, amplitude)
        tangent = body.tangent(linear.dofs)
        self._tangent = tangent if change is None else sparse.csr_array(tangent + change)
        self._force = body.internal(linear.dofs)[:size].reshape(-1, 3)
        self.points = linear.patch.case.structure.nodes + linear.dofs[:size].reshape(-1, 3)
        self._cell = reach.number[:size:3]
        own = linear.patch.own_nodes
        self.mass = linear.patch.case.mass[own].sum(axis=1)
        self.center = self.mass @ self.points[own] / self.mass.sum()
        self._weight = np.zeros((reach.count, 1))
        self._weight[: 3 * len(own), 0] = np.repeat(self.mass / self.mass.sum(), 3)

    def displacements(self, strains: MeanStrains) -> NDArray:
        """Displacements (k, p) of all dofs of the patch that move with the cells alone."""
        hidden = self._number[self.points.size :]
        rotated = self._reach.body.sheet.rotated
        if rotated is None:
            rotated = np.zeros((len(hidden), 3))
        behind = np.einsum("hx,hpx->hp", rotated, strains.turn[hidden])
        return np.concatenate([by_dof(strains.at(self._cell, self.points)), behind])

    def rigid(self, turn: NDArray, move: NDArray) -> NDArray:
        """Motions (m, r) of cell 0 with rotations (r, 3), rad, and displacements at the origin."""
        cells = len(self._reach.steps)
        turn, move = (np.broadcast_to(each, (cells, *each.shape)) for each in (turn, move))
        return self.displacements(MeanStrains(turn, move, np.zeros((cells, 3))))[self._reach.rows]

    def loads(self, strains: MeanStrains) -> NDArray[np.float64]:
        """Derivatives (p,) of the energy in the state, J, by mean strains."""
        return np.einsum("nx,npx->p", self._force, strains.at(self._cell, self.points))

    def stiffness(self, strains: MeanStrains, phase: NDArray, rigid: NDArray) -> NDArray:
        """Second derivatives (p, p), J, by mean strains under which the cell is relaxed.

        phase : phases (d,) of the displacements from cell to cell, in the axes of these.
        rigid : motions (m, r) of cell 0 that have these phases and strain nothing.
        """
        factors = self._bloch.factors(phase)
        copies = self._reach.copies(factors if phase.any() else factors.real)
        field = self.displacements(strains)
        pull = self._tangent @ field
        turned = pull.copy()  # with the forces in the state, which turn with the cells
        change = np.cross(self._force[:, None], strains.turn[self._cell])
        turned[: self.points.size] += by_dof(change)
        push = copies.conj().T @ turned
        inner = sparse.csc_array(copies.conj().T @ self._tangent @ copies)
        eased = _solved(inner, push, self._weight * rigid)
        second = strains.second(self._cell, self.points, self._force)
        whole = field.conj().T @ pull + second + push.conj().T @ eased
        return 0.5 * (whole + whole.conj().T)


def by_dof(vectors: NDArray) -> NDArray:
    """Vectors (n, p, 3) as columns (3n, p)."""
    return vectors.transpose(0, 2, 1).reshape(-1, vectors.shape[1])


def _solved(matrix: sparse.csc_array, push: NDArray, rigid: NDArray) -> NDArray:
    """Displacements (m, p) that balance -push, with the means `rigid`' u = 0 (m, r)."""
    scale, count = float(abs(matrix.diagonal()).max()), rigid.shape[1]
    border = sparse.csc_array(scale * rigid)
    whole = sparse.csc_array(sparse.block_array([[matrix, border], [border.conj().T, None]]))
    load = -np.concatenate([push, np.zeros((count, push.shape[1]))]).astype(whole.dtype)
    try:
        found = unsymmetric(whole).solve(load)
    except SingularTangentError:
        found = np.full_like(load, np.nan)
    left = np.abs(whole @ found - load).max(axis=0)
    if not (left <= LEFT * np.abs(load).max(axis=0) + ROUNDING * scale).all():
        raise InputError(
            ": parts of it can move without any force, as bends of the superlinear law can at "
            "rest, so that its stiffness is not defined; give creases and bends a stiffness, or "
            "superlinear ones a secant amplitude",
            "cell",
        )
    return found[: len(push)]
