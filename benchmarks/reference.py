"""Record what the package computes, and compare another state of the code with it.

    python benchmarks/reference.py record FOLDER [--only TEXT]
    python benchmarks/reference.py compare FOLDER [--only TEXT]

Small cases, every model with one feature or a few, by every method: motions, paths of equilibria,
modes, frequency responses. `record` stores each as an .npz file, and leaves those that are there;
`compare` computes again what is stored, prints the largest differences, relative to the largest
value of their kind, and exits with status 1 if one is above 1e-11 or something ends in another
way. What the library refuses is recorded as such, with its message.

A name such as plate.force+alpha.rk4 says the model, the features, and what is computed. TEXT
chooses the names that contain it.
"""

from __future__ import annotations

import os

# before the imports, as results depend on it to rounding
os.environ |= {"NUMBA_NUM_THREADS": "2", "MKL_NUM_THREADS": "1", "OPENBLAS_NUM_THREADS": "1"}
os.environ.pop("OMP_NUM_THREADS", None)  # it would limit the threads of motions

import argparse
import json
import re
import sys
import tempfile
import time
import warnings
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import numpy as np

import foldyn as fd
from foldyn.dynamics import METHODS
from foldyn.errors import ComputationError, FoldynError
from foldyn.structures import hinge_angles

CLOSE = 1e-11  # relative difference that rounding may make
SHORT, LONG = 1e-3, 5e-3  # s, steps of explicit and implicit methods
STEPS, BIG_STEPS = 50, 8
ALONG = {"time", "step", "mode", "frequency", "model", "continued"}  # what is computed has one
ASIDE = ("residual", "iterations", "rigid_share")  # of variables: rounding, and ways to a result
Arrays = dict[str, np.ndarray]
SHEET = fd.Sheet(1e7, 0.25, 0.02, 1000.0)
MODELS = ("plate", "herkal", "merlin2", "n5b8e", "shell")
WITHOUT = {  # features of which a model has none, or that take long
    "merlin2": {"big"}, "n5b8e": {"big"}, "shell": {"big", "n4b5", "linearbars", "lumped"},
}  # fmt: skip


# ------------------------------------------------------------------ patterns: held at xmin
def sheets() -> fd.Pattern:
    """Two flat sheets of two panels face to face, little more than their thickness apart."""
    grid = np.array([[0.0, i, j] for j in (0, 1) for i in (0, 1, 2)])
    turn = np.array([[1.0, 0.0, 0.0], [0.0, 0.8, 0.6], [0.0, -0.6, 0.8]])
    other = grid @ turn.T + [0.021, 0.2, -0.3]
    faces = [(0, 1, 4, 3), (1, 2, 5, 4), (6, 7, 10, 9), (7, 8, 11, 10)]
    return fd.Pattern(np.vstack([grid, other]), faces, name="sheets")


def tower() -> fd.Pattern:
    """A Kresling cell that lies along x."""
    made = fd.patterns.kresling()
    return fd.Pattern(made.vertices[:, [2, 0, 1]], made.faces, made.assignments)


PATTERNS: dict[str, Callable[[], fd.Pattern]] = {
    "miura": fd.patterns.miura,
    "fold": fd.patterns.simple_fold,
    "tower": tower,
    "sheets": sheets,
    "big": lambda: fd.patterns.miura(cells=(20, 20)),
}

