"""End stops of creases: what they resist, and where they do nothing."""

import numpy as np
import pytest

import foldyn as fd
from foldyn import checks
from foldyn.dynamics import METHODS
from foldyn.errors import InputError

SHEET = fd.Sheet(2e9, 0.3, thickness=2e-3, density=900.0)
PATTERN = fd.patterns.simple_fold(a=0.1, b=0.2, dihedral=100.0)
REST, LENGTH = 260.0, 0.2  # a mountain
MODELS = {
    "herkal": lambda **more: fd.discretize(PATTERN, SHEET, preset="herkal", **more),
    "plate": lambda **more: fd.discretize(PATTERN, SHEET, preset="plate", **more),
    "n5b8e": lambda **more: fd.discretize(PATTERN, SHEET, preset="n5b8e", **more),
    "shell": lambda **more: fd.shell(PATTERN, SHEET, divisions=3, **more),
}
FLAP = {"rigid": "all", "fold_law": "linear", "crease_stiffness": 0.5}


def flap(model, stops, force=0.0, **more):
    """A rigid panel hinged to one that is held, pushed across its middle."""
    structure = MODELS[model](**{**FLAP, **more})
    pattern = structure.pattern
    held, moved = pattern.faces
    edge = set(held) & set(moved)
    tip = sorted(set(moved) - edge)
    case = fd.Case(structure, [fd.Fix(list(held)), *stops])
    if force:
        along = force * pattern.face_normals[1] / len(tip)
        case = case.altered(loads=[fd.Force(tip, tuple(along.tolist()))])
    return case, tip


def angle(case, u):
    """Dihedral (degrees) between the two panels."""
    x = case.structure.pattern.vertices + u[: len(case.structure.pattern.vertices)]
    moved = fd.Pattern(x, case.structure.pattern.faces)
    return float(np.degrees(moved.dihedrals[0]))


@pytest.mark.parametrize("model", MODELS)
def test_forces_are_the_gradient_and_the_tangent_that_of_forces(model):
    stops = [fd.Stop("all", REST - 0.1, stiffness=30.0), fd.Stop("all", REST + 0.2, stiffness=20.0)]
    case, _ = flap(model, stops, rigid=None)
    body, random = case.body, np.random.default_rng(2)
    for _ in range(3):
        q = 1e-3 * random.standard_normal(body.size)
        assert checks.gradient_error(lambda z: body.energies(z).sum(), body.internal, at=q) < 1e-6
        assert checks.tangent_error(body.internal, body.tangent, at=q) < 1e-5


@pytest.mark.parametrize("model", MODELS)
@pytest.mark.parametrize(("limit", "sign"), [(220.0, -1.0), (310.0, 1.0)])
def test_a_flap_comes_to_rest_at_its_stop(model, limit, sign):
    """Springs in parallel from the stop on: k (theta - theta_0) + k_s (theta - theta_s) = M."""
    case, _ = flap(model, [fd.Stop("all", limit, stiffness=40.0)])
    away = np.radians(limit - REST)
    beyond = sign * np.radians(3.0)
    turn = away + beyond
    moment = LENGTH * (0.5 * turn + 40.0 * beyond)
    case = case.altered(loads=[fd.CreaseMoment([0], moment)])
    found = angle(case, fd.trace(case, steps=20).displacement.values[-1])
    assert found == pytest.approx(REST + np.degrees(turn), abs=1e-3)


def test_before_the_stop_nothing_changes():
    case, _ = flap("plate", [fd.Stop("all", REST - 40.0, stiffness=40.0)])
    free, _ = flap("plate", [])
    load = [fd.CreaseMoment([0], -0.02)]
    one, other = (fd.trace(each.altered(loads=load)) for each in (case, free))
    np.testing.assert_allclose(one.displacement, other.displacement, atol=1e-12)
    one, other = (fd.modes(each, 3, check_model=False).frequency for each in (case, free))
    np.testing.assert_array_equal(one, other)


