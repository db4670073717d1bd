"""Quantities of the user's own: what is stored of them, and what is refused."""

from __future__ import annotations

import numpy as np
import pytest
from oscillators import linear_law, oscillator, released

import foldyn as fd
from foldyn.errors import ComputationError, InputError


def run(sample, method="rk4", **given):
    case = oscillator(linear_law(), 8.0)
    return fd.simulate(
        case, 1.0, method=method, interval=0.1, initial=released(0.1), sample=sample, **given
    )


@pytest.mark.matrix
@pytest.mark.parametrize("method", ["rk4", "generalized_alpha"])
def test_functions_get_the_state_at_the_samples_and_are_stored(method, tmp_path):
    speeds = fd.Quantity("m/s", "speed", ("node", "axis"), lambda u, v, t: np.abs(v))
    pair = {"place": lambda u, v, t: u[1, 0], "pair": lambda u, v, t: [t, v[1, 0]]}
    motion = run({**pair, "all": speeds}, method)
    np.testing.assert_array_equal(motion.place, motion.displacement[:, 1, 0])
    np.testing.assert_array_equal(motion.pair[:, 0], motion.time)
    np.testing.assert_array_equal(motion.pair[:, 1], motion.velocity[:, 1, 0])
    np.testing.assert_array_equal(motion["all"], np.abs(motion.velocity))
    assert motion.pair.dims == ("time", "pair_0")
    assert motion["all"].attrs == {"units": "m/s", "long_name": "speed"}
    fd.save(motion, tmp_path / "motion.nc")
    np.testing.assert_array_equal(fd.load(tmp_path / "motion.nc").place, motion.place)


@pytest.mark.matrix
def test_functions_cannot_change_the_motion():
    def spoil(u, v, t):
        u[:] = v[:] = 7.0
        return 0.0

    np.testing.assert_array_equal(run({"x": spoil}).displacement, run(None).displacement)


@pytest.mark.parametrize(
    ("sample", "message"),
    [
        (3, "sample = 3: give functions by name"),
        ({"kinetic": lambda u, v, t: 0.0}, "sample: 'kinetic' is not free"),
        ({"two words": lambda u, v, t: 0.0}, "is not free"),
        ({"case": lambda u, v, t: 0.0}, "sample: 'case' is not free"),
        ({"x": 7}, r"sample\.x: has no function"),
        ({"x": fd.Quantity("m")}, r"sample\.x: has no function"),
        ({"x": lambda u: 0.0}, r"sample\.x: the function raised TypeError"),
        ({"x": lambda u, v, t: "far"}, "sample.x: returned .far.; give a number"),
        ({"x": lambda u, v, t: np.nan}, r"sample\.x: returned nan; give finite numbers"),
        ({"x": fd.Quantity("m", "", ("node",), lambda u, v, t: u)}, "does not fit .*node"),
        ({"x": fd.Quantity("m", "", ("axis",), lambda u, v, t: u[:, 0])}, "does not fit .*axis"),
    ],
)
def test_what_cannot_be_stored_is_refused(sample, message):
    with pytest.raises(InputError, match=message):
        run(sample)


@pytest.mark.parametrize(
    ("late", "message"),
    [(np.nan, "returned nan"), ([1.0, 2.0], r"shape \(2,\)"), (None, "raised ZeroDivisionError")],
)
def test_a_motion_stops_where_they_end(late, message):
    def function(u, v, t):
        if t < 0.45:
            return t
        return late if late is not None else 1 / 0

    said = rf"sample\.x, at t = 0\.5 s: .*{message}"
    with pytest.raises(ComputationError, match=said) as stopped:
        run({"x": function})
    partial = stopped.value.partial
    np.testing.assert_allclose(partial.x[:5], partial.time[:5])
    assert np.isnan(partial.x[5:]).all() and partial.sizes["time"] > 5