# ------------------------------------------------------------------ what a feature adds to a case
PULSE, RISE = fd.HalfSine(0.05), fd.Ramp(0.1, smooth=True)
PUSH = (-200.0, 100.0, -150.0)  # N
TIES = [(0, 6), (2, 8)]
CUBIC = fd.CustomHingeLaw(
    energy_of=lambda t, r: 0.5 * (t - r) ** 2 + 0.25 * (t - r) ** 4,
    moment_of=lambda t, r: (t - r) + (t - r) ** 3,
    slope_of=lambda t, r: 1.0 + 3.0 * (t - r) ** 2,
    name="cubic",
)
GROUND = {"point": (0.0, 0.0, -0.012), "normal": (0.0, 0.0, 1.0), "friction": 0.3}
RISING = fd.Plane(**GROUND, motion=(0.01, 0.0, 0.05), history=RISE)
LAWS = {
    "prony": fd.Prony([0.5, 0.2], [0.02, 0.3]),
    "plastic": fd.Plastic(0.05, isotropic=0.2, kinematic=0.5),
    "eyring": fd.Eyring(0.01, 1e-3),
    "linear": "linear",
    "cubic": CUBIC,
}
FEATURES: dict[str, dict[str, Any]] = {
    **{name: {"pattern": name} for name in PATTERNS},
    **{name: {"options": {"fold_law": law}} for name, law in LAWS.items()},
    "start": {"start": (-0.6, 0.2, -1.0)},
    "force": {"loads": [fd.Force("xmax", PUSH, PULSE)]},
    "table": {"loads": [fd.Force("xmax", PUSH, fd.Table([0, 0.02, 0.1, 1], [0, 1, -1, 0], True))]},
    "called": {"loads": [fd.Force("xmax", PUSH, lambda t: np.sin(30.0 * t))]},
    "gravity": {"loads": [fd.Gravity((0.0, 0.0, -9.81))]},
    "pressure": {"loads": [fd.Pressure(500.0, history=RISE)]},
    "moment": {"loads": [fd.CreaseMoment("all", 20.0, RISE)]},
    "temperature": {"loads": [fd.Temperature(20.0, 1e-3, 5e-3, history=RISE)]},
    "actuate": {"loads": [fd.Actuate("all", fraction=0.1, history=RISE)]},
    "impose": {"supports": [fd.Impose("xmax", "z", -0.1, PULSE)]},
    "base": {"supports": [fd.BaseMotion("z", PULSE, 0.05), fd.BaseMotion("x", RISE, 0.02)]},
    "directed": {"supports": [fd.Spring(2e3, "xmax", direction=(0, 1, 1))]},
    "axial": {"supports": [fd.Spring(2e3, between=TIES, rest_length=1.0)]},
    "standing": {"supports": [fd.Spring(50.0, "xmax")]},
    "clamped": {"options": {"clamped": "xmin"}},
    "oblique": {"supports": [fd.Fix("xmax", direction=(1, 0, 1))]},
    "link": {"supports": [fd.Link("xmax", "xz")]},
    "rigid": {"options": {"rigid": [0]}},
    "alpha": {"damping": [fd.Rayleigh(alpha=5.0)]},
    "beta": {"damping": [fd.Rayleigh(alpha=1.0, beta=1e-5)]},
    "modal": {"damping": [fd.ModalDamping(0.05, count=4)]},
    "creases": {"damping": [fd.CreaseDamping(0.2)]},
    "strain": {"damping": [fd.StrainDamping(1e-5)]},
    "dashpot": {"supports": [fd.Dashpot(50.0, "xmax"), fd.Dashpot(50.0, between=TIES)]},
    "consistent": {"options": {"mass": "consistent"}},
    "lumped": {"options": {"mass": "circumcenter"}},
    "points": {"masses": [fd.PointMass("xmax", 5.0)]},
    "n4b5": {"options": {"scheme": "n4b5"}},
    "linearbars": {"options": {"bar_law": "linear"}},
    "contact": {"contact": fd.Contact()},
    "rubbing": {"contact": fd.Contact(friction=0.3)},
    "plane": {"contact": fd.Contact(panels=False, planes=[fd.Plane(**GROUND)])},
    "rising": {"contact": fd.Contact(planes=[RISING])},
}
MOVED = """
    start force start+tower start+fold start+n4b5 start+linearbars force+linear start+lumped
    start+consistent start+points force+alpha force+beta force+strain force+modal force+creases
    force+dashpot table called gravity pressure moment temperature actuate impose base
    force+directed force+axial force+clamped force+oblique force+link force+rigid force+cubic
    force+prony force+plastic force+eyring start+plane rising start+sheets+contact
    start+sheets+rubbing impose+consistent base+lumped+modal base+beta
    actuate+beta temperature+prony pressure+prony pressure+directed impose+axial actuate+plastic
    impose+prony force+prony+axial force+prony+creases force+plastic+clamped force+prony+link
    start+plane+axial start+plane+prony base+start+plane start+plane+beta start+plane+dashpot
    start+sheets+rubbing+prony start+sheets+contact+directed rising+link rising+axial+prony
"""
BIG = """
    big+force big+force+prony big+force+lumped big+force+axial big+base+alpha big+start+plane
    big+start+actuate big+force+modal
"""
TRACED = {  # up to which factor of the loads
    "force": 1e-3, "gravity": 1e-3, "pressure": 1e-3, "moment": 1e-2, "temperature": 0.5,
    "actuate": 1.0, "impose": 1.0, "force+directed": 1e-2, "force+axial": 1e-3, "force+tower": 0.1,
    "force+clamped": 1e-3, "force+link": 1e-3, "force+rigid": 1e-3, "force+oblique": 1e-3,
    "force+cubic": 1e-3, "force+plastic": 1e-3, "impose+plastic": 1.0, "force+eyring": 1e-3,
    "force+prony": 1e-3, "gravity+plane": 1e-2, "rising": 1.0, "rising+axial+plastic": 1.0,
    "force+sheets+contact+standing": 2e-3, "big+force": 1e-4,
}  # fmt: skip
VIBRATING = """
    start start+fold start+lumped start+points start+directed start+axial start+clamped start+link
    start+rigid start+prony beta creases strain modal dashpot start+prony+creases big+start
"""


