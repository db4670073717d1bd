"""The conserving method: what is kept, what is lost, where it ends; creases that remember, too."""

from __future__ import annotations

from itertools import product
from typing import Any

import numpy as np
import pytest
from measured import apart, drift, energy, momenta, order, strain
from moving_sheets import CELL_HELD, HEAVY, cell, spinning

import foldyn as fd
from pairwise import beyond, in_pairs

MODELS = ("plate", "n5b8e", "shell")
ELASTIC = fd.EnhancedLinear(70, 290)
LAWS = {
    "prony": fd.Prony([0.5, 0.2], [0.02, 0.3], law=ELASTIC),
    "plastic": fd.Plastic(1.5e-3, isotropic=5e-3, kinematic=1e-2, law=ELASTIC),
    "eyring": fd.Eyring(1e-3, 1e-2, law=ELASTIC),
}
METHOD = "energy_momentum"
MOMENT = 0.01  # N m, a fifth of the creases' stiffness
AXIAL = [
    fd.Spring(0.3, between=[(3, 10)]),
    fd.Spring(0.05, between=[(0, 14)], rest_length=2.0),
    fd.Spring(0.02, between=[(4, 11)], rest_length=0.0),
]
GROUNDED = [fd.Spring(2.0, [9], direction="z"), fd.Spring(0.6, [14])]
HELD = [fd.Fix([0, 1, 2], "x"), fd.Fix([0, 2], "z"), fd.Fix([1], "y")]
PAPER = fd.Sheet(1.219e9, 0.2, 0.24e-3, 667.0, length_scale_ratio=2.7)


def sheet(model: str, **options: Any) -> Any:
    pattern = fd.patterns.miura((2, 1), dihedral=100)
    options = {"fold_law": ELASTIC} | options
    if model == "shell":
        return fd.shell(pattern, HEAVY, divisions=1, **options)
    return fd.discretize(pattern, HEAVY, preset=model, **options)


def thrown(case: fd.Case, spin=(0.1, 1.0, 0.15)) -> fd.State:
    """Flying, and spinning about an oblique axis."""
    start = spinning(case.structure, spin, (0.4, 0.0, 1.0))
    return fd.State(velocity=np.where(case.fixed, 0.0, start.velocity))


def paper(mass: str = "mixed_voronoi") -> tuple[fd.Case, fd.State]:
    """The sheet of the gallery's free flight, or a part of it, with smooth laws.

    Centrifugal forces open and close the folds.
    """
    pattern = fd.patterns.miura((2, 1), 0.025, b=0.025, dihedral=90)
    laws = {"bend_law": "linear", "fold_law": fd.EnhancedLinear(20, 340)}
    s = fd.discretize(pattern, PAPER, mass=mass, preset="herkal", **laws)
    return fd.Case(s), spinning(s, (2.0, 50.0, 1.5), (0.4, 0.0, 2.0))


def drifts(case: fd.Case, motion: Any) -> float:
    """Largest change of the energy, with what is lost, and of both momenta."""
    p, h = momenta(case.structure, motion)
    assert drift(p) < 1e-12
    return max(drift(energy(motion) + motion.dissipated.values), drift(h))


@pytest.mark.parametrize(("model", "law", "dt"), in_pairs(MODELS, [None, *LAWS], [4e-3, 5e-2]))
def test_a_free_sheet_with_springs_keeps_both_momenta_and_loses_what_creases_take(model, law, dt):
    """Also with steps in which it turns by 3 degrees, hundreds of times RK4's critical one."""
    case = fd.Case(sheet(model, fold_law=LAWS.get(law, ELASTIC)), AXIAL)
    motion = fd.simulate(case, 100 * dt, method=METHOD, dt=dt, every_steps=10, initial=thrown(case))
    assert drifts(case, motion) < 1e-11
    assert np.ptp(motion.strain_springs.values) > 0.05 * float(motion.strain_springs[0])
    assert (np.diff(motion.dissipated) >= 0.0).all()
    least = -1.0 if law in (None, "plastic") else 1e-8 * energy(motion)[0]
    assert float(motion.dissipated[-1]) > least


