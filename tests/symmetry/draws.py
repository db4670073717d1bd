"""Cases at random: a pattern, a model, and supports, loads and dampings of all registered kinds.

Parts are drawn field by field, by the names of the fields in `FIELDS`, from the registries: what
the library refuses is drawn again. Sizes follow from the pattern and from the motion: `Scene` has a
time, and forces that move the sheet by a small part of its size within it.
"""

from __future__ import annotations

import inspect
from collections.abc import Callable, Mapping, Sequence
from contextlib import suppress
from dataclasses import MISSING, dataclass, fields, replace
from typing import Any, NamedTuple

import numpy as np

import foldyn as fd
from foldyn.cases.damping import DAMPINGS
from foldyn.cases.histories import HISTORIES
from foldyn.cases.loads import LOADS
from foldyn.cases.reached import ReachedAngle
from foldyn.cases.supports import SUPPORTS
from foldyn.dynamics import METHODS
from foldyn.dynamics.driver import prepare
from foldyn.errors import ComputationError, InputError
from foldyn.materials import BAR_LAWS, HINGE_LAWS, MemoryLaw
from foldyn.materials.law import Law
from foldyn.structures.mass import MASS_RULES
from foldyn.structures.presets import PRESETS

SHELL = "shell"
MODELS = (*PRESETS, SHELL)
STATIC = "trace"
ANALYSES = (*METHODS, STATIC)
EXTRAS = ("springs", "memory", "contact", "air", "all")  # the last: the others together
MOST_NODES = 120  # of shells with a vertex radius, for time
TRIES = 12  # of a part, until the library takes it
SMALL = 0.02  # of the pattern's size: displacements
ALWAYS = {"BaseMotion.value", "Air.density", "Air.resolution", "Cable.sliding_speed"}
"""Drawn: a meter by default is as large as the sheet, air is light, and its flow takes long.

Friction that sets in at 1 mm/s needs finer steps than these motions have."""
LEAST = 1e-6  # of that size: the largest displacement, or there is nothing to compare
STEPS = 40  # of implicit methods; as many samples, so that contact is seen when it sets in


@dataclass(frozen=True)
class Scene:
    """What sizes follow from: a structure, a time (s), a force (N), a mass (kg), a length (m)."""

    rng: Any
    structure: Any
    time: float
    force: float
    mass: float
    size: float

    def some(self, count: int, most: int = 3) -> list[int]:
        """Some of a number of things."""
        most = min(most, count)
        return self.rng.choice(count, self.rng.integers(1, most + 1), replace=False).tolist()

    def pairs(self, edges) -> list[list[int]]:
        return [edges[k].tolist() for k in self.some(len(edges))]

    def vector(self, size: float) -> list[float]:
        return (size * self.rng.normal(size=3)).tolist()

    def each(self, value: float, given: Any) -> Any:
        """Values about as large, of either sign: one, or one for each of what is given."""
        size = None if self.rng.random() < 0.5 else len(given)
        return (value * self.rng.normal(size=size)).tolist() if size else self.about(value)

    def about(self, value: float) -> float:
        return float(value * self.rng.uniform(0.5, 1.5) * self.rng.choice((-1.0, 1.0)))

    def positive(self, value: float) -> float:
        return abs(self.about(value))

    @property
    def pattern(self) -> fd.Pattern:
        return self.structure.pattern

    @property
    def moment(self) -> float:
        return self.force * self.size


def _angles(s: Scene, given: dict) -> list[float]:
    """Dihedrals (degrees) near those at rest."""
    creases = given["creases"]
    return np.degrees(
        s.structure.fold_rest[creases] + s.rng.uniform(-0.1, 0.1, len(creases))
    ).tolist()


def _line(s: Scene) -> list[Any]:
    """Some vertices, one after the other, and perhaps a point on the ground."""
    count = len(s.pattern.vertices)
    line: list[Any] = s.rng.choice(count, min(count, 3), replace=False).tolist()
    return [*line, s.vector(s.size)] if s.rng.random() < 0.5 else line


def _until(s: Scene) -> Any:
    """A time, or an angle of a crease near that at rest."""
    if s.rng.random() < 0.5:
        return s.time * s.rng.uniform(0.2, 2.0)
    crease = int(s.rng.integers(len(s.pattern.creases)))
    return ReachedAngle(crease, float(np.degrees(s.structure.fold_rest[crease]) + s.about(1.0)))