def case_of(model: Any, names: str) -> tuple[fd.Case, fd.State | None]:
    """The case of a model with some features, and how its motion starts."""
    found: dict[str, Any] = {"pattern": "miura", "options": {}, "contact": None, "start": None}
    found |= {"supports": [fd.Fix("xmin")], "loads": [], "damping": [], "masses": []}
    for name in names.split("+"):
        for key, value in FEATURES[name].items():
            before = found[key]
            if isinstance(before, list):
                value = before + value
            found[key] = before | value if isinstance(before, dict) else value
    pattern, options, start = (found.pop(key) for key in ("pattern", "options", "start"))
    made = PATTERNS[pattern]()
    if model == "shell":
        structure = fd.shell(made, SHEET, divisions=2, **options)
    else:
        structure = fd.discretize(made, SHEET, preset=model, **options)
    case = fd.Case(structure, **found)
    if start is None:
        return case, None
    x = structure.nodes - structure.nodes.min(axis=0)
    speed = np.outer(2.0 * x[:, 0] + 0.2 * x[:, 1], start) / x.max()
    return case, fd.State(velocity=np.where(case.fixed, 0.0, speed))


# ------------------------------------------------------------------ what is computed
def options_of(method: str, steps: int = STEPS) -> dict[str, Any]:
    """Arguments of a motion of so many steps."""
    dt = LONG if METHODS[method].implicit else SHORT
    if METHODS[method].adaptive:
        return {"method": method, "duration": steps * dt, "interval": 5 * dt}
    return {
        "method": method,
        "duration": steps * dt,
        "dt": dt,
        "every_steps": 5 if steps > 5 else 1,
    }


def moved(case: fd.Case, start: fd.State | None, **options: Any) -> Any:
    """A motion."""
    return fd.simulate(case, initial=start, **options)


def continued(case: fd.Case, start: fd.State | None, **options: Any) -> Any:
    """The motion from the end of one, which went as far."""
    first = fd.simulate(case, initial=start, **options)
    again = fd.initial_state(first)
    return fd.simulate(case, initial=again, start=options["duration"], **options)


def resumed(case: fd.Case, start: fd.State | None, **options: Any) -> Any:
    """A motion that is cut off, from its last checkpoint on."""

    def cut(state: Any) -> None:
        if state.steps > 0.6 * options["duration"] / options["dt"]:
            raise KeyboardInterrupt

    with tempfile.TemporaryDirectory() as folder:
        options |= {"initial": start, "store": Path(folder, "motion.nc"), "checkpoint": 1e-9}
        try:
            fd.simulate(case, progress=cut, **options)
        except KeyboardInterrupt:
            return fd.simulate(case, resume=True, **options).load()
    raise AssertionError("it was not cut off")


def beside(case: fd.Case, start: fd.State | None) -> Any:
    """Ten motions side by side: of the case with more and more mass."""
    many = [case.altered(masses=[fd.PointMass("xmax", 1.0 + k)]) for k in range(10)]
    return fd.simulate_many(many, STEPS * SHORT, dt=SHORT, every_steps=5, initial=start)


