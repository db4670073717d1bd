"""Friction between panels in motions: a strip on a held panel, sheets that collide askew."""

from __future__ import annotations

import numpy as np
import pytest
from contact_cases import G, two_sheets

import foldyn as fd
from contact_sheets import on_a_panel

MU = 0.3
METHODS = {
    "rk4": {},
    "central_difference": {},
    "dormand_prince": {},
    "generalized_alpha": {"dt": 1e-4},
    "energy_momentum": {"dt": 1e-4},
}


def on_slope(angle: float, alpha: float = 0.0) -> tuple[fd.Case, list[int]]:
    """A strip that lies, turned a little, on a panel that leans by some degrees."""
    s, strip = on_a_panel(shift=(0.013, 0.007), turn=0.3)
    a = np.radians(angle)
    held = fd.Fix(np.setdiff1d(np.arange(len(s.nodes)), strip))
    gravity = fd.Gravity((G * np.sin(a), 0, -G * np.cos(a)))
    contact = fd.Contact(friction=MU)
    return fd.Case(s, [held], [gravity], fd.Rayleigh(alpha=alpha), contact=contact), strip


def slid(case: fd.Case, strip: list[int], run) -> tuple[np.ndarray, float]:
    """How far the strip's center of mass has gone along the slope, m, and its mass, kg."""
    mass = case.structure.mass.toarray()[np.ix_(strip, strip)].sum(axis=1)
    return run.displacement.values[:, strip, 0] @ mass / mass.sum(), mass.sum()


@pytest.mark.matrix
@pytest.mark.filterwarnings("ignore:contact. at rest panels are nearer")
@pytest.mark.parametrize("method", METHODS)
def test_a_strip_slides_above_the_angle_of_friction(method):
    """A slope of 20 degrees; friction of 0.3 holds up to 16.7. The strip passes inner sides."""
    case, strip = on_slope(20.0)
    run = fd.simulate(case, 0.2, method=method, every=2e-3, **METHODS[method])
    a, (way, mass) = np.radians(20.0), slid(case, strip, run)
    assert way[-1] == pytest.approx(0.5 * G * (np.sin(a) - MU * np.cos(a)) * 0.2**2, rel=0.02)
    taken = MU * mass * G * np.cos(a) * way[-1]
    assert float(run.dissipated[-1]) == pytest.approx(taken, rel=0.03)
    assert run.attrs["energy_error"] < 1e-2


@pytest.mark.matrix
@pytest.mark.filterwarnings("ignore:contact. at rest panels are nearer")
@pytest.mark.parametrize("method", METHODS)
def test_a_strip_sticks_below_the_angle_of_friction(method):
    """A slope of 15 degrees: where it has come to rest it stays, for good."""
    case, strip = on_slope(15.0, alpha=200.0)
    run = fd.simulate(case, 0.4, method=method, every=2e-3, **METHODS[method])
    way = slid(case, strip, run)[0]
    assert abs(way[-1] - way[100]) < 1e-11
    assert 0.0 < way[-1] < 1e-5


@pytest.mark.parametrize("method", ["dormand_prince", "energy_momentum"])
def test_sheets_that_collide_askew_keep_both_momenta_and_lose_what_friction_takes(method):
    s, upper = two_sheets()
    v = np.zeros_like(s.nodes)
    v[upper] = 1.0, 0.5, -2.0
    runs = {
        mu: fd.simulate(
            fd.Case(s, contact=fd.Contact(friction=mu)), 0.02, method=method, every=1e-4,
            initial=fd.State(velocity=v), **METHODS[method],
        )
        for mu in (0.0, 0.5)
    }  # fmt: skip
    for mu, run in runs.items():
        p = np.einsum("nm,tmc->tnc", s.mass.toarray(), run.velocity.values)
        x = s.nodes + run.displacement.values
        for kept in (p.sum(axis=1), np.cross(x, p).sum(axis=1)):
            assert np.abs(kept - kept[0]).max() < 1e-7 * np.abs(kept[0]).max()
        assert run.attrs["energy_error"] < 1e-4
        lost = float(run.dissipated[-1]) / float(run.kinetic[0])
        assert lost > 1e-3 if mu else abs(lost) < 1e-12
    # friction takes the upper sheet's speed across, and gives it to the lower one
    across = [run.velocity.values[-1][~upper, 0].mean() for run in runs.values()]
    assert across[1] > across[0] + 0.05
