"""Motions of superelements: superposed modes, with steps that are exact for a quadratic load.

Superelements are linear about rest. With the displacements of all dofs

    x = x0 + S (f(t) - f(start)) + Z y,

in which x0 is the start, S has the displacements of moving supports with the histories f, and Z
maps the free dofs to all, the equation of motion M x'' + C x' + K x = F f(t) is projected onto the
lowest modes and, in addition, the static responses to every load, to every moving support and to
the start (modal truncation augmentation: Dickens, Nakagawa and Wittbrodt, Comput. Struct. 62,
1997). The basis B is M-orthonormal, and every column of S is made M-orthogonal to it, so that
accelerations of supports, which are infinite where their velocity jumps, do not occur.

Within a step every history is the parabola through its values at the start, middle and end. Then

    (y, y', f, f', f'')' = A (y, y', f, f', f''),

and exp(A h) advances the motion by any step h without error; so do integrals of quadratic forms,
which give the work and the dissipated energy. Where velocities of supports jump, y' goes on, which
is the impulse on the sheet: at the start y' = B' M v, with v what the sheet had before.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy import sparse
from scipy.linalg import eigh, expm, matrix_balance

from foldyn.algebra.eigen import Pencil, lowest
from foldyn.cases import Case, History
from foldyn.dynamics.dampers import damping_matrix
from foldyn.dynamics.modal_damping import mass_of, modal_rows, moving_mass
from foldyn.dynamics.motion_state import StepPlan
from foldyn.dynamics.timing import histories, jumps, unfollowed
from foldyn.errors import warn
from foldyn.mechanics.following import Following, following_force, joined

BESIDE = 0.01  # shift below 0 of static responses, relative to the lowest positive eigenvalue
RIGID = 1e-10  # eigenvalues of rigid motions, relative to the largest of the modes
APART = 1e-8  # static responses whose share outside the other motions is smaller are left out
MISSED = 1e-5  # share of a history that parabolas may miss
MOVED = 1e-7  # the same for supports, whose velocities act, too
SUPPORTED = ("an imposed displacement", "a base motion")
WORST = 0.1  # steps that miss more than this share of the largest miss are divided
SHORTEST = 4096  # most steps between two samples
MANY_STEPS = 500_000  # number of steps above which to warn
UNRESOLVED = 100.0  # times the allowed share that is missed, above which to warn
LOOKED = (0.0, 0.5, 1.0)  # places of a step through which parabolas go
SAME = 1e-6  # relative difference of the lengths of equal steps, due to rounding
SHORT = 0.125  # norm of A h in the step that is doubled
POINTS, WEIGHTS = np.polynomial.legendre.leggauss(4)


class Matrices(NamedTuple):
    """Matrices of a linear model on its m dofs, h histories and nf free dofs."""

    stiffness: sparse.csr_array  # (m, m) N/m
    mass: sparse.csr_array  # (m, m) kg
    damping: sparse.csr_array  # (m, m) N s/m, without modal damping
    rows: NDArray  # (r, m) modal damping
    free: NDArray  # (nf,) dofs that determine all others
    ties: sparse.csr_array  # Z (m, nf)
    load: NDArray  # (m, h) N, forces at factor 1
    turned: NDArray  # (m, h) N, internal forces of turned rest angles and heat at factor 1
    stored: NDArray  # (h, h) J, twice the energy of a sheet held at rest against these
    heat: tuple[NDArray, NDArray]  # the part of heat in the two above
    support: NDArray  # (m, h) m, displacements of supports at factor 1

    def damped(self, motion: NDArray) -> NDArray:
        """Damping forces (m, ...) of velocities."""
        return self.damping @ motion + self.rows.T @ (self.rows @ motion)


def matrices(case: Case, varying: list[History]) -> Matrices:
    """Matrices of a case at rest, with the histories `varying`."""
    body = case.elastic_body
    rest, size = np.zeros(body.size), body.size
    stiffness, mass = body.tangent(rest), moving_mass(case, np.zeros_like(case.structure.nodes))
    damping = case.rayleigh.matrix(mass_of(case), stiffness) + damping_matrix(case, rest, True)
    load, turned, support, heat = np.zeros((4, size, len(varying)))
    stored, warm = np.zeros((2, len(varying), len(varying)))
    for vector, history in case.load_terms:
        load[: vector.size, varying.index(history)] += vector.ravel()
    for part, history in case.following_terms:
        load[:, varying.index(history)] += _pushed(part, size)
    for one, history in case.swellings:
        heat[:, varying.index(history)] -= _pushed(one.forces, size)
        for other, second in case.swellings:
            own = sum(float(a @ b) for a, b in zip(one.push, other.free, strict=True))
            warm[varying.index(history), varying.index(second)] += own
    angles = body.sheet.rest_angles
    changes = {varying.index(history): change for change, history in case.rest_terms}
    for k, change in changes.items():
        turned[:, k] += body.folded(angles + change).internal(rest)
        for other, second in changes.items():
            parts = (change + second, change - second)
            both, apart = (body.folded(angles + part).energies(rest).sum() for part in parts)
            stored[k, other] += 0.5 * (both - apart)
    for vector, history in (*case.imposed_terms, *case.base_terms):
        support[: vector.size, varying.index(history)] += vector.ravel()
    free = np.concatenate([case.free_dofs, body.hidden])
    ties = case.constraints.extended(size)
    return Matrices(
        stiffness, sparse.csr_array(mass), sparse.csr_array(damping), modal_rows(case).rows,
        free, sparse.csr_array(ties[:, free]), load + heat, turned + heat, stored + warm,
        (heat, warm), support,
    )  # fmt: skip


def _pushed(part: Following, size: int) -> NDArray:
    """Forces (m,), N, of a load of a linear model at factor 1."""
    return following_force(joined([(part, 0)]), np.zeros(size), np.ones((1, 1)))


class Propagator(NamedTuple):
    """A step: the state after it, and integrals of quadratic forms of the states within it."""

    state: NDArray  # (k, k) exp(A h)
    integrals: NDArray  # (2, k, k)


def propagator(matrix: NDArray, forms: NDArray, h: float) -> Propagator:
    """exp(A h), and the integrals of exp(A' t) Q exp(A t) from 0 to h for each form Q (2, k, k).

    A short step is doubled: a sum of bounded terms, unlike an exponential of A and -A' together.
    """
    matrix, (scale, _) = matrix_balance(matrix, permute=False, separate=True)
    forms = forms * np.outer(scale, scale)
    norm = float(np.abs(matrix).sum(axis=1).max()) * h
    doublings = max(0, math.ceil(math.log2(max(norm / SHORT, 1e-300))))
    short = h / 2.0**doublings
    state, integrals = expm(matrix * short), np.zeros_like(forms)
    for place, weight in zip(POINTS, WEIGHTS, strict=True) if len(forms) else ():
        there = expm(matrix * (0.5 * short * (1.0 + place)))
        integrals += 0.5 * short * weight * (there.T @ forms @ there)
    for _ in range(doublings):
        integrals = integrals + state.T @ integrals @ state
        state = state @ state
    return Propagator(state * np.outer(scale, 1.0 / scale), integrals / np.outer(scale, scale))


class Basis(NamedTuple):
    """Motions B (m, r), the supports' S, made M-orthogonal to B, and the start x0, all in S.

    The last column of `support` is x0 - S f(start), with the factor 1.
    """

    motions: NDArray  # (m, r)
    support: NDArray  # (m, h + 1)
    shift: NDArray  # (r, h + 1) what `support` lacks of the columns it is made of
    rigid: NDArray  # numbers of rigid motions


class Superposition:
    """Equation of motion between the motions of a basis; see the module's docstring.

    Attributes
    ----------
    both : (m, r + h + 1)
        B and S.
    unbalanced : (m, 3 (r + h + 1))
        Forces of supports, and what the basis leaves unbalanced, for amplitudes of B and S and
        their first two derivatives, N.
    factors : (h,)
        Places of the factors of the histories in a state.
    """

    def __init__(self, model: Matrices, basis: Basis) -> None:
        both = np.hstack([basis.motions, basis.support])
        pulled, slowed = model.stiffness @ both, model.damped(both)
        count, given = basis.motions.shape[1], basis.support.shape[1]
        stiffness, damping = both.T @ pulled, both.T @ slowed
        stiffness[basis.rigid] = stiffness[:, basis.rigid] = 0.0  # rounding would turn a free sheet
        pad = np.zeros((len(both), 1))
        load, turned = (both.T @ np.hstack([one, pad]) for one in (model.load, model.turned))
        self.basis, self._carried = basis, basis.support.T @ (model.mass @ basis.support)
        self._turned, self._stored = turned, np.pad(model.stored, (0, 1))
        own, others = slice(count), slice(count, None)
        size = 2 * count + 3 * given
        places = np.split(np.arange(size), np.cumsum([count, count, given, given]))
        y, v, f, rate, bent = self._places = places
        self.factors = f[:-1]
        matrix, forms = np.zeros((size, size)), np.zeros((2, size, size))
        matrix[y, v] = matrix[f, rate] = matrix[rate, bent] = 1.0
        matrix[np.ix_(v, y)], matrix[np.ix_(v, v)] = -stiffness[own, own], -damping[own, own]
        matrix[np.ix_(v, f)] = load[own] - turned[own] - stiffness[own, others]
        matrix[np.ix_(v, rate)] = -damping[own, others]
        moving = np.concatenate([v, rate])
        forms[0][np.ix_(moving, moving)] = damping
        work = forms[1]
        work[np.ix_(v, f)] = load[own]
        work[np.ix_(rate, v)] = damping[others, own]
        work[np.ix_(rate, rate)] = damping[others, others]
        work[np.ix_(rate, y)] = stiffness[others, own] + turned[own].T
        work[np.ix_(rate, f)] = (
            stiffness[others, others] + self._stored + turned[others] + turned[others].T
        )
        pulled[:, count:-1] += model.turned - model.load
        self.both, self.unbalanced = both, np.hstack([pulled, slowed, model.mass @ both])
        self._matrix, self._forms = matrix, 0.5 * (forms + forms.swapaxes(1, 2))

    def amplitudes(self, z: NDArray) -> tuple[NDArray, NDArray, NDArray]:
        """Amplitudes (r + h + 1,) of B and S in a state, and their first two derivatives."""
        y, v, f, rate, bent = self._places
        pairs = (z[y], z[f]), (z[v], z[rate]), (self._matrix[v] @ z, z[bent])
        place, speed, gain = (np.concatenate(pair) for pair in pairs)
        return place, speed, gain

    def kinetic(self, z: NDArray) -> tuple[float, float]:
        """Kinetic energy, J, and the part of it that belongs to the motion of the supports."""
        _, v, _, rate, _ = self._places
        carried = 0.5 * float(z[rate] @ self._carried @ z[rate])
        return 0.5 * float(z[v] @ z[v]) + carried, carried

    def steps(
        self, plan: Steps, start: NDArray, works: bool = True
    ) -> Iterator[tuple[NDArray, NDArray]]:
        """State, and the energy dissipated and the work (2,), J, at each sample.

        start : (r,) velocities of the motions of the basis.
        works : whether energies are needed.
        """
        y, v, f, rate, bent = self._places
        z, total, known = np.zeros(len(self._matrix)), np.zeros(2), {}
        z[f[:-1]], z[rate[:-1]], z[bent[:-1]] = plan.parabolas(0)
        z[f[-1]] = 1.0
        z[y], z[v] = self.basis.shift @ z[f], start
        yield z, total
        for k, length in enumerate(plan.lengths.tolist()):
            if length not in known:
                forms = self._forms if works else self._forms[:0]
                known[length] = propagator(self._matrix, forms, length)
            step = known[length]
            if works:
                total += z @ step.integrals @ z
            z = step.state @ z
            if works:
                total[1] += self._work_of_jump(z, plan.at[k + 1] - plan.last[k])
            z[f[:-1]] = plan.at[k + 1]
            if k + 1 < len(plan.lengths):
                _, z[rate[:-1]], z[bent[:-1]] = plan.parabolas(k + 1)
            if plan.sampled[k + 1]:
                yield z, total

    def _work_of_jump(self, z: NDArray, jump: NDArray) -> float:
        """Work, J, that heat and rest angles do in a state as their factors jump by (h,)."""
        y, _, f, _, _ = self._places
        place, jump = np.concatenate([z[y], z[f]]), np.append(jump, 0.0)
        return float(jump @ (self._turned.T @ place + self._stored @ (z[f] + 0.5 * jump)))


class Bases:
    """The bases of a motion: its lowest modes, and the static responses to all that acts.

    Parameters
    ----------
    model : Matrices
    place, speed : (m,)
        Displacement, m, at the start beside S f, and velocity, m/s, of the free dofs.
    modes : int
        Number of modes to begin with.
    """

    def __init__(self, model: Matrices, place: NDArray, speed: NDArray, modes: int) -> None:
        self._model, ties = model, model.ties
        self._support = np.column_stack([model.support, place])
        stiffness = sparse.csc_array(ties.T @ model.stiffness @ ties)
        self._pencil = Pencil(stiffness, sparse.csc_array(ties.T @ model.mass @ ties))
        self.most = self._pencil.finite
        self._find(min(modes, self.most))
        rigid = self._values <= RIGID * np.abs(self._values).max()
        shift = BESIDE * self._values[~rigid].min(initial=1.0) if rigid.any() else 0.0
        solve = self._pencil.factorize(-shift).solve
        forces = np.column_stack(
            [model.load - model.turned, model.stiffness @ self._support, model.damped(speed)]
        )
        static = [solve(force) for force in (ties.T @ forces).T]
        more = np.column_stack([ties @ np.stack(static, axis=1), speed])
        size = np.sqrt(np.einsum("mk,mk->k", more, model.mass @ more))
        self._static = more[:, size > 0.0] / size[size > 0.0]

    def _find(self, modes: int) -> None:
        found = lowest(self._pencil, modes, np.zeros((self._pencil.size, 0)))
        self._values, self._modes = found.values, self._model.ties @ found.shapes

    def basis(self, modes: int) -> Basis:
        """The basis with the lowest modes, as many as given."""
        if modes > len(self._values):
            self._find(modes)
        mass, motions, more = self._model.mass, self._modes[:, :modes], self._static
        for _ in range(2):  # twice, as rounding leaves a share of the modes after the first time
            more = more - motions @ (motions.T @ (mass @ more))
            values, turned = eigh(more.T @ (mass @ more))
            kept = values > APART**2
            more = more @ (turned[:, kept] / np.sqrt(values[kept]))
        motions = np.hstack([motions, more])
        shift = motions.T @ (mass @ self._support)
        rigid = np.flatnonzero(self._values[:modes] == 0.0)
        return Basis(motions, self._support - motions @ shift, shift, rigid)


class Steps(NamedTuple):
    """Steps of a motion, with the factors of its histories."""

    ends: NDArray  # (k + 1,) s
    sampled: NDArray  # (k + 1,) whether there is a sample
    lengths: NDArray  # (k,) s
    at: NDArray  # (k + 1, h) factors at the ends, after a jump
    middle: NDArray  # (k, h)
    last: NDArray  # (k, h) at the end of each step, before a jump

    def parabolas(self, k: int) -> tuple[NDArray, NDArray, NDArray]:
        """Factors and their first two derivatives (h,) at the start of a step."""
        h, first, middle, last = self.lengths[k], self.at[k], self.middle[k], self.last[k]
        rate = (4.0 * middle - 3.0 * first - last) / h
        return first, rate, 4.0 * (first - 2.0 * middle + last) / h**2


def steps_of(case: Case, given: Sequence[History], plan: StepPlan) -> Steps:
    """Steps between samples and jumps, so short that parabolas follow the histories `given`.

    plan : its steps end at samples.
    """
    parts = _parts(case, plan)
    regular, samples = _cut(plan, parts), np.concatenate([[0], np.cumsum(parts)])
    ends, before, after = _ends(regular, np.array(jumps(case)))
    middle, lengths = 0.5 * (ends[:-1] + ends[1:]), np.diff(ends)
    equal = (plan.dt / parts)[np.searchsorted(regular[samples], middle) - 1]
    lengths = np.where(np.abs(lengths - equal) < SAME * equal, equal, lengths)
    factors = (
        np.reshape([history(times) for history in given], (len(given), len(times))).T
        for times in (after, middle, np.nextafter(before[1:], -np.inf))
    )
    return Steps(ends, np.isin(ends, regular[samples]), lengths, *factors)


def _cut(plan: StepPlan, parts: NDArray) -> NDArray:
    """Ends of steps that divide each step of a plan into equal parts (k,)."""
    number = np.repeat(np.arange(len(parts)), parts)
    within = np.arange(len(number)) - np.repeat(np.cumsum(parts) - parts, parts)
    return plan.start + plan.dt * np.append(number + within / parts[number], len(parts))


def _parts(case: Case, plan: StepPlan) -> NDArray:
    """Numbers of parts (k,) of each step of a plan, as many as parabolas need."""
    parts = np.ones(plan.steps, np.int64)
    while True:
        missed, what = _missed(case, plan, parts)
        left = np.where(parts < SHORTEST, missed, 0.0)
        if left.sum() <= 1.0:
            break
        parts[left > WORST * left.max()] *= 2
    shortest = f"{plan.dt / parts.max():.3g} s"
    if parts.sum() > max(MANY_STEPS, plan.steps):
        warn(
            f"{parts.sum():.3g} steps, the shortest of {shortest}, will take a long time: {what} "
            "needs them; compute a part with fast changes as a motion of its own, and go on from "
            "its end",
            "superelements.md#motions",
        )
    if missed.sum() > UNRESOLVED:
        warn(
            f"steps of {shortest}, the shortest between samples {plan.dt:.3g} s apart, do not "
            f"resolve {what}: give a shorter interval",
            "superelements.md#motions",
        )
    return parts


def _missed(case: Case, plan: StepPlan, parts: NDArray) -> tuple[NDArray, str]:
    """Largest shares (k,) of histories that parabolas miss, relative to the allowed ones.

    Returned with the name of the history of which most is missed. parts : (k,) parts of each step
    of the plan.
    """
    ends, missed, most, name = _cut(plan, parts), np.zeros(plan.steps), 0.0, ""
    first = np.cumsum(parts) - parts
    for what, history in histories(case):
        allowed = MOVED if what in SUPPORTED else MISSED
        share = np.add.reduceat(unfollowed(history, ends, LOOKED), first) / allowed
        missed = np.maximum(missed, share)
        if share.sum() > most:
            most, name = float(share.sum()), f"the history {history.kind} of {what}"
    return missed, name


def _ends(regular: NDArray, times: NDArray) -> tuple[NDArray, NDArray, NDArray]:
    """Ends of steps, and the times just before and after each between which jumps lie.

    regular : ends of steps without jumps.
    times : times of jumps, s. One that rounding keeps from an end belongs to it.
    """
    right = np.clip(np.searchsorted(regular, times), 1, len(regular) - 1)
    nearest = right - (times - regular[right - 1] < regular[right] - times)
    near, alone = regular[nearest], np.bincount(nearest)[nearest] == 1
    close = alone & (np.abs(near - times) < SAME * (regular[right] - regular[right - 1]))
    within = (regular[0] < times) & (times < regular[-1]) & ~close
    ends = np.union1d(regular, times[within])
    before, after, at = ends.copy(), ends.copy(), np.searchsorted(ends, near[close])
    before[at] = np.minimum(before[at], times[close])
    after[at] = np.maximum(after[at], times[close])
    return ends, before, after
