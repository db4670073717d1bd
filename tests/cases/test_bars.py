"""Bars with the laws of a sheet's bars: closed forms, motions, derivatives, files, messages."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest
from attached_cases import FOLD, derivative_errors, moved, structure
from scipy.integrate import quad
from scipy.optimize import brentq

import foldyn as fd
from foldyn.dynamics import METHODS
from foldyn.errors import InputError

EA, OWN = 5e3, 0.8  # N, m without force
HOOKE = fd.CustomBarLaw(  # as without a law
    energy_of=lambda s: 0.5 * (s - 1.0) ** 2,
    stress_of=lambda s: (s - 1.0) / s,
    slope_of=lambda s: 1.0 / s**3,
    name="hooke",
)
LAWS: dict[str, Any] = {"none": None, "ogden": "ogden", "linear": "linear", "own": HOOKE}
CLOSED = {  # tension, its slope by the stretch, and energy, per EA, EA and EA l0
    "ogden": (
        lambda s: (s**3 - 1.0 / s) / 4.0 * s,
        lambda s: s**3,
        lambda s: ((s**5 - 1.0) / 5.0 - (s - 1.0)) / 4.0,
    ),
    "linear": (
        lambda s: (s**2 - 1.0) / 2.0 * s,
        lambda s: (3.0 * s**2 - 1.0) / 2.0,
        lambda s: (s**2 - 1.0) ** 2 / 8.0,
    ),
}
CLOSED |= dict.fromkeys(
    ("none", "own"), (lambda s: s - 1.0, lambda s: 1.0, lambda s: 0.5 * (s - 1.0) ** 2)
)


def points(x: Any, bars: Any = (), law: Any = "ogden") -> fd.Structure:
    """Points of 1 kg, with bars of the structure's own of the same EA."""
    return fd.Structure(
        nodes=np.array(x, float),
        bars=np.array(bars, int).reshape(-1, 2),
        bar_area=np.full(len(bars), 1e-4),
        sheet=fd.Sheet(EA / 1e-4, 0.3, 0.01),
        options=fd.ModelOptions(bar_law=law),
        node_mass=np.ones(len(x)),
    )


def rod(law: Any, **given: Any) -> fd.Case:
    """A point at x = OWN on a bar along x, which is free of force there; another bar is held."""
    bar = fd.Bar((0, 1), **{"stiffness": EA, **given}, law=law)
    held = points([[0, 0, 0], [OWN, 0, 0], [0, 1, 0]], [(0, 2)])
    return fd.Case(held, [fd.Fix([0, 2]), bar])


@pytest.mark.parametrize("name", LAWS)
@pytest.mark.parametrize("stretch", [0.7, 0.97, 1.0, 1.0 + 1e-6, 1.4])
def test_tension_energy_and_stiffness_are_those_of_the_law(name, stretch):
    case, (pull, slope, stored) = rod(LAWS[name]), CLOSED[name]
    assert case.lines is not None
    u = np.array([0, 0, 0, OWN * (stretch - 1.0), *5 * [0]])
    assert case.lines.pulls(u) == pytest.approx([EA * pull(stretch)], rel=1e-12, abs=1e-12 * EA)
    assert case.body.energies(u)[-1] == pytest.approx(
        EA * OWN * stored(stretch), rel=1e-12, abs=1e-12
    )
    along = [EA / OWN * slope(stretch), *2 * [EA * pull(stretch) / (OWN * stretch)]]
    found = case.body.tangent(u).toarray()[3:6, 3:6]
    assert np.abs(found - np.diag(along)).max() < 1e-12 * EA / OWN


@pytest.mark.parametrize("model", ["bars and hinges", "n5b8e", "shell"])
def test_forces_are_the_gradient_of_the_energy_and_the_tangent_that_of_the_forces(model):
    s = structure(model, FOLD)
    bars = [
        fd.Bar([(0, 2), (1, 3)], 70.0, rest_length=0.9, law="ogden"),
        fd.Bar((0, 3), 70.0, rest_length=2.0, law="linear"),
        fd.Bar((1, 2), 70.0, rest_length=1.2, law=HOOKE),
        fd.Bar((1, 4), 70.0),
    ]
    body = fd.Case(s, bars).body
    assert max(derivative_errors(body, moved(s, 0.1))) < 1e-7


