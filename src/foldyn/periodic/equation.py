"""Equation of motion of a driven case for its unknowns x, in the phase of its drive.

    M x'' + C x' + f(x, theta) + W^2 s2(theta) + W s1(theta) = 0

theta = 2 pi f t is the phase of the drive, where f is the lowest frequency of the `Harmonic`
histories; all other frequencies are multiples of f. A level scales all varying terms, but not the
constant ones.

f(x, theta) contains the internal forces minus the loads, and W = 2 pi f. s2 and s1 are the effect
of moving supports: M and C times the second and first derivatives of the support motion with
respect to theta. Displacements of all dofs are u = u0 + B x + U(theta); forces on the unknowns are
B' times the forces on all dofs. The last unknowns may have no mass, as edge angles have: without
damping they are in balance at all times.
"""

from __future__ import annotations

import math
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy import sparse
from scipy.linalg import eigh

from foldyn.attractors.drive import check_harmonic, lowest_frequency
from foldyn.cases import Case, Constant, Harmonic, Origin
from foldyn.cases.air import refuse_air
from foldyn.cases.contact_checks import check_contact
from foldyn.cases.releases import refuse_releases
from foldyn.cases.springs import refuse_driven
from foldyn.dynamics.dampers import damping_terms
from foldyn.dynamics.inertia import check_mass
from foldyn.dynamics.modal_damping import mass_of, modal_rows
from foldyn.errors import InputError
from foldyn.mechanics.assembly import Assembly
from foldyn.mechanics.constant_damping import DampingMatrix, DampingRows
from foldyn.mechanics.following import following_force, following_tangent, joined
from foldyn.mechanics.tangent import add_tangent
from foldyn.mechanics.term import Term, nodal
from foldyn.statics.rigid import free_rigid_motions
from foldyn.structures.bars_hinges import BarsHingesTerm

EPS = float(np.finfo(float).eps)
Terms = list[tuple[Any, Any]]


class Tangents:
    """Tangents of a body with respect to the unknowns, or projected on vectors of unknowns.

    Entries are added directly at their positions in the matrix. Terms whose positions are not known
    in advance, such as contact, go through sparse matrices.

    Parameters
    ----------
    body : Assembly
    basis : sparse (m, k)
        Displacements of all dofs per unit of each unknown.
    vectors : ndarray, shape (k, r), optional
        Vectors on which tangents are projected.
    """

    def __init__(
        self, body: Assembly, basis: sparse.csr_array, vectors: NDArray | None = None
    ) -> None:
        self._basis, self._vectors, size = basis, vectors, basis.shape[1]
        sheet, places = body.sheet, {}  # by number of the term; -1 is the sheet
        if isinstance(sheet, BarsHingesTerm):
            ends, indices, *_ = sheet.sparsity
            pattern = sparse.bsr_array((np.ones((len(indices), 3, 3)), indices, ends))
        else:
            pattern = sheet.tangent(np.zeros(sheet.size))
        places[-1] = pattern.tocoo().coords
        for k, term in enumerate(body.others):
            if type(term).tangent is Term.tangent:
                places[k] = term.places
        spread = {k: _spread(basis, *at) for k, at in places.items()}
        self._union = union = np.unique(np.concatenate([place for place, _, _ in spread.values()]))
        self._own = {}
        for k, (place, entry, weight) in spread.items():
            at, shape = np.searchsorted(union, place), (len(union), len(places[k][0]))
            self._own[k] = sparse.csr_array((weight, (at, entry)), shape)
        row, column = np.divmod(self._union, max(size, 1))
        ends = np.searchsorted(row, np.arange(size + 1))
        self._matrix = sparse.csr_array((np.zeros(len(column)), column, ends), (size, size))

    def of(self, body: Assembly) -> Tangents:
        """Tangents of another body with respect to the same unknowns."""
        return Tangents(body, self._basis, self._vectors)

    def put(self, body: Assembly, u: NDArray, out: NDArray) -> None:
        """Write the tangent at displacements u (m,) into `out`."""
        data, sheet, rest = np.zeros(len(self._union)), body.sheet, None
        if isinstance(sheet, BarsHingesTerm):
            entries = np.zeros((len(sheet.sparsity.indices), 3, 3))
            add_tangent(sheet.model, sheet.sparsity, nodal(u), -np.inf, entries)
        else:
            entries = sheet.tangent(u).data
        data += self._own[-1] @ entries.ravel()
        for k, term in enumerate(body.others):
            if k in self._own:
                data += self._own[k] @ term.entries(u)
            else:
                found = term.tangent(u)
                if found.nnz:  # without contact there is no stiffness
                    rest = found if rest is None else rest + found
        if self._vectors is None:
            out[:] = 0.0
            out.reshape(-1)[self._union] = data
            if rest is not None:
                out += (self._basis.T @ rest @ self._basis).toarray()
            return
        self._matrix.data = data
        along = self._matrix @ self._vectors
        if rest is not None:
            along += self._basis.T @ (rest @ (self._basis @ self._vectors))
        out[:] = self._vectors.T @ along


