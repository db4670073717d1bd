"""`fidelity`: accuracy of bar-and-hinge models of a case, compared with its shell."""

from __future__ import annotations

import time
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np
import xarray
from numpy.typing import NDArray

from foldyn.algebra.extrapolation import convergence, limits
from foldyn.algebra.superlu import factorize
from foldyn.arguments import brief
from foldyn.cases import Case
from foldyn.cases.clamped_edges import straightened
from foldyn.cases.models import SHELL, SUPERELEMENTS
from foldyn.condensation import Superelements
from foldyn.errors import InputError, quietly, warn, within
from foldyn.linear.compared import OWN, Fidelity
from foldyn.linear.linearized import amplitude_of, linearize
from foldyn.linear.model_error import other_level
from foldyn.linear.operating_point import BALANCED
from foldyn.linear.reference import (
    SPARE,
    Reference,
    is_graded,
    matched,
    modes_at_rest,
    reference_modes,
    superelement_modes,
    touched_clamp,
)
from foldyn.linear.shell_of import (
    check_reduced,
    graded_meshes,
    meshes,
    shell_of,
    superelements_of,
    with_structure,
)
from foldyn.materials import Superlinear
from foldyn.materials.law import Law
from foldyn.mechanics.following import following_force, joined
from foldyn.results import fidelity_dataset
from foldyn.structures import ModelOptions, discretize
from foldyn.structures.beyond_range import BELOW, plate_frequency
from foldyn.structures.discretized import Discretized
from foldyn.values import choice, listed, show, whole

PLATE = {
    "scheme": "n5b8", "calibration": "plate", "mass": "consistent", "bend_law": "linear",
    "membrane": "panel", "bar_law": "linear",
}  # fmt: skip
MODELS: Mapping[str, Mapping[str, Any]] = {
    "standard": {
        "scheme": "n5b8", "calibration": "standard", "mass": "mixed_voronoi", "bend_law": "linear",
        "straight": (), "membrane": "bars", "bar_law": "ogden",
    },
    "plate": PLATE,
    "n5b8e": {**PLATE, "scheme": "n5b8e", "mass": "condensed"},
    "bars": {
        "scheme": "n5b8e", "calibration": "plate", "mass": "condensed", "bend_law": "linear",
        "membrane": "bars",
    },
}  # fmt: skip
"""Models compared with the case's model: arguments of `discretize` that replace the case's own.

"bars" is "n5b8e" with bars alone resisting stretching."""
REFERENCES = (SUPERELEMENTS, SHELL)
"""What models are compared with."""
BESIDE = ("standard", "plate", "n5b8e")
"""Models compared by default."""
SHOWN = ("calibration", "mass", "bend_law")
"""Options that distinguish models in tables."""
BEYOND = 2  # additional modes of the shell, computed but not compared