# ------------------------------------------------------------------ motions
@pytest.mark.parametrize("stretch", [1.0 + 1e-4, 1.3])
@pytest.mark.parametrize("law", ["ogden", "linear"])
def test_periods_of_a_mass_on_a_bar(law, stretch):
    """From the energy in closed form: T = 2 int dl / v; at small amplitude 2 pi sqrt(m l0/EA)."""
    pull, _, stored = CLOSED[law]
    full = stored(stretch)
    least = brentq(lambda s: stored(s) - full, 0.05, 1.0, xtol=1e-15)
    middle, half = 0.5 * (stretch + least), 0.5 * (stretch - least)

    def slowness(angle: float) -> float:
        left = full - stored(middle + half * math.sin(angle))
        return half * math.cos(angle) / math.sqrt(max(left, 1e-300))

    reach = math.pi / 2.0 * (1.0 - 1e-5)
    period = 2.0 * quad(slowness, -reach, reach, epsrel=1e-6)[0] * math.sqrt(OWN / (2.0 * EA))
    if stretch < 1.001:
        assert period == pytest.approx(2.0 * math.pi * math.sqrt(OWN / EA), rel=1e-4)
    start = fd.State([[0, 0, 0], [OWN * (stretch - 1.0), 0, 0], [0, 0, 0]])
    motion = fd.simulate(
        rod(law), period, method="rk4", dt=period / 2000, initial=start, interval=period / 2
    )
    late = motion.velocity.values[:, 1, 0] / (EA * pull(stretch))
    assert abs(late[2]) < 1e-4 * period
    assert motion.displacement.values[1, 1, 0] == pytest.approx(OWN * (least - 1.0), rel=1e-4)


ERROR = {
    "rk4": 1e-8, "dormand_prince": 1e-5, "energy_momentum": 1e-10, "generalized_alpha": 1e-3,
    "newmark": 1e-3, "central_difference": 1e-3,
}  # fmt: skip


@pytest.mark.parametrize("method", METHODS)
@pytest.mark.parametrize("law", ["ogden", "linear", HOOKE], ids=["ogden", "linear", "own"])
def test_a_bar_moves_as_a_bar_of_the_structure_does(law, method):
    """One along x, the other along y: their points fly alike, and keep the energy."""
    own = points([[0, 0, 0], [OWN, 0, 0], [0, OWN, 0]], [(0, 1)], law)
    case = fd.Case(own, [fd.Fix([0]), fd.Bar((0, 2), EA, law=law)])
    turn, start = np.array([[0, -1, 0], [1, 0, 0], [0, 0, 1]]), np.array([30.0, 20.0, 10.0])
    given: dict[str, Any] = {} if method == "dormand_prince" else {"dt": 2e-4}
    motion = fd.simulate(
        case, 0.1, method=method, interval=0.01, **given,
        initial=fd.State(velocity=np.stack([0 * start, start, turn @ start])),
    )  # fmt: skip
    x = own.nodes + motion.displacement.values
    assert np.linalg.norm(x, axis=2).max() > 1.3 * OWN
    assert x[:, 2] == pytest.approx(x[:, 1] @ turn.T, abs=1e-9)
    assert motion.strain_springs.values == pytest.approx(
        motion[next(iter(case.energy_groups))].values, rel=1e-6, abs=1e-9
    )
    assert motion.attrs["energy_error"] < ERROR[method]


def test_steps_of_next_to_nothing_keep_the_energy():
    """The mean tension is no quotient of differences that have lost their digits."""
    start = fd.State(velocity=[[0, 0, 0], [1e-9, 2e-9, 0], [0, 0, 0]])
    motion = fd.simulate(rod("ogden"), 0.05, method="energy_momentum", dt=1e-3, initial=start)
    assert motion.attrs["energy_error"] < 1e-10


def test_area_times_modulus_is_the_stiffness():
    one, other = rod("ogden"), rod("ogden", stiffness=None, area=2e-6, modulus=2.5e9)
    assert fd.Bar((0, 1), area=2e-6, modulus=2.5e9).axial_stiffness == 2e-6 * 2.5e9 == EA
    u = np.array([0, 0, 0, 0.1, 0.2, 0, 0, 0, 0])
    np.testing.assert_array_equal(one.body.internal(u), other.body.internal(u))


def test_vibrations_of_a_point_between_stretched_bars():
    """Across them by their tension, sqrt(2 T / (m l)); along them by the slope of the law."""
    pull, slope, _ = CLOSED["ogden"]
    s = points([[-1, 0, 0], [0, 0, 0], [1, 0, 0]])
    bars = fd.Bar([(0, 1), (1, 2)], EA, rest_length=OWN, law="ogden")
    found = fd.modes(
        fd.Case(s, [fd.Fix([0, 2]), bars]), 3, state=fd.State(0 * s.nodes), check_model=False
    )
    across, along = 2.0 * EA * pull(1 / OWN), 2.0 * EA / OWN * slope(1 / OWN)
    expected = np.sqrt([across, across, along]) / (2.0 * math.pi)
    assert found.frequency.values == pytest.approx(expected, rel=1e-10)


