"""Motions of many models of one topology on the card, each in a block of threads."""

from __future__ import annotations

from collections.abc import Sequence
from contextlib import suppress

import numpy as np
from numpy.typing import NDArray

from foldyn.dynamics.gpu.launch import Launches, Places
from foldyn.dynamics.motion import Motion
from foldyn.dynamics.motion_state import Samples
from foldyn.errors import ComputationError


def integrate(motions: Sequence[tuple[int, Motion]], out: Samples) -> set[int]:
    """Integrate motions of one topology and plan; numbers of those that go wrong.

    motions : with their numbers in `out`.
    out : room for samples: times (k,), the others (m, k, ...).
    """
    numbers, own = zip(*motions, strict=True)
    plan, method = own[0].plan, own[0].method.name
    courses = [motion.course for motion in own]
    u, v, carry, angle = (
        np.stack([getattr(course, name) for course in courses])
        for name in ("u", "v", "carry", "angle")
    )
    places = Places(u, v, carry, np.zeros((len(own), 2)), angle)
    launches = Launches([motion.packed for motion in own], method, places, wide=False)
    sound, done, sample = np.ones(len(own), bool), 0, 0
    at, totals = np.array(numbers), np.zeros((len(own), 2))
    while sound.any() and (done < plan.steps or not sample):
        checked = done - done % own[0].recheck_after + own[0].recheck_after
        last = min(plan.steps, checked, done + launches.fits(plan))
        first = done + (method == "central_difference" and done > 0)
        written, wrong = launches.run(plan, first, last, sample)
        count = written.u.shape[1]
        rows = slice(sample, sample + count)
        for array, found in zip(out[1:4], written[:3], strict=True):
            array[at, rows] = found
        energy = np.moveaxis(written.energy, 0, 1) + 0.0  # (m, k + 1, columns)
        energy[:, :, -2:] += totals[:, None]
        totals = energy[:, -1, -2:].copy()
        out.energy[at, rows] = energy[:, :-1]
        sound &= ~wrong & np.isfinite(energy).all(axis=(1, 2))
        sample, done = sample + count, last
        if done == checked or done == plan.steps:
            u = launches.places().u if done < plan.steps else u
            for k in np.flatnonzero(sound):
                sound[k] = _is_sound(own[k], u[k], sample, done)
    return {number for number, well in zip(numbers, sound, strict=True) if not well}


def _is_sound(motion: Motion, u: NDArray, samples: int, step: int) -> bool:
    """Whether a motion can go on after a step: it is audited as if it were alone."""
    motion.course.tally.samples = samples
    with suppress(ComputationError):
        motion.audit()
        if step < motion.plan.steps:
            motion.recheck(motion.packed.numbering.outward(u))
        return True
    return False
