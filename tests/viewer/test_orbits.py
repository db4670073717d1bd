"""What pages hold of response curves and backbones: the motion at every point."""

from __future__ import annotations

from importlib import import_module

import numpy as np
import pytest
from decode import changing, decoded
from page_samples import evaluate, in_a_well, results

import foldyn as fd
from foldyn.viewer import stage
from foldyn.viewer.orbits import OF_MOTIONS, largest

PHASES = np.array([0.0, 0.7, 2.9, 5.0])


def stage_of(result):
    return stage({"cell": result}, {"cell": fd.case_of(result)}, "title", [2])


def displacements(result):
    """Of every point at the phases (point, phase, node, axis), by the series of the result."""
    turned = np.exp(1j * np.multiply.outer(PHASES, result["harmonic"].values))
    return np.einsum("sh,phna->psna", turned, result["coefficient"].values).real


def shown(part):
    """The same of the page."""
    (about,) = part.about["results"]
    size = decoded(part.arrays, about["sizes"])
    series = changing(part.arrays, about["displacement"])
    series = series.reshape(len(size), -1, *series.shape[1:])
    order = np.arange(series.shape[1])
    angle = np.multiply.outer(PHASES, (order + 1) // 2)
    waves = np.where((order % 2 == 1) | (order == 0), np.cos(angle), np.sin(angle))
    return size[:, None, None, None] * np.einsum("sc,pcna->psna", waves, series)


@pytest.mark.matrix
def test_motions_are_those_of_the_result():
    (result,) = results("periodic").values()
    part = stage_of(result)
    (about,) = part.about["results"]
    wanted, found = displacements(result), shown(part)
    size = decoded(part.arrays, about["sizes"])
    assert (size > 0.99 * np.abs(wanted).max(axis=(1, 2, 3))).all()
    most = 2 * result.sizes["harmonic"] * OF_MOTIONS
    assert (np.abs(found - wanted).max(axis=(1, 2, 3)) < most * size).all()
    np.testing.assert_allclose(decoded(part.arrays, about["x"]), result["frequency"], rtol=1e-6)
    np.testing.assert_allclose(decoded(part.arrays, about["y"]), result["amplitude"], rtol=1e-6)
    assert set(about["periods"]) == {1, 2}
    assert part.about["axis"] == 2
    assert part.about["measured"] == "m"


@pytest.mark.matrix
def test_of_many_points_those_with_names_are_kept(monkeypatch):
    (result,) = results("periodic").values()
    monkeypatch.setattr(import_module("foldyn.viewer.orbits"), "MOST_NUMBERS", 1000)
    (about,) = stage_of(result).about["results"]
    named = result["bifurcation"].values[result["bifurcation"].values != ""].tolist()
    assert [name for name in about["bifurcations"] if name] == named
    assert len(named) < len(about["stable"]) < result.sizes["point"]


@pytest.mark.matrix
def test_backbones_and_curves_along_the_amplitude_have_axes_of_their_own():
    case, _ = in_a_well()
    spine = fd.backbone(case, amplitudes=(1e-3, 0.01), harmonics=3)
    part = stage_of(spine)
    (about,) = part.about["results"]
    assert set(about["stable"]) == {None}
    assert part.about["along"] == "frequency (Hz)"
    most = 2 * spine.sizes["harmonic"] * OF_MOTIONS * spine["amplitude"].values
    off = np.abs(shown(part) - displacements(spine)).max(axis=(1, 2, 3))
    assert (off < 1.1 * most).all()  # also of the smallest
    along = fd.response_curve(case, amplitudes=(0.01, 0.05), harmonics=3)
    part = stage_of(along)
    assert part.about["along"] == "factor on the drive"
    x = decoded(part.arrays, part.about["results"][0]["x"])
    np.testing.assert_allclose(x[[0, -1]], [0.01, 0.05], rtol=1e-6)
    assert fd.view(along).title == "Response curve"


def test_a_click_on_the_curve_plays_the_motion_there(opened):
    """Nodes are where the doubled motion is, after one period of the drive and after two."""
    tab = opened("periodic", reduced_motion="reduce")
    (result,) = results("periodic").values()
    (point,) = np.flatnonzero(result["periods"].values == 2)[-1:]
    x, y = evaluate(
        tab,
        f"""const c = p.plots[0]; const j = c.curves.findIndex((one) => one.last > {point});
        const curve = c.curves[j]; const k = {point} - curve.first;
        const box = c.plot.over.getBoundingClientRect();
        return [box.left + c.plot.valToPos(curve.x[k], "x"),
                box.top + c.plot.valToPos(curve.y[k], "y")]""",
    )
    tab.mouse.click(x, y)
    here = result.isel(point=int(point))
    told = tab.inner_text(".status")
    assert f"{float(here['frequency']):.4g} Hz" in told
    assert "branch 1, repeats after 2 periods of the drive" in told
    turned = np.exp(1j * np.multiply.outer([0.3, 0.3 + np.pi], result["harmonic"].values))
    wanted = np.einsum("sh,hna->sna", turned, here["coefficient"].values).real
    most = 2 * result.sizes["harmonic"] * OF_MOTIONS * largest(here["coefficient"].values)
    assert np.abs(wanted[1] - wanted[0]).max() > 10.0 * most
    for turns, moved in zip((0, 1), wanted, strict=True):
        positions, rest, scale = evaluate(
            tab,
            f"""p.phase = 0.6 + {turns} * 2 * Math.PI; p.draw(); const [r] = p.results;
            return [Array.from(r.positions), Array.from(r.sheet.nodes), p.scale]""",
        )
        found = (np.array(positions) - np.array(rest)).reshape(-1, 3) / scale
        assert np.abs(found - moved).max() < most
    tab.wait_for_timeout(100)
    along = evaluate(tab, "return p.plots[1].curves[0].x.at(-1)")
    assert along == 2.0
    assert tab.errors == []