def _layer(s: Scene) -> list[float]:
    return [s.positive(0.5 * s.structure.sheet.thickness), s.positive(1e6), s.positive(1e-8)]


def _axes(s: Scene) -> str:
    return "".join(sorted(s.rng.choice([*"xyz"], s.rng.integers(1, 4), replace=False)))


# the free strain of two halves of a temperature is that of the whole to its first order only, so
# that expansions are small
FIELDS: Mapping[str, Callable[[Scene, dict], Any]] = {
    "nodes": lambda s, _: s.some(len(s.pattern.vertices)),
    "between": lambda s, _: [s.rng.choice(len(s.pattern.vertices), 2, replace=False).tolist()],
    "to": lambda s, _: list(s.pattern.faces[s.rng.integers(len(s.pattern.faces))])[:3],
    "edges": lambda s, _: s.pairs(s.pattern.edges),
    "panels": lambda s, _: s.some(len(s.pattern.faces)),
    "creases": lambda s, _: s.some(len(s.pattern.creases)),
    "vector": lambda s, _: s.vector(s.force),
    "total": lambda s, _: s.vector(s.force),
    "force_per_length": lambda s, _: s.vector(s.force / s.size),
    "acceleration": lambda s, _: s.vector(s.force / s.mass),
    "direction": lambda s, _: s.vector(1.0) if s.rng.random() < 0.8 else "-z",
    "axes": lambda s, _: _axes(s),
    "along": lambda s, _: bool(s.rng.random() < 0.5),
    "axis": lambda s, _: str(s.rng.choice([*"xyz"])),
    "pressure": lambda s, _: s.about(s.force / s.pattern.face_areas.mean()),
    "moment": lambda s, given: s.each(s.moment, given["creases"]),
    "angle": _angles,
    "fold_angle": lambda s, given: (180.0 - np.array(_angles(s, given))).tolist(),
    "fraction": lambda s, _: float(s.rng.uniform(0.0, 0.05)),
    "change": lambda s, _: s.about(10.0),
    "expansion": lambda s, _: s.about(2e-8),
    "curvature": lambda s, _: s.about(2e-3 / s.size),
    "layers": lambda s, _: [_layer(s), _layer(s)],
    "Stop.side": lambda s, _: str(s.rng.choice(["below", "above"])),
    "Stop.stiffness": lambda s, _: s.positive(s.moment),
    "Stop.damping": lambda s, _: s.positive(0.1 * s.force * s.time),
    "Latch.stiffness": lambda s, _: s.positive(s.moment),
    "release": lambda s, _: s.positive(0.05 * s.moment),
    "until": lambda s, _: _until(s),
    "Impose.value": lambda s, given: s.each(0.5 * SMALL * s.size, given["nodes"]),
    "BaseMotion.value": lambda s, _: s.about(0.5 * SMALL * s.size),
    "history": lambda s, _: drawn(s, HISTORIES.values()),
    "stiffness": lambda s, _: s.positive(s.force / SMALL / s.size),
    "rest_length": lambda s, _: s.positive(s.size),
    "Cable.nodes": lambda s, _: _line(s),
    "Cable.pretension": lambda s, _: s.positive(s.force),
    "Bar.stiffness": lambda s, _: s.positive(s.force / SMALL),
    "Bar.area": lambda s, _: s.positive(s.size**2),
    "Bar.modulus": lambda s, _: s.positive(s.force / SMALL / s.size**2),
    "Bar.law": lambda s, _: str(s.rng.choice([*BAR_LAWS])),
    "Cable.stiffness": lambda s, _: s.positive(s.force / SMALL),
    "bending": lambda s, _: s.positive(s.force * s.size**2),
    "Spring.change": lambda s, _: s.about(SMALL * s.size),
    "Cable.change": lambda s, _: s.about(SMALL * s.size),
    "Cable.friction": lambda s, _: s.positive(0.3),
    "Cable.sliding_speed": lambda s, _: s.rng.uniform(0.1, 0.5) * s.size / s.time,
    "stiffness_history": lambda s, _: drawn(s, HISTORIES.values()),
    "Dashpot.coefficient": lambda s, _: s.positive(s.mass / s.time),
    "CreaseDamping.coefficient": lambda s, _: s.positive(s.force * s.time),
    "mass": lambda s, _: s.positive(s.mass),
    "alpha": lambda s, _: s.positive(1.0 / s.time),
    "beta": lambda s, _: s.positive(1e-4 * s.time),
    "state": lambda s, _: str(s.rng.choice(["rest", "initial"])),
    "ModalDamping.ratios": lambda s, _: s.positive(0.05) if s.rng.integers(2) else [0.1, 0.05],
    "count": lambda s, _: int(s.rng.integers(1, 4)),
    # of histories
    "duration": lambda s, _: s.time * s.rng.uniform(0.15, 0.9),
    "smooth": lambda s, _: bool(s.rng.random() < 0.7),
    "time": lambda s, _: s.time * s.rng.uniform(0.1, 0.8),
    "frequency": lambda s, _: s.positive(1.5 / s.time),
    "from_frequency": lambda s, _: s.positive(1.5 / s.time),
    "to_frequency": lambda s, _: s.positive(1.5 / s.time),
    "phase": lambda s, _: s.rng.uniform(-180.0, 180.0) * s.rng.integers(2),
    "Table.times": lambda s, _: s.time * np.linspace(0.0, 1.0, 6),
    "Table.values": lambda s, _: np.append(0.0, s.rng.normal(size=5)),
    # of laws
    "theta1": lambda s, _: s.rng.uniform(20.0, 50.0),
    "theta2": lambda s, _: s.rng.uniform(310.0, 340.0),
    "rest": lambda s, _: str(s.rng.choice(["stress_free", "as_published"])),
    "onset": lambda s, _: s.positive(3.0),
    "law": lambda s, _: drawn(s, [k for k in HINGE_LAWS.values() if not issubclass(k, MemoryLaw)]),
    "Prony.ratios": lambda s, _: [s.positive(0.3), s.positive(0.2)],
    "Prony.times": lambda s, _: [s.positive(0.1 * s.time), s.positive(s.time)],
    **dict.fromkeys(("yield_moment", "barrier_moment"), lambda s, _: s.positive(s.moment / s.size)),
    **dict.fromkeys(("isotropic", "kinematic"), lambda s, _: s.positive(s.moment / s.size)),
    "rate": lambda s, _: s.positive(0.1 / s.time),
    # of air
    "density": lambda s, _: s.positive(20.0),
    "velocity": lambda s, _: s.vector(0.05 * s.size / s.time),
    "added_mass": lambda s, _: [True, False, "local"][s.rng.integers(3)],
    "drag": lambda s, _: bool(s.rng.random() < 0.8),
    "drag_coefficient": lambda s, _: s.positive(1.0),
    "resolution": lambda s, _: 2,
}  # fmt: skip


