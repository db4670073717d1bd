"""Laws of folds that differ from crease to crease."""

from __future__ import annotations

import math

import numpy as np
import pytest

import foldyn as fd
from foldyn.errors import InputError

SHEET = fd.Sheet(4e9, 0.3, 2e-4, 1000.0)
MIURA = fd.patterns.miura((2, 2), 0.03, b=0.02, panel_angle=60, dihedral=100)
MOUNTAIN = np.array(MIURA.assignments) == "M"
STIFF = {"crease_stiffness": 0.02}
LINEAR = fd.CustomHingeLaw(
    lambda t, r: 0.5 * (t - r) ** 2, lambda t, r: t - r, lambda t, r: 1.0, name="own"
)
LOCKING = fd.EnhancedLinear(theta1=110.0, theta2=250.0)  # all creases rest in its range
MODELS = {
    "n5b8e": fd.discretize,
    "plate": lambda *given, **more: fd.discretize(*given, preset="plate", **more),
    "n4b5": lambda *given, **more: fd.discretize(*given, preset="herkal", scheme="n4b5", **more),
    "shell": lambda *given, **more: fd.shell(*given, divisions=2, **more),
}
every = pytest.mark.parametrize("make", MODELS.values(), ids=MODELS)


def shaken(structure, size=2e-4):
    """Displacements (m,) of all dofs."""
    return np.random.default_rng(3).uniform(-size, size, structure.body.size)


@every
def test_each_crease_has_the_force_of_its_own_law(make):
    """Energies differ from those of one law by the folds of the other alone."""
    plain, locked = (make(MIURA, SHEET, fold_law=law, **STIFF) for law in ("linear", LOCKING))
    mixed = make(MIURA, SHEET, fold_law={"valley": LOCKING, "others": "linear"}, **STIFF)
    weaker = [
        make(MIURA, SHEET, fold_law=law, crease_stiffness={"valley": k, "mountain": 0.02 - k})
        for law, k in (("linear", 0.0), (LOCKING, 0.02))
    ]
    q = shaken(plain)
    folds = [*plain.energy_groups].index("strain_folds")

    def energy(s):
        return s.body.energies(q)[folds]

    if make is not MODELS["plate"]:  # whose panels are in series with the creases
        assert energy(mixed) == pytest.approx(energy(weaker[0]) + energy(weaker[1]), rel=1e-12)
    assert energy(plain) != pytest.approx(energy(mixed), rel=1e-6)
    assert energy(locked) != pytest.approx(energy(mixed), rel=1e-6)


@every
def test_forces_and_tangents_are_derivatives(make):
    s = make(MIURA, SHEET, fold_law={"zigzag": LOCKING, "straight": LINEAR}, **STIFF)
    q, h = shaken(s), 1e-7
    way = np.random.default_rng(5).normal(size=q.size)
    way /= np.abs(way).max()
    ends = [s.body.energies(q + sign * h * way).sum() for sign in (1, -1)]
    assert (ends[0] - ends[1]) / (2 * h) == pytest.approx(s.body.internal(q) @ way, rel=1e-5)
    forces = [s.body.internal(q + sign * h * way) for sign in (1, -1)]
    change = (forces[0] - forces[1]) / (2 * h)
    np.testing.assert_allclose(s.body.tangent(q) @ way, change, atol=1e-6 * np.abs(change).max())


@every
def test_equal_laws_of_two_kinds_are_one_law(make):
    """A user's linear law for every second crease, in a motion and a path, beside the own one."""
    laws = [LINEAR if k % 2 else "linear" for k in range(len(MIURA.creases))]
    found = []
    for law in ("linear", laws):
        s = make(MIURA, SHEET, fold_law=law, **STIFF)
        push = fd.Force("xmax", (0.0, 0.0, 2e-3))
        case = fd.Case(s, [fd.Fix("xmin")], [push])
        motion = fd.simulate(case, 2e-3, method="generalized_alpha", interval=1e-3)
        path = fd.trace(case, steps=2)
        found.append((motion.displacement.values[-1], path.displacement.values[-1]))
    for one, other in zip(*found, strict=True):
        np.testing.assert_allclose(one, other, atol=1e-9 * np.abs(other).max())


METHODS = ["rk4", "central_difference", "energy_momentum", "dormand_prince"]


@pytest.mark.parametrize("method", METHODS)
@pytest.mark.parametrize("model", ["plate", "n5b8e"])
def test_yielding_of_some_creases(model, method):
    """Plastic valleys beside elastic mountains; and, as two laws, beside the same as one law."""
    plastic, other = (fd.Plastic(yield_moment=5e-5 * k) for k in (1.0, 1.0 + 1e-13))
    push = fd.Force("xmax", (0.0, 0.0, 2e-2), history=fd.Ramp(2e-3))
    lost = []
    for law in (
        {"valley": plastic, "mountain": plastic},
        {"valley": plastic, "mountain": other},
        {"valley": plastic, "mountain": "linear"},
        "linear",
    ):
        s = MODELS[model](MIURA, SHEET, fold_law=law, **STIFF)
        case = fd.Case(s, [fd.Fix("xmin")], [push], fd.Rayleigh(20.0, 0.0))
        motion = fd.simulate(case, 2e-3, method=method, interval=1e-3)
        assert np.abs(motion.energy_error).max() < 2e-3
        lost.append((float(motion.dissipated[-1]), motion.displacement.values[-1]))
    np.testing.assert_allclose(lost[0][1], lost[1][1], atol=1e-8 * np.abs(lost[0][1]).max())
    assert lost[0][0] == pytest.approx(lost[1][0], rel=1e-7)
    assert lost[0][0] > 1.01 * lost[2][0] > 1.011 * lost[3][0]


