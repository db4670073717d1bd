"""What measurements refuse, and what the model says of them."""

from __future__ import annotations

import fit_cases
import numpy as np
import pytest
from fit_cases import refused

import foldyn as fd
from foldyn.errors import FoldynWarning, InputError
from foldyn.experiment import ForceDisplacement, Parameter, Shapes, Sight, Spectrum, TimeHistory
from foldyn.experiment.calibration.fit_problem import problem
from foldyn.signals import spectrum

TIME = np.arange(0.0, 2.0, 0.05)
SWAY = np.sin(TIME)
ALPHA = [Parameter("damping.alpha")]


def history(**changes) -> TimeHistory:
    return TimeHistory(**{"nodes": [0], "time": TIME, "values": SWAY, **changes})


@pytest.fixture(scope="module")
def motion(swung):
    case_file = fd.read_case(swung)
    return fd.simulate(case_file.case(), 2.0, method="newmark", dt=0.02)


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"values": np.full(40, 0.0031)}, "node 0 is constant (0.0031 m at all times)"),
        ({"values": np.full(40, np.nan)}, "node 0 has 0 values that are numbers"),
        ({"values": SWAY[:-1]}, "shape (39, 1): must be (40 times, nodes)"),
        ({"values": np.where(TIME > 1, np.inf, SWAY)}, "infinite; give NaN where a node was lost"),
        ({"time": TIME[::-1]}, "must be at least two increasing times"),
        ({"time": np.where(TIME > 1, np.nan, TIME)}, "time[21] = nan: must be a finite number"),
        ({"axis": "w"}, 'axis = "w": choose one of x, y, z'),
        ({"sigma": 0.0}, "sigma = 0.0: must be greater than 0"),
        ({"align": -0.01}, "align = -0.01: must be at least 0"),
        ({"detrend": "mean"}, 'detrend = "mean": choose'),
        ({"nodes": []}, "nodes = []"),
    ],
)
def test_histories_that_say_nothing(changes, message) -> None:
    with pytest.raises(InputError) as caught:
        history(**changes)
    assert f"history: {message}" in str(caught.value) or message in str(caught.value)


def test_forces_and_shapes_are_checked() -> None:
    with pytest.raises(InputError, match=r"force: shape \(2,\): must be a list of 3 numbers"):
        ForceDisplacement(displacement=[1, 2, 3], force=[1, 2])
    with pytest.raises(InputError, match=r"force\[1\] = nan: must be a finite number"):
        ForceDisplacement(displacement=[1, 2], force=[1, float("nan")])
    with pytest.raises(InputError, match=r"must be \(steps, nodes, axes\), here \(1, nodes, 3\)"):
        Shapes(nodes=[0], load_factor=[1.0], values=np.zeros((1, 1, 2)))
    with pytest.raises(InputError, match="NaN where a node is not seen"):
        Shapes(nodes=[0], load_factor=[1.0], values=np.full((1, 1, 3), np.nan))


@pytest.mark.parametrize(
    ("data", "message"),
    [
        ([], "data: none; give at least one measurement"),
        (["forces.csv"], "data[0]: got"),
        ([history(nodes=[0, 1])], "values: has 1 nodes, but 2 are named"),
        ([history(nodes=[99])], "node 99 is out of range"),
        ([history(delay=0.1)], "time: 0.1 to 2.05 s, delay included, is not within the motion"),
        ([history(), history()], "sigma: missing; several measurements are weighted"),
        ([ForceDisplacement(displacement=[1], force=[1])], 'needs a case of kind "statics"'),
        ([history(held_out=True)], "0 values that are not held out cannot give 1 parameters"),
        ([history(case="none.toml")], "none.toml: there is no such file"),
        ([history(changes={"sheet.thicknes": 1.0})], "did you mean 'thickness'"),
        ([history(changes={"analysis.method": "dormand_prince"})], "has adaptive steps, which"),
    ],
)
def test_data_that_do_not_fit_the_case(swung, data, message) -> None:
    with refused(message):
        problem(swung, data, ALPHA, {})