def _number(scene: Scene, _: dict) -> float:
    """A number of a law that has no line above."""
    return scene.positive(1.0)


def drawn(scene: Scene, kinds: Any) -> Any:
    """A part of one of these kinds, with some of its fields."""
    kinds = list(kinds)
    kind = kinds[scene.rng.integers(len(kinds))]
    for _ in range(20 * TRIES):
        given: dict[str, Any] = {}
        for item in fields(kind):
            full = f"{kind.__name__}.{item.name}"
            needed = item.default is MISSING and item.default_factory is MISSING
            needed = needed or full in ALWAYS
            if item.name == "name" or not (needed or scene.rng.random() < 0.5):
                continue
            number = _number if issubclass(kind, Law) else None
            draw = FIELDS.get(full, FIELDS.get(item.name, number))
            assert draw is not None, f"say in FIELDS how to draw {kind.__name__}.{item.name}"
            try:
                given[item.name] = draw(scene, given)
            except KeyError:  # of what was not given
                break
        else:
            try:
                return kind(**given)
            except InputError:
                continue
    raise AssertionError(f"{kind.__name__} refuses all that was drawn")


# ------------------------------------------------------------------ patterns and models
def pattern_of(rng) -> fd.Pattern:
    """A fold, a Miura cell, random triangles, a tower, a pentagon beside a quad, or a star."""
    kinds = (_fold, _miura, _torn, _tower, _pentagons, _star)
    return kinds[rng.integers(len(kinds))](rng)


