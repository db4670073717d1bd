"""Where a sheet touches: the force of contact on each node, as a quantity of samples."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from foldyn.cases import Case
from foldyn.results import Quantity

CONTACT_FORCE = "contact_force"


def contact_quantities(case: Case) -> dict[str, Quantity]:
    """What is sampled of a case with contact; nothing without."""
    if case.contact is None:
        return {}
    body: Any = case.body
    planes = case.contact.planes

    def force(u: NDArray, v: NDArray, time: float) -> NDArray:
        moved = np.zeros((len(planes), 3))
        for plane, history in case.obstacle_terms:
            moved[plane] = float(history(time)) * np.array(planes[plane].motion)
        return body.touch(u, moved)

    text = "force of contact on each node, without friction"
    return {CONTACT_FORCE: Quantity("N", text, ("node",), force)}
