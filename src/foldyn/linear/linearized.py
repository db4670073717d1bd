"""A case linearized about a state: M q'' + C q' + K q = f on its free dofs.

C is a sparse matrix plus the rows of modal damping.

Superlinear hinges may take the slope equivalent to an oscillation of finite amplitude. A hinge that
swings about its angle in the state, d = d0 + A cos(phi) from its rest angle, has the moment
M(d) = k sgn(d) |d|^p with p = 4/3. Its harmonic in phase with the motion equals that of a linear
hinge with the slope

    k_eq = (1 / (pi A)) int_0^2pi M(d0 + A cos phi) cos phi dphi = k A^(1/3) g(|d0| / A)

(describing function; harmonic balance: Krylov and Bogoliubov, Introduction to Non-linear
Mechanics, 1947). The integral is a Gauss hypergeometric function of a = |d0| / A:

    a <= 1:  g = 2/sqrt(pi) Gamma(p/2 + 1) / Gamma(p/2 + 3/2) F((1-p)/2, -(1+p)/2; 1/2; a^2)
    a >= 1:  g = p a^(p-1) F((1-p)/2, (2-p)/2; 2; 1/a^2)

About rest k_eq = 0.941 k A^(1/3), while the chord to the largest moment has k A^(1/3); far from
rest k_eq is the local slope.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from functools import cached_property
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy import sparse

from foldyn.algebra.complex_symmetric import Gram
from foldyn.algebra.solvers import check_fill
from foldyn.algebra.woodbury import Squared
from foldyn.arguments import brief
from foldyn.cases import Case, State
from foldyn.cases.added_mass import operator_at
from foldyn.cases.air import LOCAL, refuse_wind
from foldyn.cases.constraints import Constraints
from foldyn.cases.contact_checks import check_contact
from foldyn.dynamics.dampers import damping_matrix
from foldyn.dynamics.inertia import check_mass
from foldyn.dynamics.modal_damping import mass_of, modal_rows, rows_of, soft_slopes
from foldyn.errors import InputError, ModelRangeWarning, warn
from foldyn.linear.hereditary import Branches, branches_of
from foldyn.linear.operating_point import operating_point
from foldyn.materials import Superlinear
from foldyn.mechanics.assembly import Assembly
from foldyn.mechanics.contact.term import ContactTerm
from foldyn.mechanics.following import ASYMMETRIC, NO_POTENTIAL, asymmetry
from foldyn.structures.beyond_range import LINEAR, range_of
from foldyn.structures.discretized import Discretized
from foldyn.values import number

Mass = sparse.csr_array | Squared
ROUNDING = 1e-12  # forces below this, relative to the sum of their terms, count as zero
POWER = 4.0 / 3.0
AT_REST = 0.9411457706782074
"""2/sqrt(pi) Gamma(POWER/2 + 1)/Gamma(POWER/2 + 3/2)."""


class Reacting(NamedTuple):
    """Forces of supports on `case.reaction_dofs` in motions of all m dofs."""

    held: sparse.csr_array  # (s, 3 n) from forces on the nodes
    matrices: tuple[sparse.csr_array, ...]  # (s, m) per displacement, velocity and acceleration
    modal: NDArray  # (r, m) rows of modal damping
    pushed: NDArray  # (r, m) rows of a fluid that is no matrix

    def of(self, motions: NDArray) -> NDArray[np.float64]:
        """Forces (3, s, k), N, per unit of displacement, velocity and acceleration."""
        found = np.stack([own @ motions for own in self.matrices])
        for k, rows in ((1, self.modal), (2, self.pushed)):
            found[k] += self.held @ (rows[:, : self.held.shape[1]].T @ (rows @ motions))
        return found


@brief
@dataclass(frozen=True, eq=False)
class Linearized:
    """Matrices of small motions about a state, on the free dofs (3 node + axis).

    Attributes
    ----------
    case : Case
    displacement : (n, 3)
        The state, m.
    free : (nf,)
        Numbers of the free dofs, increasing: 3 node + axis; then, from 3 n on, massless dofs in
        addition to nodal displacements, such as a shell has. If constraints tie other dofs to
        these, `expanded` gives the motion of all dofs.
    stiffness, mass, damping : (nf, nf)
        Sparse and symmetric: tangent (N/m), mass (kg) and damping without modal damping (N s/m):
        alpha M + beta K0, dashpots and creases in the state. The tangent includes the symmetric
        part of the load stiffness. K0 is the exact tangent of the structure at rest or in this
        state, depending on the damping's `state`.
    modal : (r, nf)
        Rows G of modal damping, which adds G' G to the damping.
    drag : (nf, 3)
        Forces on the free dofs if the whole structure moves with unit velocity along x, y, z: from
        dashpots to the ground, without alpha M, N s/m.
    ground : (nf, 3)
        Forces on the free dofs if the whole structure moves by a unit displacement along x, y, z:
        from springs to the ground and planes in contact, N/m.
    inertia : (nf, 3)
        Forces on the free dofs if the whole structure has unit acceleration along x, y, z, without
        the fluid, kg.
    added : (nf, nf) or None
        Mass of the fluid around the sheet, included in `mass`, kg. If it couples too many dofs for
        a matrix, `added` and `mass` are `Squared`.
    pushed : (nf, 3)
        Forces from the fluid if the whole structure has unit acceleration along x, y, z, kg.
    soft : int
        Number of superlinear hinges at their rest angle, where the slope of their law vanishes, so
        that they have no stiffness. 0 with `secant`.
    secant : float or None
        Amplitude (degrees) at which superlinear hinges take their equivalent slope.
    residual : float
        Residual of the state, as a fraction of the forces that act.
    unbalanced : float
        Residual of the state, N.
    reacting : Reacting
        Forces of supports.
    branches : Branches or None
        Branches of laws with memory. `stiffness` excludes them, as their stiffness depends on the
        frequency.
    responding : Branches or None
        `branches`, plus the part of damped creases between compliant panels that `damping` lacks.
        Used for responses at given frequencies.
    """

    case: Case
    displacement: NDArray
    free: NDArray
    stiffness: sparse.csc_array
    mass: sparse.csc_array | Squared
    damping: sparse.csc_array
    modal: NDArray
    drag: NDArray
    ground: NDArray
    inertia: NDArray
    added: sparse.csc_array | Squared | None
    pushed: NDArray
    soft: int
    secant: float | None
    residual: float
    unbalanced: float
    reacting: Reacting = field(repr=False)
    branches: Branches | None = field(default=None, repr=False)
    responding: Branches | None = field(default=None, repr=False)

    @cached_property
    def gram(self) -> Gram:
        """Modal damping G'G, in addition to `damping`."""
        return Gram(self.modal)

    def expanded(self, motions: NDArray) -> NDArray:
        """Displacements (3n, k) of all nodes in motions (nf, k) of the free dofs."""
        return self.whole(motions)[: self.displacement.size]

    def whole(self, motions: NDArray) -> NDArray:
        """Motions (m, k) of all unknowns in motions (nf, k)."""
        full = np.zeros((self.case.elastic_body.size, motions.shape[1]), motions.dtype)
        full[self.free] = motions
        return self.case.constraints.displacement(full)

    def projected(self, force: NDArray) -> NDArray:
        """Forces (nf,), N, on the free dofs, from forces (3n,) on all nodes."""
        on_nodes = self.free < force.size
        out = np.zeros(len(self.free))
        out[on_nodes] = self.case.constraints.force(force)[self.free[on_nodes]]
        return out