def _fold(rng) -> fd.Pattern:
    """Oblique: of two diagonals of one length some rules take the first, by definition."""
    fold = fd.patterns.simple_fold(b=rng.uniform(0.6, 1.4), dihedral=rng.uniform(50.0, 150.0))
    vertices = fold.vertices.copy()
    vertices[2:4, 1] += rng.uniform(0.1, 0.4)
    return fd.Pattern(vertices, fold.faces, fold.assignments)


def _miura(rng) -> fd.Pattern:
    return fd.patterns.miura(
        b=rng.uniform(0.7, 1.3), panel_angle=rng.uniform(50.0, 75.0), dihedral=rng.uniform(50, 140)
    )


def _torn(rng) -> fd.Pattern:
    """Two by two squares, cut at random into triangles."""
    points = np.array([[i, j, 0.0] for i in range(3) for j in range(3)])
    points += rng.uniform(-0.15, 0.15, points.shape)
    faces = []
    for a in (0, 1, 3, 4):
        b, c, d = a + 3, a + 4, a + 1
        cut = [(a, b, c), (a, c, d)] if rng.random() < 0.5 else [(a, b, d), (b, c, d)]
        faces += cut
    return fd.Pattern(points, faces)


def _tower(rng) -> fd.Pattern:
    return fd.patterns.kresling(
        sides=int(rng.integers(4, 6)), height=rng.uniform(0.8, 1.2), twist=rng.uniform(20.0, 40.0)
    )


def _pentagons(rng) -> fd.Pattern:
    """A pentagon and a quadrilateral on one side of it, folded."""
    flat = np.array([[0, 0], [1, 0], [1.2, 0.7], [0.5, 1.1], [-0.2, 0.8], [1.1, -0.9], [0.1, -1.0]])
    flat[[2, 3, 4, 5, 6]] += rng.uniform(-0.1, 0.1, (5, 2))
    points = np.column_stack([flat, np.zeros(7)])
    angle = rng.uniform(-1.5, 1.5)
    points[5:, 1:] = points[5:, 1:2] * [np.cos(angle), np.sin(angle)]
    return fd.Pattern(points, [(0, 1, 2, 3, 4), (1, 0, 6, 5)])


def _star(rng) -> fd.Pattern:
    """Three or four quadrilaterals about one edge, whose fronts are anywhere."""
    count, points, faces = int(rng.integers(3, 5)), [(0.0, 0.0, 0.0), (1.0, 0.0, 0.0)], []
    for k in range(count):
        angle, width = 2.0 * np.pi * (k + rng.uniform(0.0, 0.5)) / count, rng.uniform(0.6, 1.0)
        out = width * np.cos(angle), width * np.sin(angle)
        points += [(rng.uniform(-0.2, 0.2), *out), (rng.uniform(0.8, 1.2), *out)]
        faces.append((0, 1, 2 * k + 3, 2 * k + 2)[:: rng.choice([-1, 1])])
    return fd.Pattern(points, faces)


