"""Free flight: the momenta of a motion, and how its body, or a panel, is turned."""

from __future__ import annotations

import numpy as np
import xarray as xr
from numpy.typing import NDArray
from scipy import sparse

from foldyn.errors import InputError
from foldyn.patterns.screw import closest_rotations
from foldyn.results.contents import case_of
from foldyn.results.quantities import variable
from foldyn.values import whole

NEARLY_0 = 1e-9  # angles (rad) below this have no axis of their own


def attitude(result: xr.Dataset, panel: int | None = None) -> xr.Dataset:
    """Attitude and momenta of a body that moves freely, or the attitude of a panel.

    A body that bends has no rotation of its own. Its attitude is the rotation that brings the
    structure at rest closest to its nodes, in the mean over the mass (Kabsch, Acta Cryst. A32,
    1976), and its angular velocity is that of a rigid body with the same angular momentum and
    inertia.

    Parameters
    ----------
    result : xarray.Dataset
        A motion.
    panel : int, optional
        Number of a panel, whose corners all count alike; by default the whole body.

    Returns
    -------
    xarray.Dataset
        Over (time, axis): `rotation`, the vector (rad) along the axis of rotation from rest, as
        long as its angle, which goes on beyond a full turn; `angular_velocity` (rad/s); `center`
        (m). Of the whole body, its center of mass, and its `momentum` (kg m/s) and
        `angular_momentum` (kg m2/s) about that.

    Raises
    ------
    InputError
        Not a motion, or a panel that the pattern does not have.

    Examples
    --------
    >>> import foldyn as fd
    >>> case = fd.Case(fd.discretize(fd.patterns.miura(), fd.Sheet(1e6, 0.25, 0.01, 1.0)))
    >>> thrown = fd.State(velocity=case.structure.nodes[:, [1, 0, 2]] * [-3.0, 3.0, 0.0])
    >>> flight = fd.attitude(fd.simulate(case, 0.01, interval=0.005, initial=thrown))
    >>> round(float(flight["angular_velocity"].sel(axis="z")[0]), 9)
    3.0
    """
    case = case_of(result)
    if "velocity" not in result or result["displacement"].dims[0] != "time":
        raise InputError(": is no motion; give what foldyn.simulate returns", "result")
    structure = case.structure
    nodes, weight = np.arange(len(structure.nodes)), case.mass
    if panel is not None:
        faces = () if structure.pattern is None else structure.pattern.faces
        nodes = np.array(faces[whole("panel", panel, least=0, most=len(faces) - 1, what="panels")])
        weight = sparse.eye_array(len(nodes), format="csr")
    share = np.asarray(weight.sum(axis=0)).ravel() / weight.sum()
    moved, speed = (result[name].values[:, nodes] for name in ("displacement", "velocity"))
    rest = structure.nodes[nodes]
    arm, center = _about_mean(rest + moved, share)
    drift, mean = _about_mean(speed, share)
    carried = np.cross(arm, _weighed(weight, drift)).sum(axis=1)
    spread = np.einsum("tni,tnj->tij", arm, _weighed(weight, arm))
    inertia = np.trace(spread, axis1=1, axis2=2)[:, None, None] * np.eye(3) - spread
    own = weight @ (rest - share @ rest)
    rotations = closest_rotations(np.einsum("tni,nj->tij", arm, own))
    found = {
        "rotation": (_rotation_vectors(rotations), "rad", "rotation from rest"),
        "angular_velocity": (
            np.linalg.solve(inertia, carried[..., None])[..., 0], "rad/s", "angular velocity",
        ),
        "center": (center, "m", "center of the panel"),
    }  # fmt: skip
    if panel is None:
        found |= {
            "center": (center, "m", "center of mass"),
            "momentum": (weight.sum() * mean, "kg m/s", "momentum"),
            "angular_momentum": (carried, "kg m2/s", "angular momentum about the center of mass"),
        }
    data = {name: variable(("time", "axis"), *own) for name, own in found.items()}
    return xr.Dataset(data, {"time": result["time"], "axis": result["axis"]})


def _about_mean(vectors: NDArray, share: NDArray) -> tuple[NDArray, NDArray]:
    """Vectors (t, n, 3) from their mean, and the mean (t, 3)."""
    mean = np.einsum("n,tnx->tx", share, vectors)
    return vectors - mean[:, None], mean


def _weighed(weight: sparse.csr_array, vectors: NDArray) -> NDArray:
    """Product of a mass matrix (n, n) with vectors (t, n, 3)."""
    count = vectors.shape[1]
    columns = weight @ vectors.transpose(1, 0, 2).reshape(count, -1)
    return columns.reshape(count, -1, 3).transpose(1, 0, 2)


def _rotation_vectors(rotations: NDArray) -> NDArray[np.float64]:
    """Rotation vectors (t, 3) of rotations (t, 3, 3), each with the angle closest to the last."""
    from scipy.spatial.transform import Rotation  # loads slowly

    found = Rotation.from_matrix(rotations).as_rotvec()
    before = np.zeros(3)
    for k, vector in enumerate(found):
        angle = np.linalg.norm(vector)
        near = before if angle < NEARLY_0 else vector
        if size := np.linalg.norm(near):
            axis = near / size
            turns = np.round((before - vector) @ axis / (2.0 * np.pi))
            found[k] = before = vector + 2.0 * np.pi * turns * axis
    return found