def test_a_pressed_flap_vibrates_as_on_both_springs():
    """omega^2 = (k + k_s) L / I of a rigid panel, at the equilibrium in the stop."""
    case, _ = flap("plate", [fd.Stop("all", REST - 1.0, stiffness=40.0)], mass="consistent")
    case = case.altered(loads=[fd.CreaseMoment([0], -0.4)])
    path = fd.trace(case)
    state = fd.State(path.displacement.values[-1])
    panel = case.structure.pattern.face_areas[1]
    inertia = SHEET.density * SHEET.thickness * panel * 0.1**2 / 3.0
    expected = np.sqrt(40.5 * LENGTH / inertia) / (2.0 * np.pi)
    found = fd.modes(case, 1, state=state, check_model=False).frequency.values[0]
    assert found == pytest.approx(expected, rel=1e-4)


@pytest.mark.parametrize(
    "method",
    [
        pytest.param(one, marks=pytest.mark.matrix)
        for one in ("rk4", "dormand_prince", "generalized_alpha")
    ]
    + ["energy_momentum"],
)
def test_a_flap_that_hits_its_stop_keeps_its_energy(method):
    case, _ = flap("plate", [fd.Stop("all", REST - 5.0, stiffness=3.0)], crease_stiffness=0.05)
    start = fd.trace(case.altered(loads=[fd.CreaseMoment([0], -0.02)]))
    result = fd.simulate(
        case, duration=0.3, initial=fd.State(start.displacement.values[-1]), method=method
    )
    stored = sum(result[name] for name in ("kinetic", *case.energy_groups))
    assert float(result["strain_stops"].max()) > 0.5 * float(stored[0])
    assert np.abs(stored - stored[0]).max() < 2e-3 * float(stored[0])


def test_stops_of_mountains_and_valleys():
    sheet = fd.patterns.miura(dihedral=100.0)
    letters = np.array(sheet.assignments)
    structure = fd.discretize(sheet, SHEET, preset="herkal")
    stops = [fd.Stop("valley", 90.0, stiffness=5.0), fd.Stop("mountain", 270.0, stiffness=5.0)]
    term = fd.Case(structure, stops).body.others[-1].stops
    assert (
        np.degrees(term.limit).round(9).tolist()
        == [90.0] * (letters == "V").sum() + [270.0] * (letters == "M").sum()
    )
    length = np.linalg.norm(np.diff(sheet.vertices[sheet.creases], axis=1)[:, 0], axis=1)
    order = [*np.flatnonzero(letters == "V"), *np.flatnonzero(letters == "M")]
    np.testing.assert_allclose(term.stiffness, 5.0 * length[order])


@pytest.mark.parametrize(
    ("stop", "message"),
    [
        (
            lambda: fd.Stop("all", REST, stiffness=5.0),
            r"supports\[1\].angle: crease 0 rests at the stop",
        ),
        (
            lambda: fd.Stop("all", 280.0, stiffness=5.0, side="below"),
            "crease 0 is beyond the stop at rest, at 260",
        ),
        (lambda: fd.Stop("all", 120.0, stiffness=-5.0), "stiffness = -5.0: must be"),
        (lambda: fd.Stop("all", 400.0, stiffness=5.0), "angle = 400: must lie between 0 and 360"),
        (lambda: fd.Stop("all", 360.0, stiffness=5.0), "panels cannot pass 0 or 360"),
        (lambda: fd.Stop("all", 120.0, stiffness=5.0, side="left"), "choose one of below, above"),
        (lambda: fd.Stop("ridges", 120.0, stiffness=5.0), r"supports\[1\].creases = \"ridges\""),
    ],
)
def test_bad_stops_are_refused(stop, message):
    with pytest.raises(InputError, match=message):
        _ = flap("plate", [stop()])[0].body


def test_superelements_refuse_stops():
    made = fd.superelements(PATTERN, SHEET, divisions=8)
    with pytest.raises(InputError, match="superelements are linear, and stops are not"):
        fd.Case(made, [fd.Stop("all", 60.0, stiffness=4.0)])


@pytest.mark.parametrize("model", ["plate", "n5b8e", "shell"])
@pytest.mark.parametrize("stiffness", [2.0, 20.0])
def test_a_stop_at_rest_is_a_stiffer_crease(model, stiffness):
    """The panels bend in series with both: law k and stop s beside a law of k + s."""
    options = {"rigid": None, "fold_law": "linear"}
    stops = [fd.Stop("all", REST, stiffness=stiffness, side="above")]
    cases = []
    for given, crease in ((stops, 0.5), ([], 0.5 + stiffness)):
        case, tip = flap(model, given, **options, crease_stiffness=crease)
        cases.append(case)
    # one of both ways opens the crease onto its stop
    for way in (1.0, -1.0):
        one, other = (
            fd.trace(
                case.altered(loads=[fd.Force(tip, (1e-4 * way, 0.0, 1e-3 * way))])
            ).displacement.values[-1]
            for case in cases
        )
        if angle(cases[0], one) > REST:
            break
    assert np.abs(one - other).max() < 1e-5 * np.abs(other).max()