@pytest.mark.parametrize("kind", [*beyond(MODELS, 2), *beyond(["mixed_voronoi", "consistent"])])
def test_nothing_adds_up_over_many_steps(kind):
    """Of paper steps are five times RK4's critical ones, and folds turn by degrees back and forth.

    Found: 1e-12 after 10,000 steps.
    """
    count = 1_000 if kind in MODELS else 10_000
    if kind in MODELS:
        case, dt = fd.Case(sheet(kind), AXIAL), 5e-3
        start = thrown(case, (0.03, 0.3, 0.05))
    else:
        (case, start), dt = paper(kind), 1e-4
        assert dt > 5.0 * fd.critical_step(case)
    motion = fd.simulate(case, count * dt, method=METHOD, dt=dt, every_steps=100, initial=start)
    assert motion.attrs["steps"] == count
    assert drifts(case, motion) < 1e-13 * count
    if kind not in MODELS:
        folds = np.array([case.structure.dihedrals(u)[0] for u in motion.displacement.values])
        assert np.degrees(np.ptp(folds, axis=0).max()) > 5.0
        assert np.ptp(strain(motion)) > 1e-3 * energy(motion)[0]


@pytest.mark.parametrize(("duration", "options"), [(0.1, {"tolerance": 1e-4}), (0.3, {"dt": 1e-3})])
def test_steps_that_follow_their_error_and_large_ones_conserve_too(duration, options):
    """A twentieth of a turn in a step, with stiff bars: no failure, nothing gained or lost."""
    case, start = paper()
    motion = fd.simulate(case, duration, method=METHOD, initial=start, **options)
    assert drifts(case, motion) < (1e-10 if "tolerance" in options else 1e-9)
    assert motion.attrs["halved_steps"] < 100
    if "tolerance" in options:
        assert motion.attrs["largest_step"] > 1.2 * motion.attrs["smallest_step"]


@pytest.mark.parametrize("dt", [1e-3, 1e-2])
@pytest.mark.parametrize("model", ["herkal", "shell"])
def test_a_clamped_sheet_on_springs_keeps_its_energy(model, dt):
    case = fd.Case(sheet(model, clamped=[(0, 1)]), [fd.Fix([0, 1]), *AXIAL, *GROUNDED])
    start = thrown(case, (0.0, 0.3, 0.0))
    motion = fd.simulate(case, 200 * dt, method=METHOD, dt=dt, every_steps=10, initial=start)
    total = energy(motion)
    assert np.ptp(motion.kinetic.values) > 0.05 * total[0]
    assert np.ptp(total) < 1e-9 * max(total[0], 1.0)


@pytest.mark.matrix
@pytest.mark.filterwarnings("ignore:the energy balance")  # of the other method
@pytest.mark.parametrize("bend_law", ["linear", "superlinear"])
def test_snap_through_keeps_its_energy(bend_law):
    """A sheet pushed far from rest and let go: energies change hands, their sum stays."""
    case = fd.Case(cell(bend_law=bend_law), CELL_HELD)
    v = np.zeros(case.structure.nodes.shape)
    v[[6, 7, 8], 0] = -1.0
    motion, plain = (
        fd.simulate(case, 2.0, method=method, dt=2e-3, initial=fd.State(velocity=v))
        for method in (METHOD, "generalized_alpha")
    )
    assert float(motion.strain_folds.max()) > 0.2 * energy(motion)[0]
    assert drift(energy(motion)) < 1e-10
    assert drift(energy(plain)) > 1e-5


