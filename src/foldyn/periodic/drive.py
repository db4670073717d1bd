"""The periodic drive of a case: its histories as functions of the phase of the drive.

The phase is theta = 2 pi f t with f the lowest frequency of the `Harmonic` histories; the others
have multiples of it. A level scales all varying terms, and leaves constant ones.
"""

from __future__ import annotations

import math
from typing import Any

import numpy as np
from numpy.typing import NDArray

from foldyn.attractors.drive import check_harmonic, lowest_frequency
from foldyn.cases import Case, Constant, Harmonic
from foldyn.cases.air import refuse_air
from foldyn.errors import InputError
from foldyn.mechanics.constant_damping import DampingMatrix, DampingRows
from foldyn.mechanics.term import Term
from foldyn.statics.rigid import free_rigid_motions

Terms = list[tuple[Any, Any]]


def check_smooth(case: Case, name: str) -> None:
    """Refuse parts of a case that the analysis `name` cannot treat exactly.

    Raises
    ------
    InputError
        The case has friction, laws with memory, or unknowns without mass.
    """
    case.check_movable()
    if case.contact is not None and case.contact.rubs:
        raise InputError(
            f": {name} takes forces that depend on where the sheet is, and friction on how it got "
            "there; give friction = 0.0, or simulate the motion",
            "contact.friction",
        )
    refuse_air(case, name)
    if case.remembering:
        raise InputError(
            f"structure: {name} takes forces that depend on where the sheet is, and some of its "
            "hinges remember (prony, plastic or damped creases that give way); take an elastic "
            "law, or simulate the motion"
        )
    if len(case.body.hidden):
        raise InputError(
            f"structure: {name} takes bars and hinges, and this model has unknowns without mass "
            'beside them; take scheme = "n5b8" or "n4b5"'
        )


def check_held(case: Case, name: str) -> None:
    """Refuse supports that let the whole drift, without a place to return to."""
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
        Highest of their frequencies, as a multiple of the lowest.
    loads, moves, turns, planes : list of (ndarray, Constant or Harmonic)
        Forces (n, 3), N; displacements (n, 3) of supports and of nodes tied to them, m; changes
        (nr,) of rest angles, rad; displacements (p, 3) of contact planes, m: each at factor 1.
    """

    def __init__(self, case: Case) -> None:
        self.loads: Terms = list(case.load_terms)
        self.moves: Terms = [*case.imposed_terms, *case.base_terms]
        self.turns: Terms = list(case.rest_terms)
        self.following: Terms = list(case.following_terms)
        self.planes: Terms = [_plane(case, number, own) for number, own in case.obstacle_terms]
        every = (*self.loads, *self.moves, *self.turns, *self.planes, *self.following)
        check_harmonic(case, "a periodic motion")
        found = [one.frequency for _, one in every if isinstance(one, Harmonic)]
        self.frequency = lowest_frequency(found)
        self.highest = round(max(found) / self.frequency) if found else 0

    @property
    def varies(self) -> bool:
        """Whether anything drives the case."""
        return self.frequency > 0.0

    def factors(self, terms: Terms, phase: NDArray, level: float) -> NDArray:
        """Factors (3, s, k) of some terms, and their first two derivatives, at phases (s,)."""
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
        """Sums (3, s, size) of some terms, and their first two derivatives, at phases (s,)."""
        shapes = np.zeros((len(terms), size))
        for shape, (vector, _) in zip(shapes, terms, strict=True):
            shape[: vector.size] = vector.ravel()
        return self.factors(terms, phase, level) @ shapes


def _plane(case: Case, number: int, history: Any) -> tuple[NDArray, Any]:
    """Displacements (p, 3), m, of the contact planes as one of them moves, and its history."""
    assert case.contact is not None
    moved = np.zeros((len(case.contact.planes), 3))
    moved[number] = case.contact.planes[number].motion
    return moved, history
