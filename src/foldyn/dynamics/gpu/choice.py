"""The choice between CPU and GPU for many models, if the user leaves it open."""

from __future__ import annotations

from collections.abc import Sequence

from foldyn.dynamics.gpu.checks import METHODS, lacking, no_card
from foldyn.dynamics.motion import Motion

DEVICES = "auto", "cpu", "gpu"
FEWEST = 10  # least number of models for a GPU
LARGEST = 3000  # largest number of dofs: for more, a block of threads is too slow
EVALUATION = 35e-9  # time per dof and force evaluation, on a core and in a block, s
ABREAST = 200  # number of blocks that run as fast as a single block
COMPILING = 12.0  # time to compile kernels, s


def choose(
    motions: Sequence[Motion], count: int, cores: float, preparing: float = 0.0
) -> tuple[str, str]:
    """Device, "cpu" or "gpu", on which the motions should finish sooner, and the reason.

    count : number of motions; `motions` are representative samples.
    cores : number of CPU cores to compare with, each running one motion at a time.
    preparing : time (s) to prepare each motion; a GPU run prepares them one after the other.
    """
    if count < FEWEST:
        return "cpu", f"a GPU pays from {FEWEST} models on"
    method = motions[0].kind
    if method not in METHODS:
        return "cpu", f"{method} has no GPU kernel"
    dofs = 3 * max(motion.packed.system.rows for motion in motions)
    if dofs > LARGEST:
        return "cpu", f"models of more than {LARGEST} dofs are too large for a GPU's blocks"
    each = [motion.plan.steps * motion.method.evaluations * EVALUATION * dofs for motion in motions]
    alone = count * (sum(each) / len(each) + preparing) / min(cores, count)
    beside = COMPILING + max(each) * max(1.0, count / ABREAST) + count * preparing
    seconds = f"about {beside:.2g} s on a GPU, {alone:.2g} s on processors"
    if alone < beside:
        return "cpu", seconds
    known = {id(motion.packed): motion for motion in motions}
    for motion in known.values():
        if lack := lacking(motion.case, motion.packed):
            return "cpu", f"{lack} has no GPU kernel"
        if motion.case.structure.massless:
            return "cpu", "kernels for panels that bend as plates have not run on a GPU yet"
    if why := no_card():
        return "cpu", why.partition(";")[0]
    return "gpu", seconds
