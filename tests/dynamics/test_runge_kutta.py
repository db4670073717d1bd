"""A Runge-Kutta method is a tableau: any has its order, its stable step and its gradients."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from measured import order
from oscillators import damped, place, pulled, released, spring

import foldyn as fd
from foldyn.dynamics import METHODS
from foldyn.dynamics.methods import runge_kutta
from foldyn.dynamics.runge_kutta import RK4, Tableau

OMEGA = 4.0
HEUN = Tableau("heun3", 3, ((1 / 3,), (0.0, 2 / 3)), (1.0, 0.0, 3.0))
KUTTA = Tableau("kutta3", 3, ((0.5,), (-1.0, 2.0)), (1.0, 4.0, 1.0))
EIGHTHS = Tableau("eighths", 4, ((1 / 3,), (-1 / 3, 1.0), (1.0, -1.0, 1.0)), (1.0, 3.0, 3.0, 1.0))
TABLEAUS = (HEUN, KUTTA, EIGHTHS)


@pytest.fixture(autouse=True)
def registered(monkeypatch):
    for tableau in TABLEAUS:
        monkeypatch.setitem(METHODS, tableau.name, runge_kutta(tableau))


@pytest.mark.parametrize("tableau", TABLEAUS)
def test_order_and_energy_law(tableau):
    """With damping by mass and by stiffness, whose power is integrated by the method, too."""
    case = spring(OMEGA, alpha=0.3, beta=0.02)
    steps, errors, balances = np.array([100, 200, 400]), [], []
    for n in steps:
        motion = fd.simulate(case, 3.0, method=tableau.name, dt=3.0 / n, initial=released(0.1))
        exact = 0.1 * damped(motion.time.values, OMEGA, 0.15 / OMEGA + 0.01 * OMEGA)
        errors.append(np.abs(place(motion) - exact).max())
        energy = motion.kinetic + motion.strain_bars + motion.dissipated
        balances.append(float(np.ptp(energy.values)))
    assert order(steps, errors) == pytest.approx(tableau.order, abs=0.15)
    assert order(steps, balances) > 2.5  # powers with other weights would leave less
    assert motion.attrs["force_evaluations"] == pytest.approx(len(tableau.weights) * 400, abs=1)


@pytest.mark.parametrize("tableau", [RK4, *TABLEAUS])
def test_the_critical_step_is_that_of_the_exponential_series(tableau):
    """Of s stages and order s, a step is the series to z^s: stable to sqrt(3) or sqrt(8)."""
    limit = {3: np.sqrt(3.0), 4: np.sqrt(8.0)}[tableau.order]
    found = fd.critical_step(spring(OMEGA), tableau.name)
    assert found == pytest.approx(0.9 * limit / OMEGA, rel=1e-3)


@pytest.mark.parametrize("tableau", TABLEAUS)
def test_gradients_are_those_of_the_method_itself(tableau):
    """Of a sheet that moves far, with steps so long that other methods' would be off."""
    sheet = fd.Sheet(1e5, 0.25, 0.01, density=100.0)
    pattern = fd.patterns.miura(cells=(1, 1), a=1.0, b=1.0, panel_angle=60, dihedral=60)
    structure = fd.discretize(pattern, sheet, preset="herkal")

    def case(stiffness):
        held = fd.Fix([0, 1, 2])
        load = fd.Force([7], (2.0, 0.0, 0.0), fd.HalfSine(0.3))
        made = replace(structure, fold_stiffness=stiffness)
        return fd.Case(made, [held], [load], damping=fd.Rayleigh(alpha=0.5))

    own = structure.fold_stiffness
    dt = float(0.8 * fd.critical_step(case(own), tableau.name))
    options = {"duration": float(200 * dt), "method": tableau.name, "dt": dt, "every_steps": 50}
    analysis = {"kind": "dynamics", **options}
    found = fd.sensitivity(
        case(own), ["fold_stiffness"], measures="displacement[8,x]", analysis=analysis
    )
    slope = found["gradient_fold_stiffness"].values[0] @ own

    def end(h):
        motion = fd.simulate(case(own * (1.0 + h)), **options)
        return float(motion.displacement[-1].sel(node=8, axis="x"))

    h = 1e-4
    difference = (8.0 * (end(h) - end(-h)) - (end(2.0 * h) - end(-2.0 * h))) / (12.0 * h)
    assert slope == pytest.approx(difference, rel=1e-6)


def test_a_history_is_looked_at_where_the_tableau_says():
    seen = []

    def history(t):
        seen.append(np.asarray(t, float).ravel())
        return np.zeros_like(t)

    fd.simulate(pulled(spring(OMEGA), 1.0, history), 0.3, method="heun3", dt=0.003)
    wanted = np.add.outer(0.003 * np.arange(100), 0.003 * np.array([0.0, 1 / 3, 2 / 3]))
    times = np.sort(np.concatenate(seen))
    assert (
        np.abs(times[np.searchsorted(times, wanted.ravel() - 1e-9)] - wanted.ravel()).max() < 1e-9
    )


def test_a_method_without_a_limit_of_its_step_is_refused():
    with pytest.raises(TypeError, match="rk4: an explicit method needs growth"):
        replace(METHODS["rk4"], growth=None)


def test_a_tableau_that_lacks_a_stage_is_refused():
    with pytest.raises(TypeError, match=r"kutta3: stages must have 1, 2, \.\.\., 2 shares"):
        runge_kutta(KUTTA._replace(stages=((0.5,),)))