def _spread(
    basis: sparse.csr_array, row: NDArray, column: NDArray
) -> tuple[NDArray, NDArray, NDArray]:
    """Contributions of entries at rows and columns (e,) to a matrix of the k unknowns.

    Returns the place k row + column of each contribution in the matrix, the number of the entry
    that contributes, and the factor on this entry.
    """
    one, other = basis[row], basis[column]
    width = np.diff(other.indptr)
    count = np.diff(one.indptr) * width
    entry = np.repeat(np.arange(len(row)), count)
    turn = np.arange(len(entry)) - np.repeat(np.cumsum(count) - count, count)
    i = one.indptr[entry] + turn // width[entry]
    j = other.indptr[entry] + turn % width[entry]
    place = one.indices[i].astype(np.int64) * basis.shape[1] + other.indices[j]
    return place, entry, one.data[i] * other.data[j]


def check_smooth(case: Case, name: str) -> None:
    """Refuse parts of a case that the analysis `name` cannot treat exactly.

    Raises
    ------
    InputError
        The case has friction or laws with memory, or its model is linear.
    """
    case.check_movable()
    if case.structure.linear:
        raise InputError(
            f"structure: {case.structure.linear} serve linear analyses, and {name} follows large "
            'motions; take preset = "n5b8e", or the shell'
        )
    if case.contact is not None and case.contact.rubs:
        raise InputError(
            f": {name} takes forces that depend on the displacement alone, but friction depends on "
            "how it was reached; give friction = 0.0, or simulate the motion",
            "contact.friction",
        )
    refuse_air(case, name)
    refuse_driven(case, name)
    refuse_releases(case, name)
    if case.remembering:
        raise InputError(
            f"structure: {name} takes forces that depend on the displacement alone, and some "
            "hinges have memory (prony, plastic, damped creases between compliant panels, or "
            "latches); take an elastic law without these, or simulate the motion"
        )


def check_held(case: Case, name: str) -> None:
    """Refuse supports that let the whole sheet drift."""
    nodes, body = case.structure.nodes, case.body
    if free_rigid_motions(nodes, case.constraints, body.holds(np.zeros(body.size))).shape[1]:
        raise InputError(
            f": {name} needs supports that hold the whole in place, or it drifts; fix more nodes",
            "supports",
        )


def check_damping(terms: list[Term], name: str) -> None:
    """Refuse damping whose matrix depends on the displacement."""
    if any(not isinstance(term, DampingMatrix | DampingRows) for term in terms):
        raise InputError(
            f": {name} takes damping with a constant matrix; take Rayleigh or ModalDamping in "
            "place of CreaseDamping and StrainDamping, and dashpots with a direction",
            "damping",
        )