def fidelity(
    case: Case,
    count: int = 6,
    *,
    reference: str = SUPERELEMENTS,
    divisions: Sequence[int] | None = None,
    models: Sequence[str] | Mapping[str, Mapping[str, Any]] | None = None,
    secant: float | None = None,
    vertex_radius: float | None = None,
    progress: Callable[[str], None] = lambda step: None,
) -> Fidelity:
    """Compare bar-and-hinge models with superelements, or with the shell, for a given case.

    The reference has the pattern, sheet, creases, supports, loads and masses of the case, and a
    consistent mass. Its lowest elastic modes about rest are paired with the modes of each model by
    their MAC at shared nodes. If forces act and supports hold the sheet, displacements along small
    forces are compared too. Superelements estimate their own errors. Modes of the shell are
    extrapolated from two meshes; a third one, half as fine, gives the order of convergence, and
    from it the shell's error, or reveals that the shell has not converged.

    Parameters
    ----------
    case : Case
        Case of bars and hinges, from `discretize`. Histories and damping are ignored; loads act in
        full.
    count : int
        Number of elastic modes of the reference.
    reference : {"superelements", "shell"}
        What the models are compared with. Superelements approach a shell on a fine mesh, in a
        fraction of its time.
    divisions : (int, int), optional
        Only for the shell: pieces of every edge in the two finer meshes, by default (6, 12), or
        fewer, with a warning, if many panels would make the shell large.
    models : sequence of str, or mapping of str to mapping, optional
        Models compared in addition to the case's own model: names from
        `foldyn.linear.fidelity.MODELS`, by default "standard", "plate" and "n5b8e" as far as they
        accept the case's other options; or, by name, arguments of `discretize` that replace those
        of the case.
    secant : float, optional
        Amplitude (degrees) of superlinear hinges, which have no stiffness at rest; as in `modes`.
    vertex_radius : float, optional
        Radius (m) within which corners of panels are rigid in their plane, as in `superelements`
        and `shell`; the thickness, the default of superelements, is a good choice. Shells then have
        meshes graded toward vertices, by default with 4, 8 and 12 divisions, and frequencies are
        extrapolated with the observed order. Large supported sheets, and towers, converge only with
        such a radius.
    progress : callable
        Called with the name of each step.

    Returns
    -------
    Fidelity
        Printed, a table; `holds_to` is the frequency up to which a model is within 10 %.

    Raises
    ------
    InputError
        The case is not one of bars and hinges, its structure was changed by hand, the sheet has no
        density, or nodes other than vertices are named; a panel cannot be meshed; an
        argument is out of range.

    Warns
    -----
    FoldynWarning
        The shell is coarser than (6, 12); the rest state is not an equilibrium.

    Examples
    --------
    >>> import foldyn as fd
    >>> pattern = fd.patterns.simple_fold(a=1.0, b=1.0, dihedral=60)
    >>> sheet = fd.Sheet(1e6, 0.25, 0.01, density=1000.0)
    >>> case = fd.Case(fd.discretize(pattern, sheet), [fd.Fix([0, 1, 2, 3])])
    >>> result = fd.fidelity(case, count=3, models=["plate"])
    >>> [f"{100 * mode.error:+.1f} %" for mode in result.table("plate")]
    ['...', ...]
    """
    checked = comparison(case, count, reference, divisions, models, secant, vertex_radius)
    return checked.run(progress)


@brief
@dataclass(frozen=True, eq=False)
class Comparison:
    """A checked comparison, not yet computed.

    Attributes
    ----------
    case : Case
        Case as given.
    count : int
        Number of modes of the reference.
    references : tuple of Case
        The case with superelements, or with shells of three meshes, finest last, with forces as its
        only loads.
    compared : mapping of str to Case
        The case with each model, starting with its own, with the same loads.
    not_forces : tuple of int
        Numbers of the loads left out.
    secant : float or None
    """

    case: Case
    count: int
    references: tuple[Case, ...]
    compared: Mapping[str, Case]
    not_forces: tuple[int, ...]
    secant: float | None

    def run(self, progress: Callable[[str], None] = lambda step: None) -> Fidelity:
        """Compute the comparison; `progress` is called with the name of each step."""
        began = time.perf_counter()
        true, facts = self._reference(progress)
        count = min(self.count, len(true.frequency))
        if not count:
            raise InputError(": its sheet has no vibrations; free some of its nodes", "case")
        found = {}
        for name, held in self.compared.items():
            progress(f"model {name}")
            found[name] = modes_at_rest(held, count + SPARE, self.secant)
        _warn_of_imbalance(found[OWN].attrs["residual"])
        pairs = [matched(true, count, held, found[name]) for name, held in self.compared.items()]
        error = np.stack([pair.error for pair in pairs], axis=1)
        values: dict[str, Any] = {
            "frequency": true.frequency[:count],
            "mesh_error": true.mesh_error[:count],
            "error": np.where(np.isnan(error), np.inf, error),
            "mac": np.stack([pair.mac for pair in pairs], axis=1),
            "options": [_told(held, self.compared[OWN]) for held in self.compared.values()],
            "soft_hinges": [one.attrs["soft_hinges"] for one in found.values()],
        }
        if self.compared[OWN].loads and _held(true.found):
            progress("small loads")
            values |= self._deflections([name for name, one in found.items() if _held(one)])
        limit = plate_frequency(self.case.structure.pattern, self.case.structure.sheet)
        facts |= {
            "limit": BELOW * limit,
            "plate_frequency": limit,
            "vertex_radius": true.case.structure.options.vertex_radius,
            "touched_clamp": touched_clamp(true.case.structure),
            "rigid": int((true.found["eigenvalue"] <= 0.0).sum()),
            "secant": self.secant,
            "not_forces": ", ".join(f"loads[{i}]" for i in self.not_forces) or None,
            "residual": found[OWN].attrs["residual"],
            "wall_seconds": time.perf_counter() - began,
        }
        return Fidelity(fidelity_dataset(self.case, list(self.compared), values, facts))

    def _reference(self, progress: Callable[[str], None]) -> tuple[Reference, dict[str, Any]]:
        """Modes of the reference, two more than are compared, and facts about it."""
        structure = self.references[-1].structure
        if isinstance(structure, Superelements):
            progress(f"superelements of level {structure.options.level}")
            true = superelement_modes(self.references[-1], self.count + BEYOND)
            return true, {"reference": SUPERELEMENTS, "level": structure.options.level}
        divisions = [one.structure.options.divisions for one in self.references]
        progress("shell with {}, {} and {} divisions".format(*divisions))
        facts = {"divisions": divisions[1:], "triangles": len(structure.triangles)}
        true = reference_modes(self.references, self.count + BEYOND)
        return true, {"reference": SHELL, **facts}

    def _deflections(self, held: Sequence[str]) -> dict[str, Any]:
        """Displacements along the forces: work divided by the sum of the forces on nodes.

        held : names of the models without free motions.
        """
        works = np.array([small_loads(case).work for case in self.references])
        if len(works) == 1:
            (case,) = self.references
            lower = small_loads(case.altered(structure=other_level(case.structure))).work
            true, mesh_error = works.item(), lower / works.item() - 1.0
        else:
            divisions = [one.structure.options.divisions for one in self.references]
            true = limits(works[:, None], divisions, observed=is_graded(self.references[-1])).item()
            mesh_error = works[2] / convergence(works[:, None], divisions).limit.item() - 1.0
        own = np.array([
            small_loads(case, self.secant).work if name in held else np.inf
            for name, case in self.compared.items()
        ])  # fmt: skip
        return {
            "deflection": true / float(np.abs(rest_forces(self.compared[OWN])).sum()),
            "deflection_mesh_error": mesh_error,
            "deflection_error": own / true - 1.0,
        }