def everything(model: str, **options) -> fd.Case:
    """A sheet with loads of many kinds, moving supports, an actuated fold, springs and damping."""
    supports = [
        *HELD, fd.Impose([12], "x", 0.02, fd.Ramp(0.05)),
        fd.BaseMotion("z", fd.Harmonic(20.0), 1e-3),
        *AXIAL, *GROUNDED, fd.Dashpot(5.0, between=[(2, 6)]),
    ]  # fmt: skip
    loads = [
        fd.Force([14], (0.0, 0.0, 1.0), fd.Harmonic(30.0)),
        fd.Gravity((0.0, 0.0, -9.81)),
        fd.Actuate([3, 5], 150.0, fd.Ramp(0.05)),
        fd.Pressure(3.0, history=fd.Harmonic(10.0)),
        fd.CreaseMoment([1], 0.05, fd.Ramp(0.02)),
    ]
    damping = [fd.Rayleigh(alpha=1.0, beta=1e-5), fd.StrainDamping(1e-5)]
    s = sheet(model, **options)
    return fd.Case(s, supports, loads, damping[: 2 if model == "plate" else 1])


@pytest.mark.filterwarnings("ignore:damping. beta resists rotations")
@pytest.mark.parametrize(
    ("model", "options"),
    [
        *((model, {}) for model in MODELS),
        ("herkal", {"mass": "mixed_voronoi"}),
        ("herkal", {"mass": "consistent"}),
        *((model, {"fold_law": LAWS["prony"]}) for model in MODELS),
    ],
)
def test_the_balance_closes_with_everything_that_acts(model, options):
    motion = fd.simulate(everything(model, **options), 0.1, method=METHOD, dt=5e-4)
    parts = {name: float(np.abs(motion[name]).max()) for name in ("dissipated", "work", "kinetic")}
    assert min(parts.values()) > 1e-3 * max(parts.values())
    assert motion.attrs["energy_error"] < 1e-9


@pytest.mark.matrix
@pytest.mark.parametrize("model", MODELS)
def test_it_is_of_order_two_and_tends_to_the_motion_of_other_methods(model):
    case, steps = everything(model), [50, 100, 200]

    def end(method: str, n: int) -> np.ndarray:
        return fd.simulate(
            case, 0.02, method=method, dt=0.02 / n, every_steps=n
        ).displacement.values[-1]

    right = end("newmark", 1600)
    errors = [apart(end(METHOD, n), right) for n in steps]
    assert order(steps, errors) == pytest.approx(2.0, abs=0.1)
    assert errors[-1] < 5e-5


@pytest.mark.matrix
@pytest.mark.parametrize("model", ["n5b8e", "shell"])
def test_dofs_without_mass_do_not_ring(model):
    """What they store beyond their balance: nothing with a linear law, little with another."""
    for law, most in (("linear", 1e-11), ("superlinear", 1e-4)):
        case = fd.Case(sheet(model, fold_law=law))
        motion = fd.simulate(
            case, 2.0, method=METHOD, dt=5e-3, every_steps=20, initial=thrown(case)
        )
        body = case.structure.body
        least = [body.energies(body.dofs(u)).sum() for u in motion.displacement.values]
        assert np.abs(strain(motion) - least).max() < most * strain(motion).max()


@pytest.mark.parametrize("model", ["n5b8e", "shell"])
def test_a_moment_that_jumps_moves_dofs_without_mass_at_once(model):
    s = sheet(model)
    jump = fd.CreaseMoment("all", 0.3 * float(s.fold_stiffness[0]), fd.Step(0.05))
    motion = fd.simulate(fd.Case(s, [fd.Fix([0, 1, 2])], [jump]), 0.2, method=METHOD, dt=2e-3)
    assert float(motion.work[-1]) > 1e-6
    assert motion.attrs["energy_error"] < 1e-9


# ------------------------------------------------------------------ creases that remember
def moved(model: str, law: str, *loads: fd.CreaseMoment, **parts: Any) -> fd.Case:
    """A sheet whose creases are turned, and yield or creep."""
    turned = fd.CreaseMoment("all", MOMENT, fd.Ramp(0.1))
    s = sheet(model, fold_law=LAWS.get(law, law))
    return fd.Case(s, [fd.Fix([0, 1, 2])], [turned, *loads], **parts)


