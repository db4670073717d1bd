"""Gradients at random: a design, a parameter, an analysis and a measure, from the registries.

A design is a function of its parameters, of all kinds: what the sheet is made of, its shape, its
creases, masses, damping, loads and supports. What the library refuses is drawn again.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import replace
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

import foldyn as fd
from foldyn.gradients.measures import DERIVATIVES
from foldyn.gradients.run_sensitivity import ARRAYS, FUNCTIONS, KINDS
from foldyn.structures.presets import PRESETS
from foldyn.sweeps.measure import asked
from foldyn.sweeps.measures import MEASURES

SHELL = "shell"
MODELS = (*PRESETS, SHELL)
STEPS = 25  # of a motion by implicit methods
METHODS = ("rk4", "central_difference", "newmark", "generalized_alpha")
RARE = {"limit_load", "barrier", "barrier_back"}  # of sheets that snap: see test_path_gradient
CONSTRAINTS = ("none", "oblique", "equal", "plate", "rigid")
LAWS = ("linear", "enhanced", fd.PlateSuperlinear(onset=2.0), fd.EnhancedLinear(100.0, 260.0))
MASSES = ("mixed_voronoi", "consistent", "panel")


class Draw(NamedTuple):
    """A number, as a function of one parameter, and what it takes."""

    build: Callable[..., fd.Case]
    source: Any  # `build`, or a case whose arrays are parameters
    name: str
    value: Any
    measure: str
    analysis: Mapping[str, Any]

    def number(self, value: Any) -> float:
        """The measure, where the parameter is this."""
        case = self.build(**{self.name: value})
        given = {name: each for name, each in self.analysis.items() if name != "kind"}
        result = FUNCTIONS[self.analysis["kind"]](case, **given)
        return float(asked(self.measure, MEASURES).of(result, case, {}))

    def gradient(self) -> tuple[float, NDArray]:
        """The measure, and its derivatives by the entries of the parameter."""
        parameters, sizes = {self.name: self.value}, None
        if not np.any(self.value):
            sizes = {self.name: np.full_like(self.value, 0.1)}
        found = fd.sensitivity(
            self.source,
            parameters,
            measures=self.measure,
            analysis=dict(self.analysis),
            sizes=sizes,
        )
        return float(found["value"][0]), found[f"gradient_{self.name}"].values[0]


def draw(seed: int, attempt: int) -> Draw:
    """One draw; InputError where the library refuses the case."""
    rng = np.random.default_rng((seed, attempt))
    kinds = [kind for kind in KINDS if kind != "effective"]  # cells have tests of their own
    kind = kinds[seed % len(kinds)]
    model = str(rng.choice(MODELS))
    make, values = _design(rng, model, kind)
    case = make(**values)
    analysis = _analysis(rng, kind, case)
    measure = _measure(rng, kind, case, analysis)
    arrays = [name for name in ARRAYS if name != "bar_length"]
    if model != SHELL and rng.random() < 0.2:  # the structure's own arrays

        def replaced(**given: Any) -> fd.Case:
            return replace(case, structure=replace(case.structure, **given))

        name = str(rng.choice(arrays))
        own = getattr(case.structure, name)
        value = case.structure.mass.sum(axis=1) if own is None else own
        return Draw(replaced, case, name, np.asarray(value), measure, analysis)
    name = str(rng.choice([*values]))

    def build(**given: Any) -> fd.Case:
        return make(**{**values, **given})

    return Draw(build, build, name, values[name], measure, analysis)


def _design(rng: Any, model: Any, kind: str) -> tuple[Callable[..., fd.Case], dict[str, Any]]:
    """A design, and its parameters with their values."""
    miura = rng.random() < 0.6
    creases, panels = (4, 4) if miura else (1, 2)
    held = [0, 1, 4, 3] if miura else [0, 1, 2, 3]
    constraint = str(rng.choice(CONSTRAINTS if miura else ("none", "oblique", "equal")))
    law, mixed, mass = rng.choice(len(LAWS)), rng.random() < 0.3, str(rng.choice(MASSES))
    linear = rng.random() < 0.3
    options: dict[str, Any] = {"fold_law": LAWS[law]}
    if constraint == "rigid":
        options["rigid"] = [3]
    if model == SHELL:
        options["divisions"] = 2
    elif model != "n5b8e":
        options |= {"mass": mass} | ({"bend_law": "linear"} if linear else {})
    direction, along = rng.normal(size=3), str(rng.choice([*"xyz"]))
    far, beside = (8, [2, 5]) if miura else (5, [4])
    moves = kind in ("statics", "dynamics") and rng.random() < 0.4
    history = fd.HalfSine(3.0) if kind == "dynamics" else fd.Step()
    state = str(rng.choice(["rest", "initial"]))
    stiff = 10.0 ** rng.uniform(-2.0, 0.0)
    values: dict[str, Any] = {
        "youngs": 1e6 * rng.uniform(0.5, 2.0),
        "poisson": rng.uniform(0.1, 0.4),
        "density": 1000.0 * rng.uniform(0.5, 2.0),
        "thickness": rng.uniform(0.015, 0.04, panels) if rng.random() < 0.3 else 0.03,
        "length": rng.uniform(0.8, 1.2),
        "dihedral": rng.uniform(70.0, 130.0),
        "corner": np.zeros(3) if rng.random() < 0.5 else rng.normal(scale=0.02, size=3),
        "stiffness": stiff * 10.0 ** rng.uniform(-0.5, 0.5, creases),
        "point": rng.uniform(1.0, 20.0),
        "alpha": rng.uniform(0.05, 0.5),
        "beta": rng.uniform(1e-4, 1e-3) if kind != "dynamics" else 1e-6,
        "force": 0.03 * stiff * rng.normal(size=3),
        "spring": stiff * rng.uniform(0.1, 1.0),
    }
    if constraint in ("plate", "rigid"):  # of flat panels
        del values["corner"]
    if moves:
        values["moved"] = rng.uniform(0.005, 0.02)
    values |= {"bar": stiff * rng.uniform(0.1, 1.0), "cut": rng.uniform(0.9, 1.1)}
    of_bar = [None, "ogden", "linear"][rng.integers(3)]

    def drawn_of(v: Mapping[str, Any]) -> fd.Pattern:
        if miura:
            return fd.patterns.miura(b=v["length"], panel_angle=64.0, dihedral=v["dihedral"])
        return fd.patterns.simple_fold(b=v["length"], dihedral=v["dihedral"])

    if rng.random() < 0.5:
        own = fd.discretize(drawn_of(values), fd.Sheet(1e6, 0.3, 0.03), preset="herkal").fold_rest
        values["rest"] = np.degrees(own) + rng.uniform(-10.0, 10.0, creases)

    def make(**v: Any) -> fd.Case:
        drawn = drawn_of(v)
        points = drawn.vertices.copy()
        points[far] += v.get("corner", 0.0)
        pattern = fd.Pattern(points, drawn.faces)
        each = [
            fd.PanelSheet(k, thickness=float(t)) for k, t in enumerate(np.ravel(v["thickness"]))
        ]
        several = np.ndim(v["thickness"]) > 0
        thickness = 0.03 if several else v["thickness"]
        sheet = fd.Sheet(v["youngs"], v["poisson"], thickness, v["density"], panels=each * several)
        stiffness = np.asarray(v["stiffness"])
        if mixed:  # as a filter does
            stiffness = 0.5 * stiffness + 0.5 * np.roll(stiffness, 1)
        own = options | {"crease_stiffness": stiffness.tolist()}
        if "rest" in v:
            own["crease_rest"] = v["rest"]
        made = (
            fd.shell(pattern, sheet, **own)
            if model == SHELL
            else fd.discretize(pattern, sheet, preset=model, **own)
        )
        supports: list[Any] = [fd.Fix(held)]
        if constraint == "oblique":
            supports.append(fd.Fix([far], direction=direction))
        if constraint == "equal":
            supports.append(fd.Link([far, *beside], axes=along))
        if constraint == "plate":
            supports.append(fd.Link([7], to=[4, 5, 8]))
        supports.append(fd.Spring(v["spring"], beside, direction=(0.3, 0.2, 1.0)))
        whole = float(np.linalg.norm(pattern.vertices[far] - pattern.vertices[0]))
        bar = fd.Bar((0, far), area=v["bar"], modulus=1.0, rest_length=v["cut"] * whole, law=of_bar)
        supports.append(bar)
        if "moved" in v:
            place = 6 if miura else 4
            supports.append(fd.Impose([place], "z", v["moved"], history))
        loads = [fd.Force([far], v["force"], history), fd.Force([far], (0.0, 0.0, 2e-3))]
        return fd.Case(
            made, supports, loads, fd.Rayleigh(v["alpha"], v["beta"], state),
            masses=[fd.PointMass([far], v["point"])],
        )  # fmt: skip

    return make, values


def _analysis(rng: Any, kind: str, case: fd.Case) -> dict[str, Any]:
    """An analysis of a kind, with its arguments."""
    moved = np.where(case.fixed, 0.0, rng.normal(scale=2e-3, size=case.fixed.shape))
    states: list[dict[str, Any]] = [{}, {"state": "equilibrium"}, {"state": fd.State(moved)}]
    about = states[rng.choice(3, p=(0.4, 0.5, 0.1))]
    if kind == "modes":
        return {"kind": kind, "count": 4, **about}
    if kind == "frf":
        drive = (
            fd.BaseMotion("z")
            if rng.random() < 0.3
            else fd.Force([len(case.structure.pattern.vertices) - 1], (0.1, 0.2, 1.0))
        )
        frequencies = np.linspace(0.1, 2.0, 3 if rng.random() < 0.5 else 25)
        method = str(rng.choice(["direct", "modal"]))
        return {"kind": kind, "drive": drive, "frequencies": frequencies, "method": method, **about}
    if kind == "statics":
        method = str(rng.choice(["newton", "displacement", "arc_length", "mgdcm"]))
        if method == "displacement" and not case.imposed_terms:
            method = "newton"
        if method in ("newton", "displacement"):
            few = [1.0] if rng.random() < 0.5 else np.linspace(0.25, 1.0, 4).tolist()
            return {"kind": kind, "method": method, "load_factors": few}
        return {"kind": kind, "method": method, "steps": 8}
    method = str(rng.choice(METHODS[2:] if isinstance(case.structure, fd.Shell) else METHODS))
    sheet: Any = case.structure.sheet
    sound = np.sqrt(sheet.density / sheet.youngs_modulus)  # s, along an edge
    implicit = method in METHODS[2:]
    duration = (300.0 if implicit else 10.0) * sound
    dt = duration / STEPS if implicit else _stable(case, method, duration)
    steps = 1 if rng.random() < 0.5 else 10
    return {"kind": kind, "method": method, "duration": duration, "dt": dt, "every_steps": steps}


def _stable(case: fd.Case, method: str, duration: float) -> float:
    """A step well below the critical one, with which differences of the design stay stable."""
    from foldyn.dynamics.driver import prepare

    return 0.8 * prepare(case, duration, method).plan.dt


def _measure(rng: Any, kind: str, case: fd.Case, analysis: Mapping[str, Any]) -> str:
    """A measure with a derivative, of results of a kind, with its arguments."""
    fits = [
        name
        for name, one in DERIVATIVES.items()
        if name not in RARE
        and not one.beside  # rounded at 1e-9, with tests of their own
        and (not MEASURES[name].kinds or kind in MEASURES[name].kinds)
        and (name == "load_at") == (analysis.get("method") in ("arc_length", "mgdcm"))
    ]
    weights = np.array([0.1 if name in ("mass", "clearance") else 1.0 for name in fits])
    name = str(rng.choice(fits, p=weights / weights.sum()))
    vertices = len(case.structure.pattern.vertices)
    chosen = {
        "node": int(rng.choice(np.flatnonzero(~case.fixed[:vertices].all(axis=1)))),
        "axis": str(rng.choice([*"xyz"])),
        "mode": int(rng.integers(1, 4)),
    }
    if kind == "dynamics":
        chosen["time"] = analysis["duration"] * rng.uniform(0.3, 0.9)
    if kind == "frf":
        chosen["frequency"] = rng.choice(analysis["frequencies"])
    if name == "load_at":  # between two points of the path
        path = fd.trace(case, **{key: each for key, each in analysis.items() if key != "kind"})
        moved = path["displacement"].sel(node=chosen["node"], axis=chosen["axis"])
        chosen["displacement"] = float(moved[1:].mean())
    taken = [one for one in MEASURES[name].takes if one in chosen]
    return f"{name}[{','.join(str(chosen[one]) for one in taken)}]" if taken else name