def comparison(
    case: Case, count: int = 6, reference: str = SUPERELEMENTS,
    divisions: Sequence[int] | None = None,
    models: Sequence[str] | Mapping[str, Mapping[str, Any]] | None = None,
    secant: float | None = None, vertex_radius: float | None = None,
) -> Comparison:  # fmt: skip
    """Check a comparison and make its structures; arguments as in `fidelity`."""
    count = whole("count", count, least=1)
    amplitude_of(secant)  # refuses what is none
    check_reduced(case)
    forces, others = forces_alone(case)
    compared = _compared(forces, models)
    for name, held in compared.items():
        with within("" if name == OWN else f"models: {name}: "):
            held.check_movable()
    if choice("reference", reference, REFERENCES) == SHELL:
        if vertex_radius is None:
            coarse, fine = meshes(case.structure.pattern, divisions)
        else:
            coarse, fine = graded_meshes(divisions)
        references = [shell_of(forces, n, vertex_radius) for n in (coarse // 2, coarse, fine)]
    elif divisions is not None:
        raise InputError(
            f' = {show(divisions)}: are those of the shell; give reference = "shell" too, or leave '
            "them out",
            "divisions",
        )
    else:
        references = [superelements_of(forces, vertex_radius=vertex_radius)]
    return Comparison(case, count, tuple(references), compared, tuple(others), secant)


def _held(found: xarray.Dataset) -> bool:
    """Whether every motion has stiffness."""
    return bool((found["eigenvalue"] > 0.0).all())


def _compared(case: Case, models: Any) -> dict[str, Case]:
    """The case with its own model and with other models, without a model equal to its own."""
    structure = case.structure
    compared = {OWN: with_structure(case, structure)}
    _ = structure.mass  # the mass rule may refuse this pattern: fail early
    for name, changes in named(models, structure).items():
        law = {"bar_law": None} if "membrane" in changes else {}  # follows the membrane
        options = {**vars(structure.options), **law, **changes}
        with within(f"models: {name}: "):
            options |= straightened(ModelOptions(**options), structure.pattern, case.supports)
            if options == vars(structure.options):
                continue
            other = discretize(structure.pattern, structure.sheet, **options)
            _ = other.mass
        compared[name] = with_structure(case, other)
    return compared


def named(models: Any, structure: Discretized) -> Mapping[str, Mapping[str, Any]]:
    """Arguments of `discretize` by the name of the model.

    By default the models of `BESIDE` that accept the other options of the structure.
    """
    if models is None:
        refused = any(isinstance(law, Superlinear) for law, _ in structure.fold_law.parts)
        return {name: MODELS[name] for name in BESIDE if name != "n5b8e" or not refused}
    if isinstance(models, Mapping):
        for name, changes in models.items():
            if not isinstance(name, str) or name == OWN or not isinstance(changes, Mapping):
                raise InputError(
                    f": {show(name)}: give arguments of discretize by the name of the model, as "
                    '{"stiff": {"calibration": "standard"}}; "own" is the model of the case',
                    "models",
                )
            for key in changes:
                choice(f"models: {name}: argument", key, vars(structure.options))
        return models
    names = listed("models", models, 'names, as ["plate"]')
    return {choice("models", name, MODELS): MODELS[name] for name in names}


def _told(case: Case, own: Case) -> str:
    """Options of a model, in case file syntax, that distinguish it from others."""
    options, others = vars(case.structure.options), vars(own.structure.options)
    usual = options["scheme"] == others["scheme"] == MODELS["plate"]["scheme"]
    further = (key for key in options if options[key] != others[key])
    keys = dict.fromkeys([*(() if usual else ("scheme",)), *SHOWN, *further])
    return ", ".join(f"{key} = {_written(options[key])}" for key in keys)


def _written(value: Any) -> str:
    return show(value.name if isinstance(value, Law) else value)


def _warn_of_imbalance(residual: float) -> None:
    if residual > BALANCED:
        warn(
            f"the rest state is no equilibrium: its residual is {residual:.2g} of the forces at "
            "play (creases with a rest angle of their own, or laws that have a moment at rest); "
            "the vibrations compared are not free ones",
            "fidelity.md#your-own-pattern",
        )


class SmallLoads(NamedTuple):
    """Linear response of the sheet, with its stiffness at rest, to its forces at factor 1.

    Attributes
    ----------
    work : float
        Forces times displacements, J.
    displacement : float
        Mean displacement along the forces, weighted by the forces, m.
    """

    work: float
    displacement: float


def forces_alone(case: Case) -> tuple[Case, list[int]]:
    """The case with only the loads that are forces, and the numbers of the other loads.

    Nodal forces, gravity and pressure are kept; loads that turn or heat parts are not.
    """
    structure = case.structure
    others = []
    for i, load in enumerate(case.loads):
        place = f"loads[{i}]"
        part = load.following(structure, place)
        turns = part is not None and any(map(len, (part.moment, part.tension, part.push)))
        changes = load.rest_changes(structure, place) is not None
        if turns or changes or load.turns(structure, place) is not None:
            others.append(i)
    kept = [load for i, load in enumerate(case.loads) if i not in others]
    return case.altered(loads=kept), others


def rest_forces(case: Case) -> NDArray:
    """Forces, N, of a case's loads in full on all of its dofs, in its rest state."""
    nodes = case.structure.nodes
    at_rest = case.body.dofs(np.zeros_like(nodes))
    total = np.zeros(at_rest.size)
    for force, _ in case.load_terms:
        total[: nodes.size] += force.ravel()
    following = joined((part, 0) for part, _ in case.following_terms)
    if not following.acts:
        return total
    return total + following_force(following, at_rest, np.ones((1, 1)))


def small_loads(case: Case, secant: float | None = None) -> SmallLoads:
    """Work of a case's forces in the linear equilibrium about rest.

    Parameters
    ----------
    case : Case
        Supports and hinges of the case must resist every motion.
    secant : float, optional
        As in `modes`.
    """
    with quietly():
        linear = linearize(case, secant=secant)
    force = rest_forces(case)
    free = linear.projected(force)
    work = float(free @ factorize(linear.stiffness).solve(free))
    return SmallLoads(work, work / float(np.abs(force).sum()))