def test_a_case_that_is_no_file(swung) -> None:
    with pytest.raises(InputError, match=r"case = <CaseFile .*: give the path of a file"):
        problem(fd.read_case(swung), [history()], ALPHA, {})


def test_warnings_of_a_case_are_told_once(tmp_path) -> None:
    partly = fit_cases.SWUNG.replace("nodes = [0, 1]\nforce", "nodes = [0, 4]\nforce")
    path = fit_cases.write(tmp_path, partly)
    with pytest.warns(FoldynWarning, match="acts in part where supports hold") as told:
        model = problem(path, [history()], ALPHA, {})
    assert len(told) == 1
    model.digest()
    assert len(model.predict([0.4])[0]) == len(TIME)


def test_forces_need_imposed_displacements(pressed) -> None:
    data = [ForceDisplacement(nodes=[2], displacement=[-0.1], force=[0.1])]
    with pytest.raises(InputError, match="no support of the case moves node 2 along x"):
        problem(pressed, data, [Parameter("sheet.thickness")], {})


def test_forces_are_the_reactions_of_the_path(pressed) -> None:
    moved = np.array([-0.3, -0.1, -0.15])
    one = ForceDisplacement(displacement=moved, force=np.zeros(3))
    (said,) = problem(pressed, [one], [Parameter("sheet.thickness")], {}).predict([0.01])
    path = fd.trace(fd.read_case(pressed).case(), load_factors=[1 / 3, 0.5, 1.0])
    loaded = path.reaction.values[
        :, np.isin(path.support_node, [0, 1]) & (path.support_axis == "x")
    ]
    np.testing.assert_allclose(said, loaded.sum(axis=1)[[2, 0, 1]], rtol=1e-7)


def test_shapes_are_displacements_or_positions_where_seen(pressed) -> None:
    values = np.zeros((2, 3, 2))
    values[0, 1] = np.nan
    given = {"nodes": [2, 3, 0], "load_factor": [0.5, 1.0], "values": values, "axes": "xz"}
    both = [Shapes(**given, sigma=1.0), Shapes(**given, quantity="position", sigma=1.0)]
    moved, placed = problem(pressed, both, [Parameter("sheet.thickness")], {}).predict([0.01])
    case = fd.read_case(pressed).case()
    path = fd.trace(case, load_factors=[0.5, 1.0])
    expected = path.displacement.sel(node=[2, 3, 0], axis=["x", "z"]).values
    seen = np.isfinite(values)
    np.testing.assert_allclose(moved, expected[seen], rtol=1e-7, atol=1e-12)
    rest = case.structure.nodes[[2, 3, 0]][:, [0, 2]]
    np.testing.assert_allclose(placed, (expected + rest)[seen], rtol=1e-7)


def test_histories_are_the_motion_at_the_measured_times(swung, motion) -> None:
    lost = np.stack([SWAY, np.where(TIME > 1.5, np.nan, SWAY)], axis=1)
    time = TIME - 0.01
    one = history(nodes=[2, 0], time=time, values=lost, delay=0.01)
    (said,) = problem(swung, [one], ALPHA, {}).predict([0.4])
    x = motion.displacement.sel(axis="x").interp(time=TIME, method="cubic")
    expected = [*x.sel(node=2).values, *x.sel(node=0).values[TIME <= 1.5]]
    np.testing.assert_allclose(said, expected, atol=1e-6)
    assert len(one.observed()) == len(said)


@pytest.mark.parametrize("detrend", ["constant", "linear"])
def test_a_trend_in_the_data_does_not_matter_when_it_is_taken_off(swung, detrend) -> None:
    drift = 3.0 if detrend == "constant" else 3.0 + 0.5 * TIME
    one, other = (history(values=SWAY + d, detrend=detrend) for d in (0.0, drift))
    np.testing.assert_allclose(one.observed(), other.observed(), atol=1e-12)
    assert np.abs(other.observed()).max() < 1.0