class Drive:
    """Histories of the loads and supports of a case.

    Attributes
    ----------
    frequency : float
        Lowest frequency of the harmonic histories (Hz); 0.0 without any.
    highest : int
        Highest of the harmonic frequencies, as a multiple of the lowest.
    loads, moves, turns, planes : list of (ndarray, Constant or Harmonic)
        Terms at factor 1, each with its history: forces (n, 3), N; displacements (n, 3), m, of
        supports and of nodes tied to them; changes (nr,) of rest angles, rad; displacements (p, 3),
        m, of contact planes.
    """

    def __init__(self, case: Case) -> None:
        self.loads: Terms = list(case.load_terms)
        self.moves: Terms = [*case.imposed_terms, *case.base_terms]
        self.turns: Terms = list(case.rest_terms)
        self.following: Terms = list(case.following_terms)
        apart = zip(np.eye(len(case.obstacle_terms)), case.obstacle_terms, strict=True)
        self.planes: Terms = [(case.planes_moved(one), history) for one, (_, history) in apart]
        every = (*self.loads, *self.moves, *self.turns, *self.planes, *self.following)
        check_harmonic(case, "a periodic motion")
        found = [one.frequency for _, one in every if isinstance(one, Harmonic)]
        self.frequency = lowest_frequency(found)
        self.highest = round(max(found) / self.frequency) if found else 0

    def factors(self, terms: Terms, phase: NDArray, level: float) -> NDArray:
        """Factors of k terms and first two derivatives of the factors (3, s, k), at phases (s,)."""
        out = np.zeros((3, len(phase), len(terms)))
        for k, (_, history) in enumerate(terms):
            if isinstance(history, Constant):
                out[0, :, k] = 1.0
                continue
            order = round(history.frequency / self.frequency)
            angle = order * phase + math.radians(history.phase)
            out[0, :, k] = level * np.sin(angle)
            out[1, :, k] = level * order * np.cos(angle)
            out[2, :, k] = -level * order**2 * np.sin(angle)
        return out

    def sums(self, terms: Terms, phase: NDArray, level: float, size: int) -> NDArray:
        """Sum of terms and first two derivatives of the sum (3, s, size), at phases (s,)."""
        shapes = np.zeros((len(terms), size))
        for shape, (vector, _) in zip(shapes, terms, strict=True):
            shape[: vector.size] = vector.ravel()
        return self.factors(terms, phase, level) @ shapes