def linearize(
    case: Case,
    state: State | str | None = None,
    *,
    secant: float | None = None,
    load_factor: float = 1.0,
) -> Linearized:
    """Linearize a case about an equilibrium.

    Parameters
    ----------
    case : Case
        Loads and imposed displacements of the case are preloads, in full; histories are ignored.
    state : State or "equilibrium", optional
        State to linearize about: a state, such as `fd.initial_state(path)`; or "equilibrium", the
        equilibrium under the loads, found by statics; by default the rest state, in which no load
        acts.
    secant : float, optional
        Amplitude (degrees) by which hinges turn: superlinear hinges get the slope equivalent to an
        oscillation of this amplitude (see `equivalent_slope`), all other hinges keep their tangent.
    load_factor : float
        Load factor of actuated folds, and of loads that depend on the displacement, in a given
        state.

    Raises
    ------
    InputError
        Nothing can move; a free node has no mass; a state of another size; contact with friction.
    ComputationError
        No equilibrium is found.

    Warns
    -----
    FoldynWarning
        The state is not an equilibrium; loads do not act at rest; hinges have no slope; the load
        stiffness is not symmetric.
    """
    if case.contact is not None and case.contact.rubs:
        raise InputError(
            ".friction: contacts stick or slide, so that small motions have no linear law; give 0, "
            "here and in the planes",
            "contact",
        )
    refuse_wind(case, "small vibrations")
    amplitude = amplitude_of(secant)
    check_mass(case.mass, case.constraints.determined)
    check_fill(case.structure.fill, case.body.size)
    point = operating_point(case, state, load_factor)
    check_contact(case, point.displacement, point.planes)
    body, contact = point.body.parted(ContactTerm)
    free = np.concatenate([case.free_dofs, body.hidden])
    exact = body.tangent(point.dofs)
    change, soft = slope_change(case, body, point.dofs, amplitude)
    if soft:
        warn(
            f"{soft} hinges of the superlinear law stand at their rest angle, where their slope "
            "vanishes: they count without stiffness, and motions that only they resist have the "
            "frequency zero. Give secant = an amplitude in degrees, such as 1, for the slopes of "
            'an oscillation of that amplitude, or take preset = "plate" in place of this law',
            "modes.md#bends-without-a-slope",
        )
    stiffness = exact if change is None else sparse.csr_array(exact + change)
    loads = point.load_stiffness()
    if loads is not None:
        stiffness = sparse.csr_array(stiffness + _symmetric(loads, free))
    ties, more, mass = case.constraints, damping_matrix(case, point.dofs, True), mass_of(case)
    damping = case.rayleigh.matrix(mass, damped_tangent(case, exact))
    added = _added(case, point.displacement, body)
    mass = _moved(mass, added)
    modal = _modal_rows(case, point.displacement, stiffness, mass)
    if contact is not None:  # contact has no damping
        stiffness = sparse.csr_array(stiffness + contact.tangent(point.dofs))
    whole = np.zeros((body.size, 3))
    whole[: point.displacement.size] = np.tile(np.eye(3), (len(point.displacement), 1))
    return Linearized(
        case=case,
        displacement=point.displacement,
        free=free,
        stiffness=_block(ties.matrix(stiffness), free),
        mass=_tied(mass, ties, free),
        damping=_block(ties.matrix(damping + more if more.nnz else damping), free),
        modal=ties.force(modal.T)[free].T,
        drag=ties.force(more @ whole)[free],
        ground=ties.force(_ground(point.body, point.dofs, whole))[free],
        inertia=ties.force(mass_of(case) @ whole)[free],
        added=None if added is None else _tied(added, ties, free),
        pushed=np.zeros((len(free), 3)) if added is None else ties.force(added @ whole)[free],
        soft=soft,
        secant=None if secant is None else float(secant),
        residual=point.relative,
        unbalanced=point.balance.residual,
        reacting=_reacting(case, stiffness, damping + more, mass, modal),
        branches=branches_of(case, point.dofs, free),
        responding=branches_of(case, point.dofs, free, dampers=True),
    )