def test_spectra_of_the_motion_are_those_of_the_same_window(swung, motion) -> None:
    seen = motion.displacement.sel(axis="x", node=[0, 2]).values
    whole = history(nodes=[0, 2], time=motion.time.values, values=seen)
    one = Spectrum.of(whole, (0.4, 4.0), taper="hann")
    (said,) = problem(swung, [one], ALPHA, {}).predict([0.4])
    np.testing.assert_allclose(said, one.observed(), rtol=1e-6)
    frequency, amplitude = spectrum(seen, 0.02, window="hann", detrend="constant")
    chosen = (frequency >= 0.4) & (frequency <= 4.0)
    np.testing.assert_allclose(one.frequency, frequency[chosen])
    np.testing.assert_allclose(one.observed(), amplitude[chosen].T.ravel())


def test_spectra_need_whole_records() -> None:
    with pytest.raises(InputError, match="needs every sample of a node"):
        Spectrum.of(history(values=np.where(TIME > 1, np.nan, SWAY)), (0.1, 2.0))
    with pytest.raises(InputError, match="holds none of the frequencies"):
        Spectrum.of(history(), (3.02, 3.03))


@pytest.mark.parametrize("late", [0.0, 0.0131, -0.0272])
def test_an_unknown_start_is_found(motion, swung, late) -> None:
    """A record of the model itself that counts its time from another instant."""
    case = fd.read_case(swung).case()
    time = np.arange(0.4, 1.2, 0.02)
    exact = history(time=time, values=np.ones((40, 1)) * np.arange(40)[:, None])
    values = exact.modelled(motion, case)
    shifted = history(time=time - late, values=values, align=0.05)
    assert shifted.shift(motion, case) == pytest.approx(late, abs=1e-9)
    np.testing.assert_allclose(shifted.predicted(motion, case), values.ravel(), atol=1e-9)
    bounded = history(time=time - late, values=values, align=0.01)
    assert abs(bounded.shift(motion, case)) <= 0.01
    outside = history(time=time + 0.79, values=values, align=0.05)
    with pytest.raises(InputError, match="is not within the motion"):
        outside.check(case, {"duration": 2.0})


def test_what_was_measured_counts_where_the_start_is_unknown(swung) -> None:
    """Predictions then depend on the values; kept evaluations must not be mixed up."""
    time = np.arange(0.4, 1.2, 0.02)
    digests = {}
    for align in (0.0, 0.05):
        for k, scale in enumerate((1.0, 2.0)):
            one = history(time=time, values=scale * np.sin(9.0 * time)[:, None], align=align)
            digests[align, k] = problem(swung, [one], ALPHA, {}).digest()
    assert digests[0.0, 0] == digests[0.0, 1]
    assert len(set(digests.values())) == 3


def test_a_motion_is_compared_as_its_camera_sees_it(motion, swung) -> None:
    """A node that comes nearer seems to go out from the middle of the picture."""
    case, depth = fd.read_case(swung).case(), 0.4
    rest = motion["rest_position"].values[2]
    camera = Sight(
        rest + np.array([0.01, 0.02, depth]), np.array([0.0, 0.0, -1.0]), np.full(9, depth)
    )
    moved = motion["displacement"].sel(node=2).values
    assert np.abs(moved[:, 2]).max() > 1e-9
    seen = (moved[:, 0] - 0.01) / (1.0 - moved[:, 2] / depth) + 0.01
    known = {"nodes": [2], "time": motion["time"].values, "values": moved[:, 0]}
    plain, looked = history(**known), history(**known, sight=camera)
    assert plain.modelled(motion, case)[:, 0] == pytest.approx(moved[:, 0], abs=1e-15)
    assert looked.modelled(motion, case)[:, 0] == pytest.approx(seen, abs=1e-15)
    digests = [problem(swung, [one], ALPHA, {}).digest() for one in (plain, looked)]
    assert digests[0] != digests[1]