def sampled(case: fd.Case, start: fd.State | None, **options: Any) -> Any:
    """A motion with the fold angles at its samples."""
    s = case.structure

    def angle(u: np.ndarray, v: np.ndarray, t: float) -> np.ndarray:
        return hinge_angles(s.nodes + u, s.folds)

    return fd.simulate(case, initial=start, sample={"angle": angle}, **options)


def traced(case: fd.Case, _: None, **options: Any) -> Any:
    """Equilibria under the loads, which are those of `TRACED` at the last factor."""
    return fd.trace(case, **options)


def vibrating(case: fd.Case, _: fd.State | None) -> Any:
    """Modes at rest."""
    return fd.modes(case, count=4)


def response(case: fd.Case, _: fd.State | None) -> Any:
    """A frequency response at rest."""
    return fd.frf(case, fd.Force("xmax", (1.0, 0.0, 0.5)), frequencies=[0.1, 0.3, 1.0, 4.0])


def jobs() -> Iterator[tuple[str, str, Callable[..., Any], dict[str, Any]]]:
    """Features, a name, a function and its arguments: the most telling first."""
    for names in MOVED.split():
        for method in METHODS:
            yield names, method, moved, options_of(method)
    for names, factor in TRACED.items():
        some = {"load_factors": [0.5 * factor, factor]}
        free = {"first_step": 0.25 * factor, "steps": 5, "method": "arc_length"}
        for name, options in {"newton": some, "arc_length": free}.items():
            yield names, name, traced, options
    for names in VIBRATING.split():
        yield names, "modes", vibrating, {}
        yield names, "frf", response, {}
    yield "force+gravity+alpha", "sampled", sampled, options_of("rk4")
    for names in ("force", "force+prony", "start+plane", "base+beta"):
        chosen = options_of("generalized_alpha") | {"tolerance": 1e-4}
        yield names, "adaptive", moved, chosen
        for method in ("rk4", "central_difference", "generalized_alpha", "energy_momentum"):
            yield names, f"continued_{method}", continued, options_of(method)
            fine = {"dt": STEPS * SHORT / 4000, "every_steps": 100}  # of 1000 steps to a checkpoint
            more = {} if METHODS[method].implicit else fine
            yield names, f"resumed_{method}", resumed, options_of(method) | more
    for names in ("start", "start+lumped", "force+lumped+alpha", "start+tower+lumped"):
        yield names, "beside", beside, {}
    for names in BIG.split():  # on two threads, where the package takes them
        for method in (name for name, method in METHODS.items() if not method.adaptive):
            yield names, method, moved, options_of(method, BIG_STEPS)


def cases(text: str) -> Iterator[tuple[str, Callable[[], Arrays]]]:
    """Names that contain a text, each with what computes its arrays."""
    for model in MODELS:
        for names, name, function, options in jobs():
            full = f"{model}.{names}.{name}"
            if text in full and WITHOUT.get(model, set()).isdisjoint(names.split("+")):
                yield full, lambda m=model, n=names, f=function, o=options: computed(m, n, f, o)


def computed(model: str, names: str, function: Any, options: dict[str, Any]) -> Arrays:
    """Arrays of a result, with how it ended, warnings and facts under "about", as JSON."""
    result, end = None, "done"
    with warnings.catch_warnings(record=True) as told:
        warnings.simplefilter("always")
        try:
            result = function(*case_of(model, names), **options)
        except ComputationError as error:
            result, end = error.partial, f"ended: {type(error).__name__}: {error}"
        except FoldynError as error:
            end = f"refused: {error}"
        except Exception as error:  # a fault of the package: to be known, too
            end = f"failed: {type(error).__name__}: {error}"
    about: dict[str, Any] = {"end": end, "warnings": [str(w.message) for w in told]}
    arrays: Arrays = {}
    if result is not None:
        facts = {k: v for k, v in result.attrs.items() if is_count(k, v)}
        about |= {k: int(v) for k, v in facts.items()}
        arrays = {str(k): v.values for k, v in result.data_vars.items() if is_own(k, v)}
    return arrays | {"about": np.array(json.dumps(about))}