def _reacting(case: Case, stiffness: Mass, damping: Mass, mass: Mass, modal: NDArray) -> Reacting:
    """How supports push back, with modal rows (r, m)."""
    held = case.constraints.reactions
    if isinstance(mass, Squared):
        mass, pushed = mass.matrix, mass.rows
    else:
        pushed = np.zeros((0, modal.shape[1]))
    own = (sparse.csr_array(held @ sparse.csr_array(each)[: held.shape[1]])
           for each in (stiffness, damping, mass))  # fmt: skip
    return Reacting(held, tuple(own), modal, pushed)


def _symmetric(loads: sparse.csr_array, free: NDArray) -> sparse.csr_array:
    """Symmetric part of the load stiffness (m, m); warns if the antisymmetric part is large."""
    share = asymmetry(sparse.csr_array(loads[free][:, free]))
    if share > ASYMMETRIC:
        warn(
            f"{NO_POTENTIAL.format(share)} modes and frequency responses take its symmetric part, "
            "which misses flutter, vibrations fed by such a load: simulated motions include it",
            "loads.md#pressure",
        )
    return sparse.csr_array(0.5 * (loads + loads.T))


def amplitude_of(secant: float | None) -> float | None:
    """Checked amplitude (rad) at which hinges take their slopes, from the argument (degrees)."""
    if secant is None:
        return None
    return math.radians(number("secant", secant, above=0.0, most=180.0, unit="degrees"))