class Equation:
    """Matrices and forces in the equation of motion of a case (see the module docstring).

    Parameters
    ----------
    case : Case
    name : str
        Name of the analysis, for messages.
    driven : bool
        False leaves out all varying terms, and the damping.
    origin : Origin, optional
        State about which damping with ``state = "initial"`` is taken; rest by default.

    Attributes
    ----------
    size, heavy : int
        Number k of unknowns, and of those with mass, which come first.
    basis : sparse or dense (m, k)
        The matrix B.
    offset : (m,)
        Displacements u0 (m) with zero unknowns and without drive.
    whole : Equation
        The equation from which this equation is reduced; the equation itself if it is not reduced.
    tangents : Tangents
        Tangents of the body with respect to the unknowns.
    mass, damping : (k, k)
        M (kg) and C (N s/m).
    alpha : float
        The part alpha M of the damping, 1/s.
    """

    def __init__(
        self, case: Case, name: str, driven: bool = True, origin: Origin | None = None
    ) -> None:
        check_smooth(case, name)
        check_held(case, name)
        check_mass(case.mass, case.constraints.determined)
        self.case, self.body, self.drive, self.origin = case, case.body, Drive(case), origin
        self.level = 1.0 if driven else 0.0
        total, self.heavy = self.body.size, len(case.free_dofs)
        self._free = np.concatenate([case.free_dofs, self.body.hidden])
        whole = case.constraints.extended(total)
        self.basis = sparse.csr_array(sparse.csc_array(whole)[:, self._free])
        self.size, self.offset = len(self._free), np.zeros(total)
        self.whole: Equation = self
        self.tangents = Tangents(self.body, self.basis)
        nodal = mass_of(case)
        self.mass = self.projected(nodal)
        terms = damping_terms(case, origin, modal_rows(case, origin)) if driven else []
        check_damping(terms, name)
        self.alpha = case.rayleigh.alpha if driven else 0.0
        drag = nodal * self.alpha
        for term in terms:
            drag = drag + term.damping(np.zeros(total))
        self.damping = self.projected(drag)
        self._moved = sparse.csr_array(self.basis.T @ nodal), sparse.csr_array(self.basis.T @ drag)
        self._back = np.zeros((0, 0))  # in a reduced equation: from the whole equation's unknowns
        self._following = joined([(part, k) for k, (part, _) in enumerate(self.drive.following)])

    @cached_property
    def rounding(self) -> float:
        """Norm (N) of the rounding errors of the forces."""
        return EPS * float(np.linalg.norm(abs(self.basis).T @ self.body.scale()))

    @cached_property
    def length(self) -> float:
        """Size (m) of the sheet, the scale of lengths."""
        return float(np.ptp(self.case.structure.nodes, axis=0).max())

    def at(self, phase: NDArray, level: float = 1.0) -> Instants:
        """The equation at phases (s,) of the drive, with all varying terms times a level."""
        return Instants(self, phase, level * self.level)

    def undriven(self, displacement: NDArray) -> tuple[Instants, NDArray]:
        """The equation without drive, and unknowns (k,) of a displacement (n, 3) that it allows."""
        still = self.at(np.zeros(1), 0.0)
        check_contact(self.case, displacement, still.planes[0])
        return still, self.unknowns(displacement[None], still)[0]

    def projected(self, matrix: sparse.csr_array) -> NDArray:
        """B' K B (k, k) of a matrix of all dofs."""
        found = self.basis.T @ (matrix @ self.basis)
        return found.toarray() if sparse.issparse(found) else found

    def responses(self, tangent: NDArray, w: float, forces: NDArray, first: int) -> NDArray:
        """Linear responses (h, k) to forces (h, k) of harmonics `first` and higher of w rad/s."""
        found = [
            np.linalg.solve(tangent - (j * w) ** 2 * self.mass + 1j * j * w * self.damping, one)
            for j, one in enumerate(forces, first)
        ]
        return np.array(found)

    @property
    def delays(self) -> bool:
        """Whether damping delays unknowns without mass."""
        return bool(self.damping[self.heavy :].any())

    def follow(self, stiffness: NDArray) -> NDArray:
        """Motion (..., k - n, n) of unknowns without mass, in balance, with the n others."""
        n = self.heavy
        return -np.linalg.solve(stiffness[..., n:, n:], stiffness[..., n:, :n])

    def condensed(self, stiffness: NDArray) -> NDArray:
        """Stiffness (..., n, n) of unknowns with mass, the others being in balance, N/m."""
        n = self.heavy
        return stiffness[..., :n, :n] + stiffness[..., :n, n:] @ self.follow(stiffness)

    def vibrations(self, stiffness: NDArray, first: int, last: int) -> tuple[NDArray, NDArray]:
        """Squared frequencies and shapes (k, r) of modes `first` to `last`, from 0."""
        mass = self.mass[: self.heavy, : self.heavy]
        value, shape = eigh(self.condensed(stiffness), mass, subset_by_index=[first, last])
        return value, np.concatenate([shape, self.follow(stiffness) @ shape])

    def nodal(self, dofs: NDArray) -> NDArray:
        """Displacements (s, n, 3) of the nodes, of those of all dofs (s, m)."""
        nodes = self.case.structure.nodes
        return dofs[:, : nodes.size].reshape(-1, *nodes.shape)

    def unknowns(self, displacement: NDArray, instants: Instants) -> NDArray:
        """Unknowns (s, k) of displacements (s, n, 3) of all nodes; other dofs are in balance."""
        following, none = self._following, np.zeros(self.body.size)
        each = zip(displacement, instants.bodies, instants._factor, strict=True)
        dofs = [body.dofs(u, following_force(following, none, factor)) for u, body, factor in each]
        return self.coordinates(np.array(dofs), instants)

    def coordinates(self, dofs: NDArray, instants: Instants) -> NDArray:
        """Unknowns (s, k) of displacements (s, m) of all dofs at some instants."""
        flat, ties = dofs - instants.moved - self.offset, self.case.constraints
        found = np.array([ties.coordinates(u)[self._free] for u in flat])
        return found if self.whole is self else found @ self._back.T