# ------------------------------------------------------------------ files and messages
FILE = """
pattern = { kind = "miura", cells = [1, 1], a = 0.04, b = 0.04, panel_angle = 60, dihedral = 110 }
sheet = { youngs_modulus = 2e9, poissons_ratio = 0.3, thickness = 3e-4, density = 1000.0 }
model = { preset = "plate" }
supports = [{ nodes = "xmin" }, { bar = [7, 0], BAR }]
analysis = { kind = "statics", load_factors = [0.0, 1.0] }
loads = [{ nodes = [8], force = [0.0, 0.0, 1e-4] }]
"""


def of_file(folder: Any, bar: str) -> Any:
    file = folder / "case.toml"
    file.write_text(FILE.replace("BAR", bar))
    return fd.read_case(file).case().supports[1]


def test_bars_of_case_files(tmp_path):
    for text, law in (('"ogden"', "ogden"), ('{ kind = "linear" }', "linear")):
        found = of_file(tmp_path, f"bar_area = 1e-6, bar_modulus = 2e9, bar_law = {text}")
        assert found == fd.Bar([(7, 0)], area=1e-6, modulus=2e9, law=law)
    assert of_file(tmp_path, "bar_stiffness = 2.0").law is None


def test_laws_come_back_from_results(tmp_path):
    s = fd.discretize(FOLD, fd.Sheet(1e6, 0.3, 0.01, 100.0))
    for law in ("ogden", HOOKE):
        case = fd.Case(s, [fd.Fix([0, 1, 2]), fd.Bar((0, 3), area=1e-6, modulus=2e6, law=law)])
        fd.save(fd.simulate(case, 1e-3), tmp_path / "bars.nc")
        stored = fd.load(tmp_path / "bars.nc")
        if law is HOOKE:
            with pytest.raises(InputError, match=r'bar_law is "hooke", a user\'s own law'):
                fd.case_of(stored)
        else:
            assert fd.case_of(stored).supports == case.supports


WRONG: dict[str, tuple[dict[str, Any], str]] = {
    "nothing": ({}, r"stiffness: give either EA \(N\), or both area \(m2\) and modulus \(Pa\)"),
    "half": ({"area": 1e-6}, r"area: give either EA"),
    "the other half": ({"modulus": 1e9}, r"modulus: give either EA"),
    "all": ({"stiffness": 1.0, "area": 1e-6, "modulus": 1e6}, r"modulus: give either EA"),
    "one too many": ({"stiffness": 1.0, "area": 1e-6}, r"area: give either EA"),
    "no area": ({"area": 0.0, "modulus": 1e9}, r"area = 0.0: must be greater than 0 m2"),
    "a wrong law": ({"stiffness": 1.0, "law": "hooke"}, r"law = 'hooke': choose one of ogden, lin"),
    "a hinge's law": (
        {"stiffness": 1.0, "law": fd.materials.Superlinear()},
        "law = .*give a BarLaw object",
    ),
}


@pytest.mark.parametrize("name", WRONG)
def test_what_bars_refuse(name):
    given, message = WRONG[name]
    with pytest.raises(InputError, match=message):
        fd.Bar((0, 1), **given)


def test_messages_of_files_name_the_keys(tmp_path):
    for text, message in (
        ("bar_area = 1e-6", r"supports\[1\].bar_area: give either"),
        ("bar_mass = 1.0", r"supports\[1\].bar_stiffness: give either"),
        ('bar_stiffness = 1.0, bar_law = "hooke"', r"supports\[1\].bar_law = .*hooke"),
    ):
        with pytest.raises(InputError, match=message):
            of_file(tmp_path, text)


@pytest.mark.parametrize("law", LAWS)
def test_pressed_bars_stay_pressed_beside_cables_that_count_as_taut(law):
    s = structure("bars and hinges", FOLD)
    bar = fd.Bar((1, 3), 70.0, rest_length=1.8, law=LAWS[law])
    lines = fd.Case(s, [fd.Cable([0, 3], 900.0, pretension=2.0), bar]).lines
    assert lines is not None and lines.tensions(0 * moved(s, 1.0))[1] < 0.0
    q = moved(s, 0.01)
    np.testing.assert_allclose(lines.nominal(q).entries(q), lines.entries(q), rtol=1e-12, atol=1e-9)
