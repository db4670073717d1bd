"""Laws of mechanics for cases at random: relative motion, reciprocity, balances, settled motions.

Drawn as in `draws`, for every model, without contact, in air where the analysis takes it. What
fails is found again by its seed.
"""

from __future__ import annotations

import os
from collections.abc import Callable
from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from draws import MODELS, SHELL, SMALL, STEPS, Scene, drawn, pattern_of, scene_of, structure_of

import foldyn as fd
from foldyn.cases.constraints import AGREES
from foldyn.cases.damping import DAMPINGS
from foldyn.cases.loads import LOADS
from foldyn.cases.supports import SUPPORTS
from foldyn.dynamics import METHODS
from foldyn.dynamics.dampers import damping_matrix
from foldyn.dynamics.driver import prepare
from foldyn.dynamics.generalized_alpha import Alpha
from foldyn.errors import ComputationError, InputError
from foldyn.mechanics.following import following_force, joined

pytestmark = pytest.mark.filterwarnings("ignore::foldyn.errors.FoldynWarning")

RELATIVE = [kind for kind in DAMPINGS if kind not in (fd.Rayleigh, fd.ModalDamping)]
CLOSE = 1e-7
ROUNDED = 1e-11
TRIES = 30
MANY = range(1000, 1000 + int(os.environ.get("DRAWS", "500")) // 4)
LATE = 1e4  # times as far apart may motions be whose flows are found anew at other times
MOVES = [(how, model) for model in MODELS for how in METHODS if model != SHELL]
MOVES += [(how, SHELL) for how in ("newmark", "generalized_alpha", "energy_momentum")]


@pytest.fixture(autouse=True)
def to_rounding(monkeypatch):
    """Equations solved to rounding: where the iteration stops depends on the frame."""
    monkeypatch.setattr(Alpha, "tolerance", 1e-12)


def first(seed: int, model: str, implicit: bool, make: Callable[[Scene], Any]) -> Any:
    """What is made of the first structure of a model for which the library takes all."""
    for attempt in range(TRIES):
        rng = np.random.default_rng((seed, attempt))
        scene = scene_of(structure_of(model, pattern_of(rng), rng, ""), rng, implicit)
        try:
            return make(scene)
        except (InputError, ComputationError):  # refused, unstable, no equilibrium
            continue
    raise AssertionError("all that was drawn is refused")


def grown(case: fd.Case, name: str, kinds: Any, most: int, scene: Scene, takes: Any) -> fd.Case:
    """The case with up to so many more parts of some kinds, which `takes` takes."""
    attribute = "dampings" if name == "damping" else name
    for _ in range(scene.rng.integers(most + 1)):
        for _ in range(TRIES):
            try:
                before = getattr(case, attribute) if name != "damping" or case.damped else ()
                more = case.altered(**{name: [*before, drawn(scene, kinds)]})
                if takes(more):
                    case = more
                    break
            except InputError:
                continue
    return case


def held(scene: Scene) -> fd.Case:
    faces = scene.pattern.faces
    return fd.Case(scene.structure, [fd.Fix(list(faces[scene.rng.integers(len(faces))]))])


# ------------------------------------------------------------------ relative motion
def adrift(case: fd.Case) -> bool:
    """Whether nothing ties a case to the ground: a uniform velocity meets no force."""
    if case.supported_dofs.size or case.imposed_terms or case.base_terms or case.rayleigh.alpha:
        return False
    body, nodes = case.elastic_body, case.structure.nodes
    rest = body.dofs(np.zeros_like(nodes))
    whole = np.zeros((body.size, 3))
    whole[: nodes.size] = np.tile(np.eye(3), (len(nodes), 1))
    for matrix in (body.tangent(rest), damping_matrix(case, rest)):
        if matrix.nnz and np.abs(matrix @ whole).max() > AGREES * np.abs(matrix.data).max():
            return False
    tied = [case.constraints.values(along[: nodes.size]) for along in whole.T]
    return bool(np.abs(tied).max(initial=0.0) < AGREES)


def check_drift(seed: int, method: str, model: str) -> None:
    """A free sheet in a steady wind moves alike in a frame that moves evenly."""

    def make(scene: Scene):
        implicit, shape = METHODS[method].implicit, scene.structure.nodes.shape
        options = {"method": method, "duration": scene.time, "interval": scene.time / STEPS}
        options |= {"dt": scene.time / STEPS} if implicit else {}
        air = replace(drawn(scene, [fd.Air]), history=fd.Air().history)
        case = fd.Case(scene.structure, air=air)
        prepare(case, **options)

        def takes(other: fd.Case) -> bool:
            return adrift(other) and bool(prepare(other, **options))

        kinds = {"supports": (SUPPORTS, 1), "damping": (DAMPINGS, 1), "loads": (LOADS, 2)}
        for name, (of, most) in kinds.items():
            case = grown(case, name, of, most, scene, takes)
        v = SMALL * scene.size / scene.time * scene.rng.normal(size=(shape[0] + 1, 3))
        drift, v = v[-1], v[:-1]
        try:
            prepare(case, initial=fd.State(velocity=v), **options)
        except InputError:  # what is tied together moves together
            v = np.zeros(shape)
        options["dt"] = prepare(case, initial=fd.State(velocity=v), **options).plan.dt
        if METHODS[method].adaptive:  # steps that are all alike
            options |= {"dt": 0.3 * options["dt"], "tolerance": 1e-3}
        return case, options, v, drift, fd.simulate(case, initial=fd.State(velocity=v), **options)

    case, options, v, drift, one = first(seed, model, METHODS[method].implicit, make)
    wind = tuple((drift + case.air.velocity).tolist())
    moved = case.altered(air=replace(case.air, velocity=wind))
    other = fd.simulate(moved, initial=fd.State(velocity=v + drift), **options)
    apart = other.displacement.values - other.time.values[:, None, None] * drift
    apart = np.abs(apart - one.displacement.values).max()
    late = METHODS[method].adaptive and one.attrs.get("flows", 1) > 1
    size = np.abs(other.displacement.values).max()
    assert apart < CLOSE * size * (LATE if late else 1.0), f"{apart / size}: {case}"


@pytest.mark.matrix
@pytest.mark.parametrize("seed", range(0, len(MOVES) - 3, 5))
def test_sheets_in_wind_move_alike_in_every_frame(seed):
    check_drift(seed, *MOVES[seed])


@pytest.mark.matrix
@pytest.mark.parametrize("seed", MANY)
def test_many_sheets_in_wind_move_alike_in_every_frame(seed):
    check_drift(seed, *MOVES[seed % len(MOVES)])


# ------------------------------------------------------------------ reciprocity
def check_reciprocity(seed: int, model: str) -> None:
    """A force at one place moves another as a force there moves the first, at all frequencies."""

    def make(scene: Scene):
        case = held(scene)
        if scene.rng.random() < 0.7:
            case = case.altered(air=replace(drawn(scene, [fd.Air]), velocity=(0.0, 0.0, 0.0)))
        kinds = {"supports": (SUPPORTS, 1), "damping": (DAMPINGS, 2)}
        for name, (of, most) in kinds.items():
            case = grown(case, name, of, most, scene, lambda other: not other.base_terms)
        ends = scene.some(len(scene.pattern.vertices), 2) * 2
        forces = [fd.Force([node], scene.vector(scene.force)) for node in ends[:2]]
        f = float(fd.modes(case, 3).frequency[2])
        options = {"frequencies": [0.01 * f, 0.6 * f, 1.1 * f], "method": "direct"}
        if scene.rng.random() < 0.3 and not case.air:
            options |= {"method": "modal", "count": 4}
        return case, forces, [fd.frf(case, force, **options) for force in forces]

    case, forces, responses = first(seed, model, True, make)
    work = [
        response.receptance.values[:, other.nodes[0]] @ other.vector * float(response.drive_force)
        for response, other in zip(responses, forces[::-1], strict=True)
    ]
    size = [
        np.linalg.norm(response.receptance.values, axis=(1, 2)) * float(response.drive_force)
        for response in responses
    ]
    most = np.maximum(np.maximum(*size), np.finfo(float).tiny)  # nothing moves what is held
    apart = np.abs(work[0] - work[1]) / np.linalg.norm(forces[0].vector) / most
    assert apart.max() < CLOSE, f"{apart}: {case}"


@pytest.mark.parametrize("model", MODELS)
def test_responses_are_reciprocal(model):
    check_reciprocity(7, model)


@pytest.mark.matrix
@pytest.mark.parametrize("seed", MANY)
def test_many_responses_are_reciprocal(seed):
    check_reciprocity(seed, MODELS[seed % len(MODELS)])


# ------------------------------------------------------------------ balances
def load_on(case: fd.Case, u: np.ndarray, factors: Callable[[Any], float]) -> np.ndarray:
    """Forces (n, 3) of all loads at the displacement u (n, 3), N; `factors` of histories."""
    size = case.structure.nodes.size
    out = sum((factors(h) * f for f, h in case.load_terms), np.zeros((len(u), 3)))
    parts = [(part, k) for k, (part, _) in enumerate(case.following_terms)]
    if parts:
        scale = np.array([[factors(h)] for _, h in case.following_terms])
        full = case.body.dofs(u)
        out = out + following_force(joined(parts), full, scale)[:size].reshape(-1, 3)
    return out


def reaction(result: Any, at: int, shape: tuple[int, int]) -> np.ndarray:
    """Forces (n, 3) of the supports in a sample, N."""
    out = np.zeros(shape)
    axis = ["xyz".index(name) for name in result.support_axis.values]
    out[result.support_node.values, axis] = result.reaction.values[at]
    return out


def rounded(case: fd.Case) -> float:
    """Forces (N) that are rounding errors of those in a sheet at a strain of 1, but for CLOSE."""
    return ROUNDED / CLOSE * float(case.body.scale().max())


def check_statics(seed: int, model: str) -> None:
    """Supports bear the loads: their forces add up to zero, and so do their moments."""

    def make(scene: Scene):
        case = held(scene)
        case = grown(case, "supports", [fd.Impose, fd.Fix], 1, scene, lambda _: True)
        case = grown(case, "loads", LOADS, 3, scene, lambda _: True)
        return case, fd.trace(case, load_factors=[0.5, 1.0])

    case, path = first(seed, model, True, make)
    for at, factor in enumerate(path.load_factor.values):
        u = path.displacement.values[at]
        load = load_on(case, u, lambda _, factor=factor: factor)
        borne = reaction(path, at, u.shape)
        x = case.structure.nodes + u
        x = x - x.mean(axis=0)
        size = max(np.abs(load).sum(), np.abs(borne).sum(), rounded(case))
        assert np.abs((load + borne).sum(axis=0)).max() <= CLOSE * size, f"forces: {case}"
        if not case.structure.options.clamped:  # where edges bear moments, too
            left = np.abs(np.cross(x, load + borne).sum(axis=0)).max()
            assert left <= CLOSE * size * case.structure.pattern.size, f"moments: {case}"


@pytest.mark.parametrize("model", MODELS)
def test_supports_bear_the_loads(model):
    check_statics(5, model)


@pytest.mark.matrix
@pytest.mark.parametrize("seed", MANY)
def test_supports_bear_many_loads(seed):
    check_statics(seed, MODELS[seed % len(MODELS)])


def check_momenta(seed: int, model: str) -> None:
    """Supports and loads give the sheet its momentum: the trapezoid rule has it exactly."""

    def make(scene: Scene):
        case = held(scene)
        options = {
            "duration": scene.time,
            "dt": scene.time / STEPS,
            "every_steps": 1,
            "method": "newmark",
        }

        def takes(other: fd.Case) -> bool:
            jumps = [t for _, h in (*other.load_terms, *other.following_terms) for t in h.jumps()]
            return not any(jumps) and bool(prepare(other, **options))  # jumps would divide steps

        kinds = {"loads": (LOADS, 3), "damping": (RELATIVE, 1), "masses": ([fd.PointMass], 1)}
        for name, (of, most) in kinds.items():
            case = grown(case, name, of, most, scene, takes)
        motion = fd.simulate(case, **options)
        if motion.attrs["halved_steps"]:
            raise ComputationError("the rule holds in each half")
        return case, motion

    case, motion = first(seed, model, True, make)
    times, dt = motion.time.values, motion.attrs["dt"]
    shape = motion.displacement.shape[1:]
    force = np.array([
        reaction(motion, k, shape).sum(axis=0)
        + load_on(case, motion.displacement.values[k], lambda h, t=t: h(t)).sum(axis=0)
        for k, t in enumerate(times)
    ])  # fmt: skip
    given = 0.5 * dt * (force[1:] + force[:-1])
    v = motion.velocity.values
    got = np.einsum("i,tia->ta", case.nodal_mass, np.diff(v, axis=0))
    apart = np.abs(got - given).max() / max(np.abs(given).max(), dt * rounded(case))
    assert apart < CLOSE, f"{apart}: {case}"


@pytest.mark.parametrize("model", MODELS)
def test_sheets_have_the_momentum_that_forces_give(model):
    check_momenta(4, model)


@pytest.mark.matrix
@pytest.mark.parametrize("seed", MANY)
def test_many_sheets_have_the_momentum_that_forces_give(seed):
    check_momenta(seed, MODELS[seed % len(MODELS)])


# ------------------------------------------------------------------ settled motions
def check_settled(seed: int, model: str) -> None:
    """A damped motion under loads that grow slowly ends at the equilibrium of statics."""

    def make(scene: Scene):
        case = held(scene)
        if scene.rng.random() < 0.5:
            case = case.altered(air=fd.Air(density=5.0, added_mass=False))
        case = grown(case, "loads", LOADS, 3, scene, lambda _: True)
        path = fd.trace(case, load_factors=[0.5, 1.0])
        if not path.displacement.values.any():
            raise InputError("all loads act on what is held")
        slowest = float(fd.modes(case, 1, state=fd.initial_state(path)).eigenvalue[0]) ** 0.5
        if not slowest > 1e-2 / scene.time:
            raise InputError("a mechanism, or unstable")
        duration, ramp = 45.0 / slowest, fd.Ramp(12.0 / slowest, smooth=True)
        damping = [fd.Rayleigh(alpha=2.0 * slowest)]
        loads = [replace(load, history=ramp) for load in case.loads]
        case = case.altered(loads=loads, damping=damping)
        options = {"dt": duration / 300.0, "interval": duration}
        return case, path, fd.simulate(case, duration, method="generalized_alpha", **options)

    case, path, motion = first(seed, model, True, make)
    there, settled = path.displacement.values[-1], motion.displacement.values[-1]
    apart = np.abs(settled - there).max() / np.abs(there).max()
    assert apart < CLOSE, f"{apart}: {case}"


@pytest.mark.parametrize("model", MODELS)
def test_damped_motions_settle_where_statics_says(model):
    check_settled(4, model)


@pytest.mark.matrix
@pytest.mark.parametrize("seed", MANY)
def test_many_damped_motions_settle_where_statics_says(seed):
    check_settled(seed, MODELS[seed % len(MODELS)])