def is_own(name: Any, array: Any) -> bool:
    """Whether a variable of a result is what was computed, and more than rounding."""
    return array.dtype.kind in "fci" and name not in ASIDE and not ALONG.isdisjoint(array.dims)


def is_count(name: str, value: Any) -> bool:
    """Whether a fact of a result is a number of things, which only rounding changes seldom."""
    return isinstance(value, int | np.integer) and name not in ("foldyn_format", "rerunnable")


# ------------------------------------------------------------------ comparison
COLUMNS = ("displacement", "velocity", "energies", "reaction", "others")
ENERGIES = re.compile("strain_.*|kinetic|dissipated|work|contact")  # which share a scale


def differences(old: Arrays, new: Arrays) -> dict[str, float]:
    """Largest difference of each kind of array over the largest old value of that kind."""
    scale: dict[str, float] = {}
    apart: dict[str, float] = {}
    for name in sorted((old.keys() | new.keys()) - {"about"}):
        kind = "energies" if ENERGIES.fullmatch(name) else name
        one, other = old.get(name, np.zeros(0)), new.get(name, np.zeros(0))
        gap = np.inf
        if one.shape == other.shape and np.array_equal(np.isnan(one), np.isnan(other)):
            gap = float(np.nan_to_num(np.abs(one - other)).max(initial=0.0))
        size = float(np.nan_to_num(np.abs(one)).max(initial=0.0))
        apart[kind] = max(apart.get(kind, 0.0), gap)
        scale[kind] = max(scale.get(kind, 0.0), size)
    return {kind: gap / (scale[kind] or 1.0) for kind, gap in apart.items()}


def line(name: str, old: Arrays, new: Arrays) -> tuple[str, bool]:
    """A line of the table, with what else is not as it was below it; whether all is well."""
    one, other = (json.loads(str(of["about"])) for of in (old, new))
    apart = differences(old, new)
    cells: dict[str, float] = {}
    for kind, gap in apart.items():
        column = kind if kind in COLUMNS else "others"
        cells[column] = max(cells.get(column, 0.0), gap)
    worst = max(cells.values(), default=0.0)
    row = [f"{cells[c]:.1e}" if cells.get(c) else "=" if c in cells else "" for c in COLUMNS]
    ends = [about["end"].partition(":")[0] for about in (one, other)]
    told = "" if worst else "bit-equal" if apart else ends[1]
    if ends[0] != ends[1]:
        told = f"{ends[0]} before, {ends[1]} now"
    text = f"{name:48}" + "".join(f"{cell:>14}" for cell in row) + f"  {told}"
    for key in sorted(one.keys() | other.keys()):
        if one.get(key) != other.get(key):
            text += f"\n    {key}: {other.get(key)}\n    recorded: {one.get(key)}"
    return text, worst <= CLOSE and ends[0] == ends[1]


def main() -> int:
    """Record or compare."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").splitlines()[0])
    parser.add_argument("what", choices=("record", "compare"))
    parser.add_argument("folder", type=Path)
    parser.add_argument("--only", default="", metavar="TEXT", help="names that contain this")
    options = parser.parse_args()
    options.folder.mkdir(parents=True, exist_ok=True)
    good, count, began = True, 0, time.perf_counter()
    if options.what == "compare":
        print(f"{'':48}" + "".join(f"{column:>14}" for column in COLUMNS))
    for name, compute in cases(options.only):
        file, clock = options.folder / f"{name}.npz", time.perf_counter()
        if file.exists() == (options.what == "record"):
            continue
        found, count = compute(), count + 1
        if options.what == "record":
            np.savez_compressed(file, **found)  # pyright: ignore[reportArgumentType]
            end = json.loads(str(found["about"]))["end"]
            text = f"{time.perf_counter() - clock:6.1f} s  {name}: {end}"
        else:
            with np.load(file) as old:
                text, well = line(name, dict(old), found)
            good = good and well
        print(text, flush=True)
    print(f"{count} in {time.perf_counter() - began:.0f} s")
    if options.what == "compare":
        print("all as recorded" if good else "NOT all as recorded")
    return 0 if good else 1


if __name__ == "__main__":
    sys.exit(main())
