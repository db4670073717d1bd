"""Whether a result depends on in-plane stretching of panels, where models are inaccurate.

A panel's independent bars are exact in uniform strain at best, and otherwise too stiff. Coupled
bars have the panel's membrane stiffness, but with straight edges. They are accurate if panels bend
in their plane, but also too stiff if quadrilateral panels stretch as a whole; the energy is then
computed from the panels' mean strains. With the scheme n5b8e edges give way, which is accurate in
open sheets. Closed sheets and sheets with welds are off by 5 to 20 %, in either direction
(docs/models.md, "Where panels stretch").
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from foldyn.errors import StretchWarning, warn
from foldyn.structures.beyond_range import LINEAR
from foldyn.structures.discretized import Discretized

BARS = "strain_bars"
SINGLE, TRIANGLES, COUPLED, GIVING = 0.05, 0.1, 0.4, 0.5
"""Shares of stretching in the strain energy above which a result is doubtful: with single bars;
with coupled bars in triangles; by mean strains of other panels with coupled bars; with edges that
give way. Measured with the mixed sets of docs/fidelity.md."""
LEAST = 1e-9  # mean strain of the bars below which it may be rounding error
FELT = 1e-3  # share of the kinetic energy: less strain energy does not affect a motion


class Stretch(NamedTuple):
    """Index of the state with the largest strain energy, and the share of stretching in it."""

    at: int
    share: float


def most(structure: Discretized) -> float:
    """Share of stretching in the strain energy above which a result is doubtful.

    inf for structures made by hand, for shells, and for open sheets whose edges give way.
    """
    pattern = structure.pattern
    if BARS not in structure.energy_groups or pattern is None:
        return np.inf
    if not getattr(structure, "membranes", ()):
        return SINGLE
    if len(getattr(structure, "edge_gives", ())):
        corners = {vertex for face in pattern.faces for vertex in face}
        closed = len(corners) - len(pattern.edges) + len(pattern.faces) < 1
        return GIVING if closed or len(pattern.welds) else np.inf
    return TRIANGLES if all(len(face) == 3 for face in pattern.faces) else COUPLED


def remedy(structure: Discretized, linear: bool = False) -> str:
    """Remedy if the share of stretching exceeds `most`: the end of a message.

    linear : whether the analysis is one that superelements take.
    """
    if not getattr(structure, "membranes", ()):
        why, better = "single bars are far too stiff", 'membrane = "panel", or '
    elif not len(getattr(structure, "edge_gives", ())):
        why, better = "edges that stay straight can be too stiff", 'preset = "n5b8e", or '
    else:
        why, better = "closed and welded sheets are often 5 to 20 % off", ""
    other = f"{LINEAR}, or the shell" if linear else f"take {better}the shell, fd.shell"
    return f"where {why}: {other}"


def stretch(structure: Any, energies: Mapping[str, NDArray], displacement: Any) -> Stretch | None:
    """Share of stretching in k states with given energies (k,), J, by name; None if it is small.

    Also None for motions that hardly strain the structure; the energies of motions include
    `kinetic`.

    displacement : (k, n, 3) displacements of the states, m.
    """
    limit = most(structure)
    if not np.isfinite(limit) or not np.size(energies[BARS]):
        return None
    bars = np.nan_to_num(energies[BARS])
    total = np.nan_to_num(np.sum([energies[name] for name in structure.energy_groups], axis=0))
    at = int(total.argmax())
    kinetic = np.nan_to_num(energies.get("kinetic", np.zeros(1))).max()
    felt = max(FELT * kinetic, LEAST**2 * structure.bar_stiffness @ structure.bar_length**2)
    if bars[at] <= felt:
        return None
    held = bars[at]
    if limit == COUPLED:
        place = structure.nodes + np.asarray(displacement[at])
        now, rest = (_gradients(structure, x) for x in (place, structure.nodes))
        strain = 0.5 * (np.swapaxes(now, -1, -2) @ now - np.swapaxes(rest, -1, -2) @ rest)
        held = 0.5 * _of_strains(structure, strain)
    return Stretch(at, float(min(held / total[at], 1.0))) if held > limit * total[at] else None


def warn_of_stretching(
    structure: Any, energies: Mapping[str, NDArray], displacement: Any, place: Callable[[int], str]
) -> None:  # fmt: skip
    """Warn if stretching panels hold much of the strain energy of states, as given to `stretch`.

    place : tells where the state with an index is, such as its time.
    """
    if found := stretch(structure, energies, displacement):
        warn(
            f"panels that stretch hold {found.share:.0%} of the strain energy where that is "
            f"largest, at {place(found.at)}, {remedy(structure)}",
            "models.md#where-panels-stretch",
            StretchWarning,
        )


def stretching(structure: Discretized, displacement: NDArray, motions: NDArray) -> NDArray:
    """Twice the energy (k,), J, of stretching in small motions (m, k) about a state (n, 3)."""
    if most(structure) == COUPLED:
        moved = motions[: structure.nodes.size].T.reshape(-1, *structure.nodes.shape)
        place = _gradients(structure, structure.nodes + displacement)
        strain = np.swapaxes(place, -1, -2) @ _gradients(structure, moved)
        return _of_strains(structure, 0.5 * (strain + np.swapaxes(strain, -1, -2)))
    body = structure.body
    q, hinges = body.dofs(displacement), body.hinges_alone
    matrix = body.tangent(q)
    if hinges is not None:
        matrix = matrix - hinges.tangent(q)
    own = motions[: body.size]
    return np.einsum("ik,ik->k", own.conj(), matrix @ own).real


def _gradients(structure: Discretized, field: NDArray) -> NDArray:
    """Mean gradient (..., f, 3, 2) of nodal values (..., n, 3) in each panel."""
    pattern, size = structure.pattern, np.array([len(face) for face in structure.pattern.faces])
    out = np.empty((*field.shape[:-2], len(size), 3, 2), field.dtype)
    for alike in np.unique(size):
        at = np.flatnonzero(size == alike)
        face, normal = np.array([pattern.faces[f] for f in at]), pattern.face_normals[at]
        x = pattern.vertices[face]
        along = np.cross(np.cross(normal, x[:, 1] - x[:, 0]), normal)
        along /= np.linalg.norm(along, axis=1)[:, None]
        plane = (x - x.mean(axis=1)[:, None]) @ np.stack([along, np.cross(normal, along)], axis=-1)
        weights = np.swapaxes(np.linalg.pinv(plane), -1, -2)
        out[..., at, :, :] = np.swapaxes(field[..., face, :], -1, -2) @ weights
    return out


def _of_strains(structure: Discretized, strain: NDArray) -> NDArray:
    """Twice the energy (...), J, of strains (..., f, 2, 2) that are uniform in each panel."""
    names = ("youngs_modulus", "poissons_ratio", "thickness")
    modulus, nu, thickness = (structure.sheet.values(name, strain.shape[-3]) for name in names)
    stiffness = modulus * thickness * structure.pattern.face_areas / (1.0 - nu**2)
    square = nu * np.abs(np.trace(strain, axis1=-2, axis2=-1)) ** 2
    square = square + (1.0 - nu) * (np.abs(strain) ** 2).sum(axis=(-2, -1))
    return (stiffness * square).sum(axis=-1)