def test_a_crease_at_its_stop_is_free_at_rest():
    """Rounding does not decide which stops act."""
    pattern = fd.patterns.miura((2, 2), dihedral=110.0)
    structure = fd.discretize(pattern, SHEET, preset="plate")
    held = [fd.Fix([0, 1, 2])]
    rest = np.degrees(pattern.dihedrals).tolist()
    numbers = list(range(len(rest)))
    stops = [fd.Stop(numbers, rest, stiffness=5.0, side="above")]
    one, other = (
        fd.modes(fd.Case(structure, [*held, *more]), 4, check_model=False).frequency.values
        for more in ([], stops)
    )
    np.testing.assert_allclose(one, other, rtol=1e-9)


@pytest.mark.parametrize("method", ["rk4", "energy_momentum"])
@pytest.mark.parametrize("model", ["n5b8e", pytest.param("shell", marks=pytest.mark.matrix)])
def test_panels_that_bend_keep_the_energy_of_a_stop(method, model):
    case, tip = flap(model, [fd.Stop("all", REST + 2.0, stiffness=3.0)], rigid=None)
    case = case.altered(loads=[fd.Force(tip, (0.0, 0.0, -0.02))])
    result = fd.simulate(case, duration=0.05, method=method)
    stored = sum(result[name] for name in ("kinetic", *case.energy_groups))
    assert float(result["strain_stops"].max()) >= 0.0
    assert np.abs(stored - result.work).max() < 1e-3 * np.abs(result.work).max()


@pytest.mark.parametrize("method", METHODS)
def test_a_damped_stop_takes_energy_of_an_impact(method):
    """Half a damped swing on the stop: out with exp(-zeta pi / sqrt(1 - zeta^2)) of the speed."""
    K, stiff, zeta = 1e-6, 40.0, 0.2
    case, tip = flap("plate", [], mass="consistent", crease_stiffness=K)
    x, pattern = case.structure.nodes, case.structure.pattern
    a, b = sorted(set(pattern.faces[0]) & set(pattern.faces[1]))
    axis = (x[b] - x[a]) / np.linalg.norm(x[b] - x[a])
    away = np.linalg.norm(x[tip[0]] - x[a] - ((x[tip[0]] - x[a]) @ axis) * axis)
    inertia = 900.0 * 2e-3 * LENGTH * away**3 / 3.0
    rate = np.sqrt(stiff * LENGTH / inertia)
    damping = 2.0 * zeta * rate * inertia / LENGTH
    velocity = np.zeros_like(x)
    moving = [*tip, int(case.structure.centers[1])]
    velocity[moving] = np.cross(20.0 * axis, x[moving] - x[a])
    ahead = x.copy()
    ahead[moving] += 1e-6 * velocity[moving]
    side = 1.0 if angle(case, ahead - x) > REST else -1.0
    stop = fd.Stop("all", REST + 2.0 * side, stiffness=stiff, damping=damping)
    case = case.altered(supports=[*case.supports, stop])
    end = np.radians(4.0) / 20.0 + 1.6 * np.pi / rate
    options = {"interval": end / 4, "initial": fd.State(velocity=velocity)}
    options |= {"tolerance": 1e-8} if method == "dormand_prince" else {}
    options |= {"dt": end / 4000} if METHODS[method].implicit else {}
    motion = fd.simulate(case, end, method=method, **options)
    kept = float(motion.kinetic[-1] / motion.kinetic[0])
    left = np.exp(-2.0 * zeta * np.pi / np.sqrt(1.0 - zeta**2))
    assert kept == pytest.approx(left, rel=0.02)
    lost = (1.0 - kept) * float(motion.kinetic[0])
    assert float(motion.dissipated[-1]) == pytest.approx(lost, rel=0.01)
    assert motion.attrs["energy_error"] < 5e-3
