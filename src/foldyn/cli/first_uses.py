"""Small computations that together compile every kernel that a run can need.

Each part of a model is a separate term (`mechanics/term.py`), compiled once whatever other parts
the model has. So one use of each part with every kind of method compiles everything.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from functools import partial
from typing import Any

import numpy as np

import foldyn as fd
from foldyn.dynamics import METHODS
from foldyn.dynamics.driver import prepare
from foldyn.errors import quietly
from foldyn.experiment.tracking.corners import refine
from foldyn.gradients.neighbors import Asked, motions
from foldyn.materials.series import in_series
from foldyn.mechanics.contact.clearance import clearance

STEPS, SHORT, LONG = 4, 1e-4, 5e-3  # s, time steps of explicit and implicit methods
EXPLICIT = ("rk4", "central_difference", "dormand_prince")
REMEMBER = ("rk4", "dormand_prince")
IMPLICIT = ("newmark", "generalized_alpha")
CONSERVING = "energy_momentum"
SHEET = fd.Sheet(1e7, 0.25, 0.02, 1000.0)
RISE, PULSE = fd.Ramp(0.1, smooth=True), fd.HalfSine(0.05)
PUSH = fd.Force("xmax", (-200.0, 100.0, -150.0), PULSE)
SPRINGS = [
    fd.Spring(2e3, "xmax", direction=(0, 1, 1)),
    fd.Spring(2e3, between=[(0, 6), (2, 8)], rest_length=1.0),
]
WOUND = [*SPRINGS, fd.Cable([0, 6, 8], 1e3, rest_length=2.5, change=-0.1, history=RISE)]
TIED = [fd.Link("xmax", "xz")]
MOVING = [fd.BaseMotion("z", PULSE, 0.05), fd.Impose("xmax", "z", -0.1, RISE)]
TURNING = [fd.Temperature(20.0, 1e-3, 5e-3, history=RISE), fd.Actuate([0], fraction=0.1)]
FOLLOWING = [fd.Pressure(500.0, history=RISE), fd.CreaseMoment("all", 20.0, RISE)]
DAMPED, MODAL = [fd.Rayleigh(1.0, 1e-5), fd.StrainDamping(1e-5)], fd.ModalDamping(0.05, 4)
DASHPOTS = [fd.Dashpot(50.0, "xmax"), fd.Dashpot(50.0, between=[(0, 6), (2, 8)])]
PRONY, PLASTIC = partial(fd.Prony, [0.5], [0.02]), partial(fd.Plastic, 0.05)
BELOW, UP, RISING = (0.0, 0.0, -0.012), (0.0, 0.0, 1.0), (0.01, 0.0, 0.05)
GROUND = fd.Plane(BELOW, UP, friction=0.3, motion=RISING, history=RISE)
RUBBING, ON_GROUND = fd.Contact(friction=0.3), fd.Contact(planes=[GROUND])


def sheets() -> fd.Pattern:
    """Two flat sheets of two panels each, face to face, slightly more than a thickness apart."""
    grid = np.array([[0.0, i, j] for j in (0, 1) for i in (0, 1, 2)])
    turn = np.array([[1.0, 0.0, 0.0], [0.0, 0.8, 0.6], [0.0, -0.6, 0.8]])
    faces = [(0, 1, 4, 3), (1, 2, 5, 4), (6, 7, 10, 9), (7, 8, 11, 10)]
    return fd.Pattern(np.vstack([grid, grid @ turn.T + [0.021, 0.2, -0.3]]), faces)


def case(
    supports: Sequence[Any] = (), loads: Sequence[Any] = (), damping: Sequence[Any] = (),
    contact: fd.Contact | None = None, air: fd.Air | None = None, model: str = "plate",
    pattern: fd.Pattern | None = None, law: Callable[[], Any] | None = None, **options: Any,
) -> fd.Case:  # fmt: skip
    """A sheet of four panels of a model, held at one end and pushed at the other."""
    pattern = pattern or fd.patterns.miura()
    if law is not None:  # made here because making it compiles kernels
        options["fold_law"] = law()
    if model == "shell":
        structure: Any = fd.shell(pattern, SHEET, divisions=2, **options)
    else:
        options["preset"] = model
        structure = fd.discretize(pattern, SHEET, **options)
    held = [fd.Fix("xmin"), *supports]
    return fd.Case(structure, held, [PUSH, *loads], damping, contact=contact, air=air)


def moved(
    *methods: str, start: Sequence[float] = (0.0, 0.0, 0.0), steps: int = STEPS, **parts: Any
) -> None:
    """Run motions of a few steps."""
    made = case(**parts)
    x = made.structure.nodes[:, :1] - made.structure.nodes[:, 0].min()
    initial = fd.State(velocity=np.where(made.fixed, 0.0, 2.0 * x * start))
    for name in methods:
        dt = LONG if METHODS[name].implicit else SHORT
        given: dict[str, Any] = {} if METHODS[name].adaptive else {"dt": dt}
        fd.simulate(made, steps * dt, method=name, initial=initial, **given)


def adapted() -> None:
    """Run an implicit motion with adaptive steps."""
    fd.simulate(case(), STEPS * LONG, method=IMPLICIT[-1], tolerance=1e-3)


def jumped() -> None:
    """Run an implicit motion with a jump in force while the rest angles move."""
    jump = fd.Force("xmax", (1.0, 0.0, 0.0), fd.Step(1.5 * LONG))
    fd.simulate(case(loads=[jump, *TURNING]), STEPS * LONG, method=IMPLICIT[0], dt=LONG)


def folded() -> None:
    """Fold a pattern, evaluate laws' curves, and find a corner in a photograph."""
    fd.fold(fd.patterns.simple_fold(dihedral=170), 90.0, steps=2)
    in_series(fd.EnhancedLinear(), 1.0, 3.0, 0.5)
    fd.materials.LinearBar().stress(1.0)
    refine(np.zeros((40, 40), np.uint8), [[20.0, 20.0]], reach=8.0, moved=2.0)


