"""Creases that yield, creep, relax or soften, in explicit motions.

In explicit motions the turn of a crease between compliant panels is a dof with an inertia
(`stability.hidden_inertia`). It must be as small as what is left of the stiffness asks for: one in
proportion to the stiffness at rest would let a crease that is far stiffer than its panels yield far
too slowly. Therefore a crease that is stiff at rest vibrates faster than the nodes, and steps are
shorter, by up to the square root of the ratio of both stiffnesses.

Where a crease begins to yield, its turn swings about the one without inertia, by an amount that is
first order in the period of these swings, and what yields while it swings stays. The energy of the
swings shows how large they are.
"""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from foldyn.cases import Case
from foldyn.dynamics.audit import KINETIC
from foldyn.dynamics.output import Output
from foldyn.errors import InputError
from foldyn.mechanics import angles

SOFTEST = 1e4  # largest stiffness of a crease at rest, relative to the least one with its panels
LOOKS = 200  # number of samples at which swings are sought
# Energy in turns of creases, relative to the energies at play, above which a motion is doubtful:
YIELDING = 5e-4  # of creases that lose stiffness: losses are off by about its root
DAMPED = 2e-3  # if there are damped creases, which are late


def lost_stiffness(case: Case) -> NDArray:
    """Stiffness (h,), N/m, of dofs without mass at rest that the laws of creases may lose."""
    hidden = case.body.hidden
    out = np.zeros(len(hidden))
    if not len(hidden) or not (there := (hinges := case.body.sheet.fold_hinges()).alone).any():
        return out
    law, corners = case.structure.fold_law.at(hinges.fold), hinges.corners.reshape(-1, 3)
    angle = angles(corners, np.arange(len(corners), dtype=np.uint32).reshape(-1, 4))
    slope = np.maximum(law.slope(angle, hinges.rest), 1.0)
    for part in case.remembering:
        if part.kind == "fold":
            slope[part.rows] += sum(branch.relaxed + branch.share for branch in part.branches)
    slope -= law.least_slope(hinges.rest, hinges.stiffness, hinges.length)
    own = np.searchsorted(hidden, hinges.hidden[there, 0])
    out[own] = (hinges.stiffness * slope * hinges.hidden_turn.sum(axis=1) ** 2)[there]
    return out


def check_lost(case: Case, ratio: NDArray) -> None:
    """Refuse creases that would make steps far shorter.

    ratio : (h,) stiffness of each dof at rest relative to what may be left of it.
    """
    if (worst := ratio.max()) > SOFTEST:
        raise InputError(
            f": creases of the law {case.structure.fold_law.name!r} can lose their stiffness, "
            f"{worst:.2g} times what is left then with that of the panels, {SOFTEST:.0f} at most: "
            f"explicit steps would be {math.sqrt(worst):.0f} times shorter; choose "
            "generalized_alpha, newmark or energy_momentum, or softer creases",
            "method",
        )


def swings_told(case: Case, output: Output, stored: int) -> str:
    """Warning about an explicit motion that creases with an inertia do not follow; empty if none.

    It concerns creases that lose stiffness or are damped.

    stored : number of samples.
    """
    scale, hidden = output.balance.scale, len(case.body.hidden)
    if not (hidden and scale > 0.0 and case.body.sheet.fold_hinges().alone.any()):
        return ""
    softens, damped = lost_stiffness(case).any(), case.crease_damping.any()
    if not (softens or damped):
        return ""
    _, velocity, energy = output.evenly_spaced(stored, LOOKS)
    nodal = [0.5 * np.vdot(v, case.mass @ v) for v in velocity]
    share = float((energy[:, KINETIC] - nodal).max()) / scale
    if not share > (DAMPED if damped else YIELDING):
        return ""
    law = case.structure.fold_law.name
    why = f"creases of the law {law!r} lose stiffness" if softens else "creases are damped"
    return (
        f"{why} faster than they turn in explicit motions, where their turns have an inertia: "
        f"{min(share, 1.0):.2%} of the energies at play is in them, and the motion may be off by "
        'some percent; take method = "generalized_alpha", or slower loads without jumps'
    )