def slope_change(
    case: Case, body: Assembly, q: NDArray, amplitude: float | None
) -> tuple[sparse.csr_array | None, int]:
    """Correction of the tangent (m, m) for other slopes, and the number of soft hinges.

    Hinges that cannot turn because of constraints are left unchanged.
    """
    if amplitude is None:
        return soft_slopes(case, body, q)
    hinges = body.sheet.soft_hinges(q)
    slope = Superlinear().slope(hinges.offset, np.zeros(len(hinges.offset)))
    change = equivalent_slope(hinges.offset, amplitude) - slope
    return (body.sheet.soft_tangent(q, change) if change.any() else None), 0


def _ground(body: Assembly, q: NDArray, whole: NDArray) -> NDArray:
    """Forces (m, 3) of parts attached to the ground, for displacements (m, 3) of the whole."""
    out = np.zeros_like(whole)
    for term in body.others:
        if not term.of_hinges:  # hinges have no strain when the whole moves
            own = term.tangent(q)
            held = own @ whole
            held[np.abs(held) <= ROUNDING * (abs(own) @ np.abs(whole))] = 0.0
            out += held
    return out


def _added(case: Case, displacement: NDArray, body: Assembly) -> Mass | None:
    """Mass of the fluid (m, m) at a displacement (n, 3), kg; `Squared` if too full for a matrix."""
    found = operator_at(case, displacement)
    if found is None:
        return None
    added, fits = found
    if fits:
        matrix = added.sparse
        matrix.resize((body.size, body.size))
        return matrix
    for name, there in (("modal damping", case.modal_damping), ("memory", case.remembering)):
        if there:
            raise InputError(
                f": the fluid couples {len(added.moving)} dofs, too many for a full matrix, which "
                f'{name} takes; leave one out, take fewer divisions, or added_mass = "{LOCAL}"',
                "air",
            )
    rows = np.pad(added.rows, ((0, 0), (0, body.size - added.shape[0])))
    return Squared(sparse.csc_array((body.size, body.size)), rows)


def _moved(mass: sparse.csr_array, added: Mass | None) -> Mass:
    """Mass (m, m) including the fluid."""
    if added is None:
        return mass
    if isinstance(added, Squared):
        return Squared(sparse.csc_array(mass), added.rows)
    return sparse.csr_array(mass + added)


def _tied(matrix: Mass, ties: Constraints, free: NDArray) -> sparse.csc_array | Squared:
    """A mass (m, m) reduced to the free dofs by constraints."""
    if isinstance(matrix, Squared):
        block = _block(ties.matrix(sparse.csr_array(matrix.matrix)), free)
        return Squared(block, ties.force(matrix.rows.T)[free].T)
    return _block(ties.matrix(matrix), free)