def moved_at_once() -> None:
    """Run motions of several cases in one batch."""
    made = case(model="herkal", mass="circumcenter")
    many = [made.altered(masses=[fd.PointMass("xmax", 1.0 + k)]) for k in range(8)]
    fd.simulate_many(many, STEPS * SHORT, dt=SHORT)


def traced(factor: float, **parts: Any) -> None:
    """Trace paths of a few equilibria."""
    made = case(**parts)
    fd.trace(made, "newton", load_factors=[factor])
    fd.trace(made, "arc_length", first_step=0.5 * factor, steps=2)


def waited() -> None:
    """Trace a path whose steps take time, so that creases relax."""
    fd.trace(case(law=PRONY), "newton", load_factors=[1e-3, 1e-3], duration=0.1)
    fd.EnhancedLinear().moment(1.0, rest=2.0)  # as paths do whose panels meet


def vibrating(**parts: Any) -> None:
    """Compute modes and a frequency response."""
    made = case(**parts)
    fd.modes(made, 2)
    fd.frf(made, fd.Force("xmax", (1.0, 0.0, 0.5)), frequencies=[0.1, 0.3])


Uses = Mapping[str, Sequence[Callable[[], None]]]
TOUCHING: dict[str, Any] = {"pattern": sheets(), "start": (-0.6, 0.2, -1.0)}


def differentiated(*methods: str, **parts: Any) -> None:
    """Differentiate motions and a frequency with respect to crease stiffness."""
    made, given = case(**parts), {"duration": STEPS * SHORT, "dt": SHORT}
    modes = {"kind": "modes", "count": 2}
    fd.sensitivity(made, ["fold_stiffness"], measures="frequency[2]", analysis=modes)
    for method in methods:
        motion = {"kind": "dynamics", "method": method, **given}
        fd.sensitivity(made, ["fold_stiffness"], measures="displacement[8,z]", analysis=motion)


def accompanied() -> None:
    """Run two implicit motions in lockstep, as fits do."""
    made, given = case(), {"duration": STEPS * LONG, "dt": LONG, "method": IMPLICIT[0]}
    asked = Asked(made, given)
    motions(prepare(made, **given), asked, [asked], 1e-4)


def apart() -> None:
    """Compute the distances between panels."""
    made = case().structure
    clearance(made.nodes, made.triangles, made.triangle_panel)


