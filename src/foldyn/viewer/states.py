"""Crease angles and panel energies at all samples of a result, and the fields that color them."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import NamedTuple

import numpy as np
import xarray as xr
from numpy.typing import NDArray
from scipy import sparse

from foldyn.cases import Case
from foldyn.cases.case_assembly import SomeLoads
from foldyn.dynamics.sampling import CONTACT_FORCE
from foldyn.errors import ComputationError
from foldyn.materials.prony import CreaseDampers
from foldyn.materials.series import in_series
from foldyn.mechanics import angles
from foldyn.mechanics.following import following_force, joined
from foldyn.mechanics.heat import free_energies
from foldyn.strength.dataset import largest_of_panels
from foldyn.structures import Structure, membranes
from foldyn.structures.discretized import Discretized
from foldyn.structures.mesh import double_areas


class States(NamedTuple):
    """States (samples, ...) of panels and creases; some creases have several of the k hinges.

    turn : rotation (samples, nf) from rest, without the rotation of the adjacent panels, rad.
    moment : of the whole crease, N m.
    pairs, energy : ends (k, 2) of the hinges and their energies (samples, k), J.
    plates : energy (samples, p) of each panel if it is a plate, or of each triangle of a shell, J.
    rest : rest angles (samples, nr), which loads may change, rad.
    stress, free : thermal stress of single bars divided by Young's modulus (samples, nb), and
    stress-free Green strains of membranes (samples, .); without columns if no panel is warm.
    """

    turn: NDArray
    moment: NDArray
    pairs: NDArray
    energy: NDArray
    plates: NDArray
    rest: NDArray
    stress: NDArray
    free: NDArray


def memory_acts(case: Case, result: xr.Dataset) -> bool:
    """Whether creases have memory; dampers in series with panels need a motion or timed path."""
    passes = "time" in result.sizes or "elapsed" in result
    return any(passes or not isinstance(part.law, CreaseDampers) for part in case.remembering)


def creases_known(case: Case, result: xr.Dataset) -> bool:
    """Whether displacements determine the rotation of creases.

    Displacements do not determine it if panels yield next to creases that have memory or, in
    motions, dampers.
    """
    sheet = case.body.sheet
    give = len(sheet.hidden) > 0 or bool(sheet.fold_hinges().softness.any())
    damped = "time" in result.sizes and bool(case.crease_damping.any())
    return not (give and (damped or memory_acts(case, result)))


def states(case: Case, result: xr.Dataset, displacement: NDArray) -> States:
    """States at displacements (samples, n, 3), m, with massless unknowns in equilibrium."""
    body, structure, kind = case.body, case.structure, case.structure.hinge_kinds[0]
    samples = len(displacement)
    acting = list(_acting(case, result, samples))
    rest = np.tile(body.sheet.rest_angles, (samples, 1))
    for load, factor in acting:
        for change, _ in load.rest_terms:
            rest += np.outer(factor, change)
    changes, hinges = rest - body.sheet.rest_angles, body.sheet.fold_hinges()
    angle = hinge_angles(structure, hinges.nodes, displacement)
    plates, (stress, free, curl) = np.zeros((samples, 0)), _warm(acting, samples)
    # also for a shell with rigid panels
    if len(body.hidden) or not isinstance(structure, Structure):
        each = ((part, k) for k, (load, _) in enumerate(acting) for part, _ in load.following_terms)
        pushes, factors = joined(each), np.reshape([f for _, f in acting], (-1, samples))
        hidden, none = np.zeros(len(body.hidden)), sparse.csr_array((0, len(body.hidden)))
        found, kept = [], []
        for k, u in enumerate(displacement):
            here = body.folded(rest[k]) if changes[k].any() else body
            push = following_force(pushes, np.append(u, hidden), factors[:, k : k + 1])
            q = here.dofs(u, push, held=(hidden, none), kept=kept)
            hidden = q[body.hidden]
            there = np.minimum(hinges.hidden, body.size)
            angle[k] -= (np.append(q, 0.0)[there] * hinges.hidden_turn).sum(axis=1)
            found.append(here.sheet.plate_energies(q, curl[k]))
        plates = np.array(found)
    if count := body.sheet.offsets:
        angle += changes[:, -count:] + body.sheet.rest_angles[-count:]
    share, at_rest = kind.share[hinges.fold], hinges.rest + changes[:, hinges.fold]
    energy, moment = hinges.stiffness * np.array(in_series(kind.law, angle, at_rest, share))
    turn = (angle - hinges.softness * moment - hinges.rest) * hinges.share
    places = (np.arange(len(hinges.fold)), hinges.fold)
    shape = len(hinges.fold), len(structure.folds)
    of_crease = sparse.csr_array((np.ones(len(hinges.fold)), places), shape)
    turned, pairs = (turn @ of_crease, moment @ of_crease), hinges.nodes[:, :2]
    return States(*turned, pairs, energy, plates, rest, stress, free)


def _acting(case: Case, result: xr.Dataset, samples: int) -> Iterator[tuple[SomeLoads, NDArray]]:
    """Each load of a case with its factor (samples,)."""
    constant = set(np.atleast_1d(result.attrs.get("constant", [])).astype(int).tolist())
    for k, load in enumerate(case.loads):
        factor = np.ones(samples)
        if "time" in result.sizes:
            factor = load.history(result["time"].values)
        elif k not in constant:
            factor = result["load_factor"].values
        yield SomeLoads(case, [k]), factor


def _warm(acting: Sequence[tuple[SomeLoads, NDArray]], samples: int) -> list[NDArray]:
    """Stresses of single bars, free strains and free angles of warm panels, (samples, .) each."""
    warm = [(factor, own) for load, factor in acting for own, _ in load.swellings]
    kinds = [(factor, (own.stress, *own.free)) for factor, own in warm]
    none = np.zeros((samples, 0))
    if not kinds:
        return [none] * 3
    return [np.sum([np.outer(factor, of[k]) for factor, of in kinds], axis=0) for k in range(3)]


def hinge_angles(structure: Discretized, hinges: NDArray, displacement: NDArray) -> NDArray:
    """Dihedrals (samples, k) of hinges (k, 4), rad."""
    rows = hinges.astype(np.uint32)
    found = [angles(structure.nodes + u, rows) for u in displacement]
    return np.reshape(found, (len(displacement), len(rows)))


def bar_strain(structure: Discretized, displacement: NDArray) -> NDArray:
    """Elongation of bars divided by their length (samples, nb)."""
    i, j = structure.bars.T
    apart = structure.nodes[j] - structure.nodes[i] + displacement[:, j] - displacement[:, i]
    return np.linalg.norm(apart, axis=2) / structure.bar_length - 1.0


def energy_density(structure: Discretized, displacement: NDArray, found: States) -> NDArray:
    """Strain energy of each panel divided by its area (samples, m), J/m2.

    The energy of a bar or hinge is split equally between the adjacent triangles; springs, and
    clamped edges of models without plates, are left out.

    displacement : (samples, n, 3), m
    """
    panel, pairs, parts = structure.triangle_panel, [found.pairs], [found.energy]
    triangle = 0.5 * np.linalg.norm(double_areas(structure.nodes, structure.triangles), axis=1)
    area = np.bincount(panel, triangle)
    panels = membranes.energies(
        structure.membranes, structure.nodes, displacement, len(area),
        found.free if found.free.shape[1] else None,
    )  # fmt: skip
    if isinstance(structure, Structure):
        if not structure.membranes:
            stiffness = structure.sheet.youngs_modulus * structure.bar_area * structure.bar_length
            strain, law = bar_strain(structure, displacement), structure.bar_law
            energy = law.energy(1.0 + strain)
            if found.stress.shape[1]:
                addresses = np.array(law.addresses or (0, 0, 0), np.int64)
                lacking = free_energies(law.code, found.stress.ravel(), addresses)
                energy += lacking.reshape(strain.shape)
                energy -= found.stress * strain * (1.0 + 0.5 * strain)
            pairs.append(structure.bars)
            parts.append(stiffness * energy)
        if found.plates.shape[1]:
            panels += found.plates
        else:
            bends, first = structure.hinge_kinds[1], len(structure.folds)
            angle = hinge_angles(structure, structure.bends, displacement)
            rest = found.rest[:, first : first + len(structure.bends)]
            pairs.append(structure.bends[:, :2])
            parts.append(bends.stiffness * bends.energy(angle, rest))
    else:
        of_panel = sparse.csr_array((np.ones(len(panel)), (np.arange(len(panel)), panel)))
        panels += found.plates @ of_panel
    beside = shares(np.vstack(pairs), structure.triangles, panel)
    return (np.hstack(parts) @ beside + panels) / area


def shares(pairs: NDArray, triangles: NDArray, panel: NDArray) -> sparse.csr_array:
    """Share (k, m) of the element along each pair of nodes (k, 2) that belongs to each panel."""
    if not len(pairs):
        return sparse.csr_array((0, int(panel.max(initial=-1)) + 1))
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


class Field(NamedTuple):
    """Values (samples, elements) with texts for the legend.

    on : "node", "panel", "crease" or "bar".
    signed : whether both signs occur.
    """

    label: str
    unit: str
    on: str
    values: NDArray
    signed: bool


def fields(case: Case, result: xr.Dataset, displacement: NDArray) -> dict[str, Field]:
    """Fields of a motion or path with displacements (samples, n, 3), by name.

    Fields that displacements do not determine are left out. These are moments and energies if laws
    have memory. They are crease angles too if panels yield next to creases with memory or (in
    motions) with dampers, if panels reach no equilibrium, or in linear models, whose creases also
    turn between vertices. Speeds are not included: the page
    computes them from displacements.
    """
    structure, out = case.structure, {}
    if CONTACT_FORCE in result:
        out["contact"] = Field("force of contact", "N", "node", result[CONTACT_FORCE].values, False)
    if isinstance(structure, Structure):
        out["bar_strain"] = _strain_field(bar_strain(structure, displacement))
    if structure.linear or not creases_known(case, result):
        return out
    try:
        found = states(case, result, displacement)
    except ComputationError:  # a motion that has diverged: its panels no longer reach equilibrium
        return out
    out["turn"] = Field("turn of creases from rest", "°", "crease", np.degrees(found.turn), True)
    if not memory_acts(case, result):
        out["fold_moment"] = Field("moment of creases", "N m", "crease", found.moment, True)
        density = energy_density(structure, displacement, found)
        out["energy"] = Field("strain energy per area", "J/m²", "panel", density, False)
    return out


def stress_fields(found: xr.Dataset) -> dict[str, Field]:
    """Fields of stresses along a motion or a path: the largest of each panel, and of creases."""
    out = {}
    if "von_mises" in found:
        values = largest_of_panels(found, found["von_mises"].values)
        out["von_mises"] = Field("von Mises stress", "Pa", "panel", values, False)
    moment = found["crease_moment"].values
    out["crease_moment"] = Field("moment of creases per length", "N", "crease", moment, True)
    return out


def folding_fields(case: Case, displacement: NDArray, fold_angle: NDArray) -> dict[str, Field]:
    """Fields of a folding by name: only fold angles (samples, nc), rad, for lack of a sheet."""
    angle = np.degrees(fold_angle)
    return {
        "bar_strain": _strain_field(bar_strain(case.structure, displacement)),
        "turn": Field("fold angle of creases, valleys positive", "°", "crease", angle, True),
    }


def _strain_field(strain: NDArray) -> Field:
    return Field("strain of bars", "1", "bar", strain, True)


def energies(case: Case, result: xr.Dataset) -> dict[str, NDArray]:
    """Energies (samples) that a result contains, by name, J."""
    names = {"kinetic": "kinetic", **case.energy_groups, "dissipated": "dissipated"}
    names |= {"air": "lost to the air", "work": "work"}
    return {
        text.removeprefix("strain energy of ").removeprefix("the "): np.asarray(result[name])
        for name, text in names.items()
        if name in result
    }
