"""Where a sheet touches: forces of contact, as quantities of samples."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from foldyn.cases import Case
from foldyn.mechanics.contact.term import ContactTerm
from foldyn.results import Quantity
from foldyn.results.quantities import CONTACT

CONTACT_FORCE, PLANE_FORCE = CONTACT


def contact_quantities(case: Case) -> dict[str, Quantity]:
    """What is sampled of a case with contact; nothing without."""
    if case.contact is None:
        return {}
    planes = case.contact.planes

    def placed(time: float) -> ContactTerm:
        moved = np.zeros((len(planes), 3))
        for plane, history in case.obstacle_terms:
            moved[plane] = float(history(time)) * np.array(planes[plane].motion)
        return case.contact_term.displaced(moved)

    def force(u: NDArray, v: NDArray, time: float) -> NDArray:
        return placed(time).touch(u)

    def push(u: NDArray, v: NDArray, time: float) -> NDArray:
        return placed(time).plane_forces(u)

    functions = {CONTACT_FORCE: force} | ({PLANE_FORCE: push} if planes else {})
    return {name: CONTACT[name]._replace(function=own) for name, own in functions.items()}
