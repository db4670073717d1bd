"""The conserving method with creases that remember: what is kept, what is lost, where it ends."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from test_conserving_terms import AXIAL, GROUNDED, MODELS, drift, energy, sheet, thrown

import foldyn as fd
from foldyn.checks import observed_order
from pairwise import in_pairs

ELASTIC = fd.EnhancedLinear(70, 290)
LAWS = {
    "prony": fd.Prony([0.5, 0.2], [0.02, 0.3], law=ELASTIC),
    "plastic": fd.Plastic(1.5e-3, isotropic=5e-3, kinematic=1e-2, law=ELASTIC),
    "eyring": fd.Eyring(1e-3, 1e-2, law=ELASTIC),
}
METHOD = "energy_momentum"
MOMENT = 0.01  # N m, a fifth of the creases' stiffness


def moved(model: str, law: str, *loads: fd.CreaseMoment, **parts: Any) -> fd.Case:
    """A sheet whose creases are turned, and yield or creep."""
    turned = fd.CreaseMoment("all", MOMENT, fd.Ramp(0.1))
    s = sheet(model, fold_law=LAWS.get(law, law))
    return fd.Case(s, [fd.Fix([0, 1, 2])], [turned, *loads], **parts)


@pytest.mark.parametrize(("model", "law", "dt"), in_pairs(MODELS, LAWS, [4e-3, 5e-2]))
def test_a_free_sheet_keeps_both_momenta_and_loses_what_creases_take(model, law, dt):
    case = fd.Case(sheet(model, fold_law=LAWS[law]), AXIAL)
    motion = fd.simulate(case, 100 * dt, METHOD, dt=dt, every=10, initial=thrown(case))
    p = np.array([case.structure.mass @ v for v in motion.velocity.to_numpy()])
    h = np.cross(case.structure.nodes + motion.displacement.to_numpy(), p).sum(axis=1)
    total = energy(case, motion) + motion.dissipated.to_numpy()
    assert max(drift(total), drift(h)) < 1e-11
    assert drift(p.sum(axis=1)) < 1e-13
    assert (np.diff(motion.dissipated) >= 0.0).all()
    assert float(motion.dissipated[-1]) > 1e-8 * total[0] or law == "plastic"


@pytest.mark.parametrize("law", LAWS)
@pytest.mark.parametrize("model", MODELS)
def test_the_balance_closes_also_where_moments_jump(model, law):
    jump = fd.CreaseMoment([1], 0.5 * MOMENT, fd.Step(0.31))
    case = moved(model, law, jump, damping=[fd.CreaseDamping(1e-4)])
    steps: list[dict[str, Any]] = [{"dt": 6e-3}, {"tolerance": 1e-4}]
    for options in steps:
        motion = fd.simulate(case, 0.6, METHOD, **options)
        assert float(motion.dissipated[-1]) > 0.03 * float(motion.work.max())
        assert (np.diff(motion.dissipated) >= 0.0).all()
        assert motion.attrs["energy_error"] < 1e-11


@pytest.mark.parametrize("model", MODELS)
def test_the_balance_closes_with_what_moves_and_turns(model):
    case = fd.Case(
        sheet(model, fold_law=LAWS["prony"]),
        [
            fd.Fix([0, 1, 2], "x"), fd.Fix([0, 2], "z"), fd.Fix([1], "y"), *AXIAL, *GROUNDED,
            fd.Impose([12], "x", 0.02, fd.Ramp(0.05)),
        ],
        [fd.Actuate([3, 5], 150.0, fd.Ramp(0.05)), fd.CreaseMoment([1], 0.05, fd.Ramp(0.02))],
    )  # fmt: skip
    motion = fd.simulate(case, 0.1, METHOD, dt=5e-4)
    assert float(motion.dissipated[-1]) > 1e-5 * float(motion.work.max())
    assert motion.attrs["energy_error"] < 1e-11


@pytest.mark.parametrize("law", LAWS)
@pytest.mark.parametrize("model", MODELS)
def test_it_is_of_order_two_and_tends_to_the_motion_of_other_methods(model, law):
    """Dofs without mass do not ring, which would show in the states of the creases."""
    case, duration = moved(model, law), 0.2

    def end(method: str, **options: Any) -> tuple[np.ndarray, np.ndarray]:
        motion = fd.simulate(case, duration, method, every=duration, **options)
        return motion.displacement.to_numpy()[-1], motion.memory.to_numpy()[-1]

    if case.structure.massless:
        right = end("newmark", dt=duration / 3200)
    else:
        right = end("dormand_prince", tolerance=1e-10)
    steps = np.array([100, 200, 400])
    found = [end(METHOD, dt=duration / n) for n in steps.tolist()]
    for k in range(2):
        errors = [np.abs(ends[k] - right[k]).max() for ends in found]
        assert errors[-1] < 2e-3 * np.abs(right[k]).max()
        assert law == "plastic" or observed_order(1.0 / steps, errors) > 1.8


@pytest.mark.parametrize("law", LAWS)
def test_newtons_method_takes_as_many_iterations_as_without_memory(law):
    counts = [
        fd.simulate(moved("plate", one), 0.6, METHOD, dt=6e-3).attrs["iterations"]
        for one in ("linear", law)
    ]
    assert counts[1] < 1.1 * counts[0]


@pytest.mark.parametrize("model", MODELS)
def test_moments_that_jump_turn_creases_that_relax_at_once(model):
    """Elastically, as the motion does that starts with the jump: also dofs without mass."""
    jump = fd.Case(
        sheet(model, fold_law=LAWS["prony"]), [fd.Fix([0, 1, 2])],
        [fd.CreaseMoment("all", MOMENT, fd.Step(0.01))],
    )  # fmt: skip
    motion = fd.simulate(jump, 0.02, "generalized_alpha", dt=1e-4)
    assert motion.attrs["energy_error"] < 1e-7


@pytest.mark.parametrize("method", ["generalized_alpha", METHOD])
def test_a_moment_that_has_grown_may_jump(method):
    """What it did before does not count twice."""
    jump = fd.CreaseMoment("all", MOMENT, fd.Step(0.05))
    motion = fd.simulate(moved("plate", "linear", jump), 0.1, method, dt=1e-3)
    assert motion.attrs["energy_error"] < {METHOD: 1e-11}.get(method, 1e-3)


@pytest.mark.parametrize("law", LAWS)
def test_contact_and_memory_go_together(law):
    """A sheet that falls on the ground and is folded there."""
    ground = fd.Plane((0.0, 0.0, -0.05), (0.0, 0.0, 1.0), friction=0.2)
    s = sheet("plate", fold_law=LAWS[law])
    case = fd.Case(s, [], [fd.Gravity((0.0, 0.0, -9.81))], contact=fd.Contact(planes=[ground]))
    motion = fd.simulate(case, 0.3, METHOD, dt=1e-3)
    assert float(motion.contact.max()) > 0.0
    assert float(motion.memory[-1].max()) > 0.0
    assert motion.attrs["energy_error"] < 1e-9