@pytest.mark.parametrize("law", LAWS)
@pytest.mark.parametrize("model", MODELS)
def test_the_balance_closes_also_where_moments_jump(model, law):
    jump = fd.CreaseMoment([1], 0.5 * MOMENT, fd.Step(0.31))
    case = moved(model, law, jump, damping=[fd.CreaseDamping(1e-4)])
    for options in ({"dt": 6e-3}, {"tolerance": 1e-4}):
        motion = fd.simulate(case, 0.6, method=METHOD, **options)
        assert float(motion.dissipated[-1]) > 0.03 * float(motion.work.max())
        assert (np.diff(motion.dissipated) >= 0.0).all()
        assert motion.attrs["energy_error"] < 1e-11


@pytest.mark.matrix
@pytest.mark.parametrize(
    ("model", "law"),
    [
        *zip(MODELS, LAWS, strict=True),
        *beyond(row for row in product(MODELS, LAWS) if row not in zip(MODELS, LAWS, strict=True)),
    ],
)
def test_with_memory_it_tends_to_the_motion_of_other_methods_with_order_two(model, law):
    """Dofs without mass do not ring, which would show in the states of the creases."""
    case, steps = moved(model, law), [100, 200, 400]

    def end(method: str, **options: Any) -> list[np.ndarray]:
        motion = fd.simulate(case, 0.2, method=method, interval=0.2, **options)
        return [motion[name].values[-1] for name in ("displacement", "memory")]

    if case.structure.massless:
        right = end("newmark", dt=0.2 / 3200)
    else:
        right = end("dormand_prince", tolerance=1e-10)
    found = [end(METHOD, dt=0.2 / n) for n in steps]
    for k in range(2):
        errors = [apart(ends[k], right[k]) for ends in found]
        assert errors[-1] < 2e-3
        assert law == "plastic" or order(steps, errors) > 1.8


@pytest.mark.matrix
def test_newtons_method_takes_as_many_iterations_as_without_memory():
    counts = [
        fd.simulate(moved("plate", law), 0.6, method=METHOD, dt=6e-3).attrs["iterations"]
        for law in ("linear", *LAWS)
    ]
    assert max(counts) < 1.1 * counts[0]


@pytest.mark.parametrize("model", MODELS)
def test_moments_that_jump_turn_creases_that_relax_at_once(model):
    """Elastically, as the motion does that starts with the jump: also dofs without mass."""
    jump = fd.CreaseMoment("all", MOMENT, fd.Step(0.01))
    case = fd.Case(sheet(model, fold_law=LAWS["prony"]), [fd.Fix([0, 1, 2])], [jump])
    motion = fd.simulate(case, 0.02, method="generalized_alpha", dt=1e-4)
    assert motion.attrs["energy_error"] < 1e-7


@pytest.mark.parametrize(("method", "error"), [("generalized_alpha", 1e-3), (METHOD, 1e-11)])
def test_a_moment_that_has_grown_may_jump(method, error):
    """What it did before does not count twice."""
    jump = fd.CreaseMoment("all", MOMENT, fd.Step(0.05))
    motion = fd.simulate(moved("plate", "linear", jump), 0.1, method=method, dt=1e-3)
    assert motion.attrs["energy_error"] < error


@pytest.mark.matrix
@pytest.mark.parametrize("law", LAWS)
def test_contact_and_memory_go_together(law):
    """A sheet that falls on the ground and is folded there."""
    ground = fd.Plane((0.0, 0.0, -0.05), (0.0, 0.0, 1.0), friction=0.2)
    s = sheet("plate", fold_law=LAWS[law])
    case = fd.Case(s, [], [fd.Gravity((0.0, 0.0, -9.81))], contact=fd.Contact(planes=[ground]))
    motion = fd.simulate(case, 0.3, method=METHOD, dt=1e-3)
    assert float(motion.contact.max()) > 0.0
    assert float(motion.memory[-1].max()) > 0.0
    assert motion.attrs["energy_error"] < 1e-9