STAGES: Sequence[Uses] = (
    {"bars and hinges": [vibrating, partial(moved, "rk4")]},
    {
        "contact": [
            partial(moved, *EXPLICIT, contact=RUBBING, **TOUCHING),
            partial(moved, *EXPLICIT, contact=ON_GROUND),
            apart,
        ],
        "explicit methods": [
            partial(moved, *EXPLICIT, supports=[*WOUND, *TIED], damping=DAMPED),
            partial(moved, *EXPLICIT, supports=MOVING, loads=[*TURNING, *FOLLOWING]),
            partial(moved, *EXPLICIT, mass="consistent", clamped="xmin"),
        ],
        "panels as plates": [
            partial(vibrating, model="n5b8e"),
            partial(moved, "rk4", "newmark", model="n5b8e"),
            partial(vibrating, membrane="bars", bend_law="superlinear", calibration="standard"),
            partial(moved, "rk4", "newmark", membrane="bars"),
        ],
        "shells": [partial(vibrating, model="shell"), partial(moved, "newmark", model="shell")],
        "air": [
            partial(vibrating, air=fd.Air()),
            partial(moved, *EXPLICIT, air=fd.Air(velocity=(0, 0, 9), history=PULSE)),
            partial(moved, *IMPLICIT, CONSERVING, air=fd.Air(added_mass=False)),
        ],
        "several motions at once": [moved_at_once],
        "gradients": [
            partial(differentiated, "rk4", "newmark", supports=SPRINGS, damping=DAMPED),
            partial(differentiated, "rk4", "newmark", model="n5b8e"),
        ],
        "folding and tracking": [folded],
    },
    {
        "implicit methods": [
            partial(moved, *IMPLICIT),
            adapted,
            jumped,
            accompanied,
            partial(moved, *IMPLICIT, supports=[*WOUND, *TIED], damping=DAMPED),
            partial(moved, *IMPLICIT, supports=MOVING, loads=[*TURNING, *FOLLOWING]),
            partial(moved, *IMPLICIT, damping=[MODAL], supports=DASHPOTS),
        ],
        "laws with memory": [
            partial(moved, *REMEMBER, *IMPLICIT, law=PRONY, damping=[fd.CreaseDamping(0.2)]),
            partial(moved, *REMEMBER, *IMPLICIT, law=PLASTIC, supports=SPRINGS),
            partial(moved, *REMEMBER, law=PRONY, damping=[fd.CreaseDamping(0.2)], model="n5b8e"),
        ],
        "paths": [
            partial(traced, 1e-3, supports=SPRINGS, loads=[*TURNING, *FOLLOWING], clamped="xmin"),
            waited,
        ],
    },
    {
        "energy_momentum": [
            partial(moved, CONSERVING, fold_law="linear"),
            partial(moved, CONSERVING, supports=WOUND, clamped="xmin"),
            partial(moved, CONSERVING, model="n5b8e"),
            partial(moved, CONSERVING, membrane="bars"),
            partial(moved, CONSERVING, model="shell"),
            partial(moved, CONSERVING, supports=MOVING, loads=[*TURNING, *FOLLOWING]),
            partial(moved, CONSERVING, damping=[*DAMPED, MODAL], supports=DASHPOTS),
            partial(moved, CONSERVING, law=PRONY),
        ],
        "contact in implicit methods and paths": [
            partial(moved, *IMPLICIT, contact=RUBBING, **TOUCHING),
            partial(moved, *IMPLICIT, contact=ON_GROUND),
            partial(traced, 1e-3, contact=ON_GROUND),
        ],
        "contact in energy_momentum": [
            partial(moved, CONSERVING, steps=20, contact=RUBBING, **TOUCHING),
            partial(moved, CONSERVING, contact=ON_GROUND),
        ],
    },
)
"""Computations, named by what they compile, in stages. Computations of a stage share few kernels;
each stage needs kernels of the stages before."""


@contextmanager
def count_compiled() -> Iterator[Callable[[], int]]:
    """Yield a function that returns the number of functions compiled so far in this context."""
    from numba.core import event  # imported only after `foldyn.jit` has checked Numba's variables

    with event.install_recorder("numba:compile") as recorder:
        yield lambda: sum(one.is_start for _, one in recorder.buffer)


def use(name: str) -> int:
    """Run one of `STAGES` by name; return the number of functions it compiled."""
    (uses,) = (stage[name] for stage in STAGES if name in stage)
    with count_compiled() as compiled, quietly():
        for compute in uses:
            compute()
        return compiled()
