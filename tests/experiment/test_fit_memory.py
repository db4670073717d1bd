"""Laws with memory fitted: a motion that relaxes, a cyclic test."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from fit_cases import PRESSED, SAME_STEPS, SWUNG, write

import foldyn as fd
from foldyn.errors import ComputationError
from foldyn.experiment import ForceDisplacement, Parameter, TimeHistory
from foldyn.experiment.calibration.fit_problem import problem

pytestmark = pytest.mark.filterwarnings(SAME_STEPS)

ELASTIC = 'fold_law = { kind = "enhanced", theta1 = 45, theta2 = 290 }'
PRONY = 'fold_law = { kind = "prony", ratios = [0.6], times = [0.15] }'
PLASTIC = 'fold_law = { kind = "plastic", yield_moment = 2e-3, kinematic = 0.01, law = "linear" }'


def test_a_relaxation_is_found_in_a_motion(tmp_path):
    """Ratio and time of a branch from the history of one node, exact and within its noise."""
    path = write(tmp_path, SWUNG.replace(ELASTIC, PRONY))
    time = np.arange(0.1, 2.0, 0.02)
    parameters = [
        Parameter("model.fold_law.ratios[0]", 0.3, 0.05, 3.0),
        Parameter("model.fold_law.times[0]", 0.3, 0.02, 2.0),
    ]
    blank = TimeHistory(nodes=[0], time=time, values=np.sin(time)[:, None])
    (exact,) = problem(path, [blank], parameters, {}).predict([0.6, 0.15])
    exact = exact.reshape(-1, 1)
    fit = fd.fit(path, [TimeHistory(nodes=[0], time=time, values=exact)], parameters)
    assert fit["model.fold_law.ratios[0]"].value == pytest.approx(0.6, rel=1e-3)
    assert fit["model.fold_law.times[0]"].value == pytest.approx(0.15, rel=1e-3)
    noise = 1e-2 * np.ptp(exact) * np.random.default_rng(1).standard_normal(exact.shape)
    fit = fd.fit(path, [TimeHistory(nodes=[0], time=time, values=exact + noise)], parameters)
    for one, truth in zip(fit.estimates, (0.6, 0.15), strict=True):
        assert one.value == pytest.approx(truth, abs=4.0 * one.standard_error)


def cyclic(path, displacement):
    """The test that the case itself gives."""
    case = fd.read_case(path).case()
    factors = displacement / -0.3
    way = fd.statics.trace(case, load_factors=factors.tolist())
    moved = np.isin(way.support_node, [0, 1]) & (way.support_axis == "x").values
    force = way.reaction.values[:, moved].sum(axis=1)
    return ForceDisplacement(displacement=displacement, force=force)


def test_a_cyclic_test_gives_yield_moment_and_hardening(tmp_path):
    path = write(tmp_path, PRESSED.replace(ELASTIC, PLASTIC))
    way = np.array([0.0, 0.1, 0.2, 0.3, 0.2, 0.1, 0.0, 0.1, 0.2, 0.3])
    test = cyclic(path, -way)
    assert abs(test.force[4] - test.force[2]) > 0.1 * np.ptp(test.force)
    fit = fd.fit(
        path, [test],
        [
            Parameter("model.fold_law.yield_moment", 4e-3, 1e-4, 2e-2),
            Parameter("model.fold_law.kinematic", 0.02, 1e-3, 0.2),
        ],
    )  # fmt: skip
    assert fit["model.fold_law.yield_moment"].value == pytest.approx(2e-3, rel=1e-3)
    assert fit["model.fold_law.kinematic"].value == pytest.approx(0.01, rel=1e-3)
    test, other = (replace(one, sigma=1e-6) for one in (test, cyclic(path, -way[:3])))
    with pytest.raises(ComputationError, match="creases that yield depend on the way"):
        fd.fit(path, [test, other], [Parameter("model.fold_law.yield_moment", 4e-3, 1e-4, 2e-2)])