def test_relaxing_creases_of_superelements():
    """Frequency response with relaxing valleys: as with all, less the others; in any order."""
    prony = fd.Prony(ratios=[0.4], times=[1e-3])
    f = [30.0, 60.0, 90.0]

    def response(law):
        s = fd.superelements(MIURA, SHEET, level=1, fold_law=law, **STIFF)
        case = fd.Case(s, [fd.Fix("xmin")], damping=fd.Rayleigh(5.0, 0.0))
        found = fd.frf(case, fd.Force("xmax", (0.0, 0.0, 1.0)), frequencies=f)
        return found.receptance.values

    every = ["linear" if mountain else prony for mountain in MOUNTAIN]
    named = response({"mountain": "linear", "valley": prony})
    np.testing.assert_allclose(named, response(every), rtol=1e-12)
    twins = response({"mountain": prony, "valley": fd.Prony(ratios=[0.4], times=[1e-3 + 1e-16])})
    np.testing.assert_allclose(twins, response(prony), rtol=1e-9)
    assert np.abs(named - twins).max() > 1e-3 * np.abs(twins).max()


def test_stops_and_latches_beside_laws_of_creases():
    """A stop's share in `plate` follows the law of its own crease."""
    flap = fd.patterns.simple_fold(a=0.1, b=0.1, dihedral=120)
    two = [fd.discretize(flap, SHEET, preset="plate", fold_law=law, **STIFF)
           for law in (LOCKING, [LOCKING])]  # fmt: skip
    stops = [fd.Case(s, [fd.Stop("all", 150.0, 1.0)]).body for s in two]
    q = shaken(two[0], 5e-2)
    np.testing.assert_allclose(*(body.internal(q) for body in stops), rtol=1e-12)


def test_bent_actuated_creases_follow_their_law():
    """A turned rest angle moves the locking range of stress-free laws alone."""
    law = {"zigzag": "linear", "straight": fd.EnhancedLinear()}
    found = []
    for laws in (law, [("linear" if k in MIURA.families["zigzag"] else fd.EnhancedLinear())
                       for k in range(len(MIURA.creases))]):  # fmt: skip
        s = fd.discretize(MIURA, SHEET, preset="plate", fold_law=laws, **STIFF)
        turn = fd.Actuate("straight", 85.0)
        path = fd.trace(fd.Case(s, [fd.Fix([0, 1, 5])], [turn]), steps=2)
        found.append(path.displacement.values[-1])
    np.testing.assert_allclose(*found, atol=1e-12)


def test_case_files_results_and_sweeps(tmp_path):
    text = """
[pattern]
kind = "miura"
cells = [2, 1]
a = 0.03
b = 0.02
panel_angle = 60
dihedral = 100
[sheet]
youngs_modulus = 4e9
poissons_ratio = 0.3
thickness = 2e-4
density = 1000.0
[model]
kind = "bars_and_hinges"
crease_stiffness = 0.02
fold_law = { valley = { kind = "enhanced", theta1 = 80.0 }, mountain = "linear" }
[[supports]]
nodes = "xmin"
[[loads]]
nodes = "xmax"
force = [0.0, 0.0, 1e-4]
[analysis]
kind = "statics"
steps = 2
"""
    file = tmp_path / "laws.toml"
    file.write_text(text)
    run = fd.read_case(file).run()
    case = fd.case_of(run)
    assert {law.name for law in case.structure.fold_law.laws} == {"linear", "enhanced"}
    again = fd.trace(case, steps=2)
    np.testing.assert_allclose(again.displacement, run.displacement, atol=1e-15)
    vary = {"model.fold_law.valley.theta1": [60.0, 150.0]}
    swept = fd.sweep(file, vary, measures=["displacement[8, z]"], processes=1)
    one, other = swept["displacement_8_z"].values
    assert one != other


@pytest.mark.parametrize("make", [fd.discretize, fd.shell, fd.superelements])
@pytest.mark.parametrize(
    ("law", "message"),
    [
        ({"valey": "linear"}, "fold_law.valey: did you mean 'valley'"),
        ({"valley": "liner"}, "fold_law.valley = 'liner': choose one of linear"),
        ({"valley": "linear", "zigzag": "enhanced"}, "fold_law.zigzag: crease .* by another name"),
        (["linear", "enhanced"], "fold_law: 2 laws for 10 creases: give one for each"),
        (["linear", 3.0], r"fold_law\[1\] = 3.0: choose one of linear"),
        ({}, "fold_law = {}: choose one of linear"),
    ],
)
def test_wrong_laws(make, law, message):
    miura = fd.patterns.miura((1, 2), 0.03, panel_angle=60, dihedral=100)
    with pytest.raises(InputError, match=message):
        _ = make(miura, SHEET, fold_law=law).fold_law


def test_names_left_out_have_the_law_of_the_preset():
    s = fd.discretize(MIURA, SHEET, preset="merlin2", fold_law={"valley": "linear"})
    (mountain,) = {s.fold_law.at([k]) for k in np.flatnonzero(MOUNTAIN)}
    assert mountain == fd.EnhancedLinear(rest="as_published")
    assert math.isinf(s.fold_law.at([np.flatnonzero(~MOUNTAIN)[0]]).linear_between[1])