def _modal_rows(case: Case, state: NDArray, stiffness: sparse.csr_array, mass: Mass) -> NDArray:
    """Rows (r, m) of modal damping: from the modes in the state (n, 3), or at rest."""
    damping = case.modal_damping
    if damping is not None and damping.state == "initial":
        modal = rows_of(damping, case, stiffness, mass, state)
    else:
        modal = modal_rows(case)
    modal.warn()
    return modal.rows


def damped_tangent(case: Case, exact: sparse.csr_array) -> sparse.csr_array:
    """K0 of the damping (m, m), N/m: the exact tangent in the state, or at rest."""
    if case.rayleigh.state != "rest" or case.rayleigh.beta == 0.0:
        return exact
    body = case.elastic_body
    return body.tangent(body.dofs(np.zeros_like(case.structure.nodes)))


def _block(matrix: sparse.sparray, free: NDArray) -> sparse.csc_array:
    """Block (nf, nf) of a matrix on the free dofs, with sorted indices."""
    block = sparse.csc_array(sparse.csr_array(matrix)[free][:, free])
    block.sort_indices()
    return block


def equivalent_slope(offset: ArrayLike, amplitude: float) -> NDArray:
    """Slope / k of the superlinear law equivalent to an oscillation (describing function).

    Parameters
    ----------
    offset : array_like
        Angles (rad) of the state from the rest angle, d0.
    amplitude : float
        Amplitude A (rad) of the oscillation about the state.

    Returns
    -------
    ndarray
        k_eq / k, of the shape of `offset`.
    """
    from scipy.special import hyp2f1

    ratio = np.abs(np.asarray(offset, float)) / amplitude
    inside = np.minimum(ratio, 1.0)
    outside = np.maximum(ratio, 1.0)
    near = AT_REST * hyp2f1(0.5 * (1.0 - POWER), -0.5 * (1.0 + POWER), 0.5, inside**2)
    far = POWER * outside ** (POWER - 1.0)
    far = far * hyp2f1(0.5 * (1.0 - POWER), 0.5 * (2.0 - POWER), 2.0, outside**-2.0)
    return amplitude ** (POWER - 1.0) * np.where(ratio <= 1.0, near, far)


def warn_beyond(
    structure: Discretized, frequency: NDArray, name: str = "", linear: bool = False
) -> None:
    """Warn about frequencies (k,), Hz, above the range of the model.

    Parameters
    ----------
    structure : Discretized
    frequency : (k,)
        Frequencies of modes or responses, or the highest frequency of each band; nan is ignored.
    name : str
        Name of the numbered items, "mode" or "band"; empty if the frequencies are the input.
    linear : bool
        Whether the analysis is one that superelements take.
    """
    limit, share = range_of(structure)
    above = np.flatnonzero(frequency > limit)
    if not len(above):
        return
    what = f"frequencies up to {frequency[above].max():.4g} Hz lie"
    if name:
        what = f"{numbered(name, above + 1)} lie{'s' * (len(above) == 1)}"
    remedy = f"{LINEAR}, or the shell" if linear else "take the shell, fd.shell"
    warn(
        f"{what} above {limit:.4g} Hz, {share:g} of the panels' own frequency, where most modes of "
        f"this model are more than 10 % off or missing: {remedy}",
        "fidelity.md#vibration",
        ModelRangeWarning,
    )


def numbered(name: str, numbers: NDArray) -> str:
    """Modes or bands by number, as "mode 3", "modes 1, 2" or "modes 4 to 9"."""
    if len(numbers) > 2 and numbers[-1] - numbers[0] == len(numbers) - 1:
        return f"{name}s {numbers[0]} to {numbers[-1]}"
    return f"{name}{'s' * (len(numbers) > 1)} {', '.join(map(str, numbers.tolist()))}"
