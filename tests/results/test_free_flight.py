"""Attitude and momenta of what flies freely, beside closed forms."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

import foldyn as fd
from foldyn.cli.main import main
from foldyn.errors import InputError

SHEET = fd.Sheet(1e10, 0.3, 0.01, density=100.0)
SQUARE = fd.Pattern([(0, 0), (1, 0), (1, 1), (0, 1)], [(0, 1, 2, 3)])
SPIN = np.array([2.0, 0.0, 9.0])  # rad/s
SHIFT = np.array([0.5, -1.0, 2.0])  # m/s


def thrown(structure, spin=SPIN, shift=SHIFT):
    """The case of a structure without supports, and a state with a spin and a velocity."""
    case = fd.Case(structure)
    share = np.asarray(case.mass.sum(axis=0)).ravel() / case.mass.sum()
    arm = structure.nodes - share @ structure.nodes
    return case, fd.State(velocity=shift + np.cross(spin, arm))


def square():
    return fd.discretize(SQUARE, SHEET, rigid="all", mass="inertia_exact", preset="plate")


STEPS = {"energy_momentum": 1e-3, "rk4": None, "central_difference": None}


@pytest.mark.parametrize("method", STEPS)
def test_a_square_plate_spins_like_a_symmetric_top(method):
    """R(t) = exp(t L / I1) exp(t w3 (1 - I3 / I1) e3), with I3 = 2 I1 (Goldstein, section 5.6)."""
    case, state = thrown(square())
    dt = STEPS[method]
    run = fd.simulate(case, 0.5, method=method, dt=dt, interval=0.05, initial=state)
    found = fd.attitude(run)
    mass = 100.0 * 0.01
    inertia = mass / 12.0 * np.array([1.0, 1.0, 2.0])
    angular = inertia * SPIN
    time = found.time.values[:, None]
    turned = Rotation.from_rotvec(time * angular / inertia[0])
    expected = turned * Rotation.from_rotvec(-time * [0.0, 0.0, SPIN[2]])
    off = Rotation.from_rotvec(found["rotation"].values) * expected.inv()
    assert np.degrees(off.magnitude()).max() < 0.01
    body = turned.apply(SPIN - angular / inertia[0]) + angular / inertia[0]
    np.testing.assert_allclose(found["angular_velocity"], body, atol=2e-4 * 9.0)
    np.testing.assert_allclose(found["angular_momentum"] - angular, 0.0, atol=1e-5)
    np.testing.assert_allclose(found["momentum"] - mass * SHIFT, 0.0, atol=1e-8)
    np.testing.assert_allclose(found["center"], [0.5, 0.5, 0.0] + time * SHIFT, atol=1e-9)
    own = fd.attitude(run, panel=0)
    np.testing.assert_allclose(own["rotation"], found["rotation"], atol=1e-9)
    np.testing.assert_allclose(own["angular_velocity"], found["angular_velocity"], atol=1e-9)
    assert "momentum" not in own


def test_turns_are_counted():
    """About an axis of the plate's plane, more than three turns: the vector grows on."""
    case, state = thrown(square(), spin=np.array([10.0, 0.0, 0.0]))
    run = fd.simulate(case, 2.0, method="energy_momentum", dt=1e-3, interval=0.1, initial=state)
    expected = run.time.values[:, None] * [10.0, 0.0, 0.0]
    np.testing.assert_allclose(fd.attitude(run)["rotation"], expected, atol=1e-3 * 20.0)


def test_a_sheet_that_folds_in_flight_keeps_its_momenta():
    """And the panels turn from each other as the dihedral of their crease changes."""
    pattern = fd.patterns.simple_fold(dihedral=120.0)
    structure = fd.discretize(pattern, SHEET, crease_stiffness=20.0, crease_rest=220.0, rigid="all")
    case, state = thrown(structure, 0.1 * SPIN)
    run = fd.simulate(case, 0.2, method="energy_momentum", interval=0.01, initial=state, dt=1e-3)
    found = fd.attitude(run)
    for name in ("momentum", "angular_momentum"):
        drift = np.abs(found[name] - found[name][0]).max() / np.abs(found[name][0]).max()
        assert drift < 1e-9
    turned = [Rotation.from_rotvec(fd.attitude(run, k)["rotation"].values) for k in (0, 1)]
    between = np.degrees((turned[0].inv() * turned[1]).magnitude())
    angles = [structure.dihedrals(u)[0] for u in run["displacement"].values]
    folded = np.abs(np.degrees(np.ravel(angles) - angles[0]))
    assert folded.max() > 20.0
    np.testing.assert_allclose(between, folded, atol=0.05)


def test_what_is_no_motion_or_no_panel_is_refused():
    case, state = thrown(square())
    with pytest.raises(InputError, match="is no motion"):
        fd.attitude(fd.modes(case, count=2))
    run = fd.simulate(case, 0.01, method="rk4", initial=state)
    with pytest.raises(InputError, match="panel"):
        fd.attitude(run, panel=1)


def test_the_picture_and_the_page_show_the_attitude(tmp_path):
    """A spin about z by 9 rad/s turns by 9 t rad."""
    case, state = thrown(square(), spin=np.array([0.0, 0.0, 9.0]))
    run = fd.simulate(case, 0.5, method="rk4", interval=0.05, initial=state)
    left, right = fd.plots.plot_attitude(run).axes
    turn, speed = ({one.get_label(): one for one in each.lines} for each in (left, right))
    assert turn["about z"].get_ydata() == pytest.approx(np.degrees(9.0 * run.time), rel=1e-6)
    assert speed["about z"].get_ydata() == pytest.approx(9.0, rel=1e-6)
    assert np.abs(turn["about x"].get_ydata()).max() < 1e-6

    file = tmp_path / "top.toml"
    text = """
        [pattern]
        kind = "simple_fold"
        [sheet]
        youngs_modulus = 1e6
        poissons_ratio = 0.25
        thickness = 0.01
        density = 1.0
        {}
        [[loads]]
        gravity = [0, 0, -9.81]
        [analysis]
        kind = "dynamics"
        duration = 0.01
        [output]
        interval = 0.002
    """
    for supports, told in (("", True), ("[[supports]]\n        nodes = [0, 1]", False)):
        file.write_text(text.format(supports))
        assert main(["run", str(file), "--out", str(tmp_path / "out")]) == 0
        page = (tmp_path / "out/report.html").read_text("utf-8")
        assert ("Attitude of the body" in page) is told