def structure_of(model: str, pattern: fd.Pattern, rng, extra: str) -> Any:
    """A structure of a pattern, with some options other than those of its model."""
    thick = rng.uniform(0.02, 0.05)
    sheet = fd.Sheet(1e6, rng.uniform(0.1, 0.4), thick, 1000.0, rng.uniform(0.5, 3.0))
    if rng.random() < 0.3:
        panel = int(rng.integers(len(pattern.faces)))
        other = fd.PanelSheet(
            [panel], 1e6 * rng.uniform(0.5, 3.0), thickness=rng.uniform(0.02, 0.05)
        )
        sheet = replace(sheet, panels=[other])
    build = fd.shell if model == SHELL else fd.discretize
    make: dict[str, Any] = {"divisions": 2} if model == SHELL else {"preset": model}
    known = inspect.signature(build).parameters
    s = build(pattern, sheet, **make)
    scene = scene_of(s, rng, True)
    memory = extra in ("memory", "all")
    laws = [law for law in HINGE_LAWS.values() if issubclass(law, MemoryLaw) == memory]
    count = len(pattern.creases)
    options: dict[str, Callable[[], Any]] = {
        "fold_law": lambda: fold_laws(scene, laws, count),
        "bend_law": lambda: drawn(scene, laws),
        "scheme": lambda: str(rng.choice(["n5b8", "n4b5"])),
        "bar_law": lambda: str(rng.choice([*BAR_LAWS])),
        "mass": lambda: str(rng.choice([*MASS_RULES])),
        "crease_stiffness": lambda: (rng.uniform(0.1, 10.0, count) * s.fold_stiffness).tolist(),
        "crease_rest": lambda: np.degrees(s.fold_rest + rng.uniform(-0.1, 0.1, count)).tolist(),
        "rigid": lambda: "all" if rng.random() < 0.3 else scene.some(len(pattern.faces)),
        "clamped": lambda: scene.pairs(pattern.boundary),
        "straight": lambda: scene.pairs(pattern.boundary),
        "membrane": lambda: str(rng.choice(["bars", "panel"])),
        "vertex_radius": lambda: scene.size * rng.uniform(0.01, 0.03),
    }
    if model == "n5b8e":  # which a scheme stands for
        del options["scheme"]
    springs = extra in ("springs", "all")
    if not springs and model != "n5b8e":  # whose plates are clamped; other models get springs
        del options["clamped"]
    for name in (name for name in options if name in known):
        for _ in range(TRIES if rng.random() < 0.4 or (name == "fold_law" and memory) else 0):
            more = {**make, name: options[name]()}
            more |= {"divisions": 4} if name == "vertex_radius" else {}
            try:
                tried = build(pattern, sheet, **more)
                _ = tried.mass  # some rules refuse some shapes
                if len(tried.nodes) <= MOST_NODES:
                    s, make = tried, more
                    break
            except InputError:
                pass
    return s


def fold_laws(scene: Scene, laws: Sequence[Any], count: int) -> Any:
    """A law for all of some creases, or one of two for each."""
    two = drawn(scene, laws), drawn(scene, laws)
    return (
        two[0] if scene.rng.random() < 0.5 else [two[k] for k in scene.rng.integers(2, size=count)]
    )


def scene_of(structure: Any, rng, implicit: bool) -> Scene:
    """Sizes for a structure: a motion lasts some times as long as sound takes along an edge."""
    sheet, pattern = structure.sheet, structure.pattern
    shortest = np.linalg.norm(np.diff(pattern.vertices[pattern.edges], axis=1), axis=2).min()
    sound = float(shortest) / np.sqrt(sheet.youngs_modulus / sheet.density)
    shell = isinstance(structure, fd.Shell)  # so stiff that rounded forces add up in long motions
    time, size = (20.0 if not implicit else 100.0 if shell else 300.0) * sound, pattern.size
    mass = structure.total_mass / len(pattern.vertices)
    return Scene(rng, structure, time, mass * SMALL * size / time**2, mass, size)


# ------------------------------------------------------------------ cases
class Combination(NamedTuple):
    """What kernels are compiled for: an analysis, a model, and one of `EXTRAS`, or none."""

    analysis: str
    model: str
    extra: str = ""


@dataclass(frozen=True)
class Draw:
    """A case, how it is computed, and what was found."""

    case: fd.Case
    analysis: str
    options: Mapping[str, Any]
    initial: fd.State | None
    found: Any

    def run(self, case: fd.Case, initial: fd.State | None) -> Any:
        """The result of a copy of the case that starts at `initial`."""
        return computed(case, self.analysis, self.options, initial)


def computed(case: fd.Case, analysis: str, options: Mapping[str, Any], initial: Any) -> Any:
    """Result of an analysis."""
    if analysis == STATIC:
        return fd.trace(case, load_factors=[0.5, 1.0])
    return fd.simulate(case, initial=initial, **options)


