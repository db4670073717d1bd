"""Values that color a sheet on a page, at all samples of a motion or path."""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy import sparse

from foldyn.cases import Case
from foldyn.cases.case_assembly import SomeLoads
from foldyn.dynamics.sampling import CONTACT_FORCE
from foldyn.materials.series import in_series
from foldyn.mechanics import angles
from foldyn.structures import Structure, membranes
from foldyn.structures.mesh import double_areas


class Field(NamedTuple):
    """Values (samples, elements) with what a legend says of them.

    on : "node", "panel", "crease" or "bar".
    signed : whether both signs occur.
    """

    label: str
    unit: str
    on: str
    values: NDArray
    signed: bool


def fields(case: Case, result: Any, displacement: NDArray) -> dict[str, Field]:
    """Fields of a motion or path with displacements (samples, n, 3), by name; shells have none.

    Moments and energies are left out where laws have memory: their angles do not tell them.
    Speeds are not among them: the page takes them from displacements.
    """
    structure, out = case.structure, {}
    if CONTACT_FORCE in result:
        touch = result[CONTACT_FORCE].values
        out["contact"] = Field("force of contact", "N", "node", touch, False)
    if not isinstance(structure, Structure):
        return out
    strain = bar_strain(structure, displacement)
    out["bar_strain"] = _strain_field(strain)
    folds = hinge_angles(structure, structure.folds, displacement)
    turn = np.degrees(folds - structure.fold_rest)
    out["turn"] = Field("turn of creases from rest", "°", "crease", turn, True)
    if (
        structure.edge_plates is None and not case.remembering
    ):  # whose folds turn less than the panels beside them
        angles = np.hstack([folds, hinge_angles(structure, structure.bends, displacement)])
        rest, offset = rest_angles(case, result, len(displacement))
        own, folds = slice(len(structure.folds)), structure.hinge_kinds[0]
        angles[:, own] += offset
        turned = in_series(folds.law, angles[:, own], rest[:, own], folds.share)
        moment = structure.fold_stiffness * turned[1]
        out["fold_moment"] = Field("moment of creases", "N m", "crease", moment, True)
        density = energy_density(structure, displacement, strain, angles, rest)
        out["energy"] = Field("strain energy per area", "J/m²", "panel", density, False)
    return out


def folding_fields(case: Case, displacement: NDArray, fold_angle: NDArray) -> dict[str, Field]:
    """Fields of a folding by name, which has fold angles (samples, nc), rad, and no sheet."""
    angle = np.degrees(fold_angle)
    return {
        "bar_strain": _strain_field(bar_strain(case.structure, displacement)),
        "turn": Field("fold angle of creases, valleys positive", "°", "crease", angle, True),
    }


def _strain_field(strain: NDArray) -> Field:
    return Field("strain of bars", "1", "bar", strain, True)


def bar_strain(structure: Structure, displacement: NDArray) -> NDArray:
    """Elongation of bars over their length (samples, nb)."""
    i, j = structure.bars.T
    apart = structure.nodes[j] - structure.nodes[i] + displacement[:, j] - displacement[:, i]
    return np.linalg.norm(apart, axis=2) / structure.bar_length - 1.0


def hinge_angles(structure: Structure, hinges: NDArray, displacement: NDArray) -> NDArray:
    """Dihedrals (samples, k) of hinges (k, 4), rad."""
    rows = hinges.astype(np.uint32)
    return np.array([angles(structure.nodes + u, rows) for u in displacement]).reshape(
        len(displacement), len(rows)
    )


def rest_angles(case: Case, result: Any, samples: int) -> tuple[NDArray, NDArray]:
    """Rest angles (samples, k) of folds and bends, rad, as loads turn them, and offsets of folds.

    Offsets are what the laws of folds see beside the dihedrals (`SheetTerm.series`).
    """
    body, structure = case.body, case.structure
    turned = np.tile(body.sheet.rest_angles, (samples, 1))
    if "time" in result.sizes:
        for change, history in case.rest_terms:
            turned += np.outer(history(result["time"].values), change)
    else:
        constant = set(np.atleast_1d(result.attrs.get("constant", [])).astype(int).tolist())
        for k in range(len(case.loads)):
            factor = np.ones(samples) if k in constant else result["load_factor"].values
            for change, _ in SomeLoads(case, [k]).rest_terms:
                turned += np.outer(factor, change)
    count = len(structure.fold_rest) + len(structure.bend_rest)
    return turned[:, :count], turned[:, count:] if body.sheet.offsets else np.zeros((samples, 1))


def energy_density(
    structure: Structure, displacement: NDArray, strain: NDArray, angles: NDArray, rest: NDArray
) -> NDArray:
    """Strain energy over the area of each panel (samples, m), J/m2.

    That of a bar or hinge goes in equal parts to the triangles beside it; clamped edges and springs
    are left out.

    displacement : (samples, n, 3), m
    strain, angles, rest : of bars (samples, nb), and of folds and bends (samples, k), rad.
    """
    stiffness = structure.sheet.youngs_modulus * structure.bar_area * structure.bar_length
    stiffness = stiffness * (not structure.membranes)  # which take the place of bars
    parts, first = [stiffness * structure.bar_law.energy(1.0 + strain)], 0
    for kind in structure.hinge_kinds:
        own = slice(first, first + len(kind.nodes))
        parts.append(kind.stiffness * kind.energy(angles[:, own], rest[:, own]))
        first = own.stop
    pairs = np.vstack([structure.bars, structure.folds[:, :2], structure.bends[:, :2]])
    beside = shares(pairs, structure.triangles, structure.triangle_panel)
    triangle = 0.5 * np.linalg.norm(double_areas(structure.nodes, structure.triangles), axis=1)
    area = np.bincount(structure.triangle_panel, triangle)
    coupled = membranes.energies(
        structure.membranes, structure.edge_gives, structure.nodes, displacement, len(area)
    )
    return (np.hstack(parts) @ beside + coupled) / area


def shares(pairs: NDArray, triangles: NDArray, panel: NDArray) -> sparse.csr_array:
    """Parts (k, m) of what lies along pairs of nodes (k, 2) that belong to each panel."""
    sides = np.stack([triangles, np.roll(triangles, -1, axis=1)], axis=2).reshape(-1, 2)
    count = int(triangles.max(initial=0)) + 1
    of_side, of_pair = (np.sort(rows, axis=1) @ [count, 1] for rows in (sides, pairs))
    key, place = np.unique(of_pair, return_inverse=True)
    at = np.minimum(np.searchsorted(key, of_side), len(key) - 1)
    found = key[at] == of_side
    shape = (len(key), int(panel.max(initial=0)) + 1)
    ones = np.ones(int(found.sum()))
    beside = sparse.csr_array((ones, (at[found], np.repeat(panel, 3)[found])), shape=shape)
    total = np.maximum(beside.sum(axis=1), 1.0)
    return (sparse.diags_array(1.0 / total) @ beside).tocsr()[place]


def energies(case: Case, result: Any) -> dict[str, NDArray]:
    """Energies of a result (samples), J, by what they are, those that it has."""
    names = {"kinetic": "kinetic", **case.energy_groups, "dissipated": "dissipated"}
    names |= {"air": "lost to the air", "work": "work"}
    return {
        text.removeprefix("strain energy of ").removeprefix("the "): np.asarray(result[name])
        for name, text in names.items()
        if name in result
    }