class Instants:
    """The equation at s phases of the drive.

    Attributes
    ----------
    moved : (s, m)
        Displacement U (m) of the drive.
    inertia, drag : (s, k)
        The terms s2 and s1 in the module docstring.
    planes : (s, p, 3)
        Displacements of contact planes, m.
    bodies : sequence of Assembly
        Body at each instant, with its rest angles and planes.
    """

    def __init__(self, equation: Equation, phase: NDArray, level: float) -> None:
        drive, body, basis = equation.drive, equation.body, equation.basis
        self.equation = equation
        self.moved, first, second = drive.sums(drive.moves, phase, level, body.size)
        mass, drag = equation._moved
        self.inertia, self.drag = second @ mass.T, first @ drag.T
        self._pushed = drive.sums(drive.loads, phase, level, body.size)[0]
        self.loads = self._pushed @ basis
        rest = body.sheet.rest_angles
        turned = drive.sums(drive.turns, phase, level, len(rest))[0]
        self.bodies = [body.folded(rest + turn) if drive.turns else body for turn in turned]
        contact = equation.case.contact
        count = 0 if contact is None else len(contact.planes)
        places = drive.sums(drive.planes, phase, level, 3 * count)[0]
        self.planes = places.reshape(len(phase), count, 3)
        if drive.planes:
            self.bodies = [b.displaced(p) for b, p in zip(self.bodies, self.planes, strict=True)]
        factor = drive.factors(drive.following, phase, level)[0]
        self._factor = np.stack([factor, np.zeros_like(factor), np.zeros_like(factor)], axis=-1)

    def displacements(self, x: NDArray) -> NDArray:
        """Displacements of all dofs (s, m), m, from unknowns (s, k)."""
        return x @ self.equation.basis.T + self.moved + self.equation.offset

    def _each(self, x: NDArray):
        """Yield the number, the displacement and the body of each instant."""
        return zip(range(len(x)), self.displacements(x), self.bodies, strict=True)

    def forces(self, x: NDArray) -> NDArray:
        """Forces f (s, k), N, at unknowns (s, k)."""
        following, force = self.equation._following, np.empty(self.moved.shape)
        for j, u, body in self._each(x):
            force[j] = body.internal(u)
            if following.acts:
                force[j] -= following_force(following, u, self._factor[j])
        with np.errstate(invalid="ignore"):  # inside a contact
            return force @ self.equation.basis - self.loads

    def tangents(self, x: NDArray) -> NDArray:
        """Derivative (s, k, k) of f, N/m."""
        equation, following = self.equation, self.equation._following
        out = np.zeros((len(x), equation.size, equation.size))
        for j, u, body in self._each(x):
            equation.tangents.put(body, u, out[j])
            if following.acts:
                out[j] += equation.projected(following_tangent(following, u, self._factor[j]))
        return out

    def driving(self, omega: float) -> NDArray:
        """Force (s, k), N, added to f by moving supports, at a drive of omega rad/s."""
        return omega**2 * self.inertia + omega * self.drag

    def energies(self, x: NDArray) -> NDArray:
        """Strain energy less the work of constant loads (s,), J, at unknowns (s, k)."""
        strain = np.array([body.energies(u).sum() for _, u, body in self._each(x)])
        return strain - np.einsum("jm,jm->j", self._pushed, self.displacements(x))
