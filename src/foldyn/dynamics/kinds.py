"""The kernels of a model, whatever its kind: force, energies and dihedrals in compiled loops.

Arrays have a row of three numbers per node. A shell has rotations beside its displacements: they
follow as further rows, three to each, the last one filled up with what is held.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from numba.extending import overload
from numpy.typing import NDArray

from foldyn import mechanics
from foldyn.jit.flat import flat
from foldyn.mechanics import BarsHinges, internal_force, strain_energies
from foldyn.shells.kernels import ShellModel, ShellWork, shell_energy, shell_force, shell_work


def rows_of(model: BarsHinges | ShellModel) -> int:
    """Rows of the arrays of a model."""
    if isinstance(model, ShellModel):
        return model.nodes + -(-model.rotations // 3)
    return len(model.rest)


def workspace_of(model: BarsHinges | ShellModel) -> Any:
    """Memory for the kernels of a model."""
    return shell_work(model) if isinstance(model, ShellModel) else mechanics.workspace(model)


def angles_of(model: BarsHinges | ShellModel, u: NDArray) -> NDArray:
    """Dihedrals (nh,), rad, at displacements u (rows, 3)."""
    if isinstance(model, ShellModel):
        x = model.rest.copy()
        x[: model.nodes] += u[: model.nodes]
        return mechanics.angles(x, model.hinges.astype(np.uint32))
    return mechanics.angles(model.rest + u, model.hinges)


def hinges_alone(model: Any) -> Any:
    """The model without what stretches: what remains are forces at play where all is at rest."""
    if isinstance(model, ShellModel):
        return model._replace(membrane=np.zeros_like(model.membrane))
    return model._replace(bar_runs=model.bar_runs[:0])


def hinges_linear(model: Any, u: NDArray) -> Any:
    """The model with hinges as stiff as they are meant to be, about their angles at u (n, 3).

    Those of a shell are so at rest.
    """
    if isinstance(model, ShellModel):
        return model
    runs = model.hinge_runs.copy()
    runs[:, 2] = 0
    return model._replace(hinge_rest=angles_of(model, u), hinge_runs=runs)


def put_force(model: Any, u: NDArray, force: NDArray, work: Any) -> None:
    """Internal force (rows, 3) at u (rows, 3), outside of compiled loops."""
    if isinstance(model, ShellModel):
        n, end = model.nodes, 3 * model.nodes + model.rotations
        moved, out = u.reshape(-1), force.reshape(-1)
        out[end:] = 0.0
        shell_force(model, u[:n], moved[3 * n : end], force[:n], out[3 * n : end], work)
    else:
        internal_force(model, u, force, work, False)


def stretching_forces(model: Any) -> float:
    """Norm (N) of the nodes' forces under a strain of one: what rounding is a fraction of."""
    if isinstance(model, ShellModel):
        nodal = np.zeros(model.nodes)
        stiff = np.abs(model.membrane).sum(axis=2) * np.sqrt(model.per_length2)
        for end in (0, -1):
            np.add.at(nodal, np.roll(model.triangles, end, axis=1), stiff)
    else:
        nodal = np.zeros(len(model.rest))
        stiff = model.bar_stiffness / np.sqrt(model.bar_per_length2)
        np.add.at(nodal, model.bars, stiff[:, None])
    return float(np.sqrt(3.0) * np.linalg.norm(nodal))


def turning_moments(model: Any) -> float:
    """Sum of the hinges' moments (N m) for a turn of one."""
    if isinstance(model, ShellModel):
        return float(np.abs(model.bending).sum() + model.piece_stiffness.sum())
    return float(model.hinge_stiffness.sum())


def longest(model: Any) -> float:
    """Length (m) of the longest bar or side; the extent of the nodes where there is none."""
    per_length2 = model.per_length2 if isinstance(model, ShellModel) else model.bar_per_length2
    if not per_length2.size:
        return float(np.ptp(model.rest, axis=0).max())
    return float(1.0 / np.sqrt(per_length2.min()))


def fold_rest(model: Any) -> tuple[NDArray, NDArray]:
    """Rest angles (rad) of what actuators turn, and the hinges (rows of `model.hinges`) there."""
    if isinstance(model, ShellModel):
        return model.piece_rest, model.piece_hinge
    return model.hinge_rest, np.arange(len(model.hinge_rest))


def force_of(model: Any, u: Any, force: Any, work: Any) -> Any:
    """Internal force (rows, 3) at u (rows, 3): `mechanics.internal_force` or its like."""
    raise NotImplementedError  # compiled code has one of those below


def folds_of(model: Any) -> Any:
    """Rest angles, parameters and stiffness of what an actuator turns, arrays of the model."""
    raise NotImplementedError


def fold_angles(work: Any) -> NDArray:
    """Angles (rad) of the same, after `force_of`."""
    return work.piece_turn if isinstance(work, ShellWork) else work.angle


def energies_of(model: Any, u: Any, work: Any, out: Any) -> Any:
    """Strain energies (J) by group, to out (3,)."""
    raise NotImplementedError


@overload(force_of, inline="always")
def _force(model, u, force, work):
    if model.instance_class is ShellModel:

        def shell(model, u, force, work):
            n, r = model.nodes, model.rotations
            moved, out = flat(u), flat(force)
            out[3 * n + r :] = 0.0
            shell_force(
                model, u[:n], moved[3 * n : 3 * n + r], force[:n], out[3 * n : 3 * n + r], work
            )

        return shell

    def bars_hinges(model, u, force, work):
        internal_force(model, u, force, work)

    return bars_hinges


@overload(energies_of, inline="always")
def _energies(model, u, work, out):
    if model.instance_class is ShellModel:

        def shell(model, u, work, out):
            n, r = model.nodes, model.rotations
            shell_energy(model, u[:n], flat(u)[3 * n : 3 * n + r], work, out)

        return shell

    def bars_hinges(model, u, work, out):
        strain_energies(model, u, out)

    return bars_hinges


@overload(folds_of, inline="always")
def _folds(model):
    if model.instance_class is ShellModel:
        return lambda model: (model.piece_rest, model.piece_parameters, model.piece_stiffness)
    return lambda model: (model.hinge_rest, model.hinge_parameters, model.hinge_stiffness)


@overload(fold_angles, inline="always")
def _fold_angles(work):
    if work.instance_class is ShellWork:
        return lambda work: work.piece_turn
    return lambda work: work.angle
