"""The paper specimen with creases that relax: it drifts back after its release."""

from __future__ import annotations

import numpy as np
import pytest

import foldyn as fd
from foldyn.experiment import Parameter, TimeHistory
from foldyn.experiment.calibration.fit_problem import problem
from foldyn.studies.herkal import calibration

LAW = {
    "kind": "prony",
    "ratios": [0.1],
    "times": [0.5],
    "law": {"kind": "enhanced", "theta1": 75, "theta2": 285},
}
TRUE = {
    "damping.alpha": 15.8,
    "model.fold_law.ratios[0]": 0.1,
    "model.fold_law.times[0]": 0.5,
}


@pytest.mark.slow
def test_drift_and_decay_are_fitted_together(tmp_path):
    """From the histories of two nodes with the noise of a film; 0.4 minutes once compiled."""
    path = calibration.released_case(
        tmp_path, {"model.fold_law": LAW}, support="glued", duration=0.8
    )
    time = np.arange(0.004, 0.78, 0.004)
    blank = TimeHistory(nodes=[3, 8], time=time, values=np.tile(np.sin(time)[:, None], 2))
    parameters = [
        Parameter("damping.alpha", 10.0, 1.0, 40.0),
        Parameter("model.fold_law.ratios[0]", 0.2, 0.01, 1.0),
        Parameter("model.fold_law.times[0]", 0.3, 0.05, 3.0),
    ]
    (moved,) = problem(path, [blank], parameters, {}).predict(list(TRUE.values()))
    moved = moved.reshape(2, -1).T
    late = moved[time > 0.6, 0]
    assert (late > 0.01 * moved[0, 0]).all()  # it has not come back yet, and only creeps
    assert (np.diff(late[::15]) < 0.0).all()
    noise = 2e-5 * np.random.default_rng(3).standard_normal(moved.shape)  # m
    seen = TimeHistory(nodes=[3, 8], time=time, values=moved + noise)
    found = fd.fit(path, [seen], parameters)
    for one in found.estimates:
        assert one.lower < TRUE[one.key] < one.upper