def draw(seed: int, combinations: Sequence[Combination]) -> Draw:
    """A case of one of some combinations that the library takes and that has an answer."""
    for attempt in range(TRIES * len(combinations)):
        chosen = combinations[(seed + attempt // TRIES) % len(combinations)]
        try:
            found = _draw(np.random.default_rng((seed, attempt)), chosen)
        except (InputError, ComputationError):  # refused, unstable, no equilibrium
            continue
        if np.abs(found.found.displacement).max() > LEAST * found.case.structure.pattern.size:
            return found
    raise AssertionError("all that was drawn is refused")


def _draw(rng, chosen: Combination) -> Draw:
    analysis, model, extra = chosen
    s = structure_of(model, pattern_of(rng), rng, extra)
    implicit = analysis == STATIC or METHODS[analysis].implicit
    scene = scene_of(s, rng, implicit)
    options: dict[str, Any] = {}
    if analysis != STATIC:
        options = {"method": analysis, "duration": scene.time, "interval": scene.time / STEPS}
        options |= {"dt": scene.time / STEPS} if implicit else {}

    def taken(case: fd.Case, initial: fd.State | None = None) -> Any:
        """What is prepared of a case; refuses what the library does."""
        return None if analysis == STATIC else prepare(case, initial=initial, **options)

    held = list(s.pattern.faces[rng.integers(len(s.pattern.faces))])
    case = fd.Case(s, [fd.Fix(held)] if analysis == STATIC or rng.random() < 0.7 else [])
    if extra in ("contact", "all"):
        case = case.altered(contact=contact_of(scene))
    taken(case)
    if extra in ("air", "all"):
        case = _with_air(case, scene, taken)
    supports = [kind for kind in SUPPORTS if kind is not fd.Spring]
    lists = {"supports": (supports, 2), "loads": (LOADS, 4), "damping": (DAMPINGS, 2)}
    for name, (kinds, most) in {**lists, "masses": ([fd.PointMass], 1)}.items():
        for _ in range(rng.integers(name == "loads", most + 1)):
            case = _with_one_more(case, name, kinds, scene, taken)
    if extra in ("springs", "all"):
        case = _with_one_more(case, "supports", [fd.Spring], scene, taken)
    initial = None
    if analysis != STATIC and rng.random() < 0.5:
        free = np.where(case.fixed, 0.0, SMALL * scene.size)
        u, v = free * rng.normal(size=(2, *s.nodes.shape))
        try:
            given = fd.State(1e-2 * u, v / scene.time)
            taken(case, given)
            initial = given
        except InputError:  # what is tied together moves together
            pass
    if analysis != STATIC:
        options["dt"] = taken(case, initial).plan.dt
        if METHODS[analysis].adaptive:  # steps that are all alike
            options |= {"dt": 0.3 * options["dt"], "tolerance": 1e-3}
    return Draw(case, analysis, options, initial, computed(case, analysis, options, initial))


def _with_one_more(case: fd.Case, name: str, kinds: Any, scene: Scene, taken: Any) -> fd.Case:
    """The case with another support, load, damping or mass, if one of some that are drawn fits."""
    before = case.dampings if name == "damping" else getattr(case, name)
    for _ in range(TRIES):
        try:
            more = case.altered(**{name: [*before, drawn(scene, kinds)]})
            taken(more)
            return more
        except InputError:
            continue
    return case


def _with_air(case: fd.Case, scene: Scene, taken: Any) -> fd.Case:
    """The case in a fluid that its analysis takes."""
    for _ in range(TRIES):
        surrounded = case.altered(air=drawn(scene, [fd.Air]))
        with suppress(InputError):
            taken(surrounded)
            return surrounded
    raise InputError("no air is taken")


def contact_of(scene: Scene) -> fd.Contact:
    """Panels that touch, and planes that the sheet stands beside, some of which move."""
    planes, thickness = [], scene.structure.sheet.thickness
    for _ in range(scene.rng.integers(3)):
        normal = scene.rng.normal(size=3)
        normal /= np.linalg.norm(normal)
        lowest = (scene.structure.nodes @ normal).min() - thickness
        friction = None if scene.rng.random() < 0.5 else 0.3
        plane = fd.Plane(tuple(lowest * normal), tuple(normal), friction)
        if scene.rng.random() < 0.5:
            moved = scene.vector(0.2 * thickness)
            plane = replace(plane, motion=moved, history=drawn(scene, HISTORIES.values()))
        planes.append(plane)
    panels = not planes or bool(scene.rng.random() < 0.8)
    return fd.Contact(friction=0.2 * scene.rng.integers(2), panels=panels, planes=planes)
