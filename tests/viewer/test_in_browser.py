"""Pages in a real browser, with WebGL2 and without; skipped where none is found."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from page_samples import KINDS, PAGE, PAINTERS, case, evaluate, results


@pytest.mark.parametrize("painter", PAINTERS)
@pytest.mark.parametrize("kind", KINDS)
def test_opens_alone_and_draws(opened, kind, painter):
    tab = opened(kind, painter=painter)
    drawn_by = tab.get_attribute(".foldyn", "data-painter")
    assert drawn_by == "canvas" if painter == "plain" else drawn_by in ("webgl", "canvas")
    tab.wait_for_timeout(200)
    assert tab.errors == []
    assert [url for url in tab.asked if not url.startswith(("file:", "data:", "blob:"))] == []
    drawn = evaluate(
        tab,
        """p.play(false); p.draw(); const c = document.createElement('canvas');
        c.width = p.view.canvas.width; c.height = p.view.canvas.height;
        const x = c.getContext('2d'); x.drawImage(p.view.canvas, 0, 0);
        const pixels = x.getImageData(0, 0, c.width, c.height).data.buffer;
        return new Set(new Uint32Array(pixels)).size""",
    )
    assert drawn > 5  # paper in several shades, lines


@pytest.mark.parametrize("width", [1400, 390])
@pytest.mark.parametrize("kind", KINDS)
def test_fits_the_window(opened, kind, width):
    tab = opened(kind, width)
    assert tab.evaluate("document.documentElement.scrollWidth") <= width


@pytest.mark.parametrize("width", [1700, 1100, 390])
def test_text_begins_where_the_sheet_above_it_does(opened, width):
    left = "[...document.querySelectorAll('.foldyn, h1, main > h2, main > p, main > .table')]"
    places = opened("motion", width).evaluate(f"{left}.map((e) => e.getBoundingClientRect().left)")
    assert len(places) > 1 and max(places) - min(places) < 1.0


@pytest.mark.parametrize("painter", PAINTERS)
def test_positions_are_those_of_the_result(opened, painter):
    tab = opened("motion", painter=painter)
    result = results("motion")["panel"]
    nodes = case().structure.nodes
    for sample in (0, 57, 211):
        moment = f"p.play(false); p.moment = {float(result['time'][sample])!r}; p.draw(); "
        got = evaluate(tab, moment + "return Array.from(p.results[1].positions)")
        wanted = nodes + result["displacement"].values[sample]
        assert np.abs(np.reshape(got, (-1, 3)) - wanted).max() < 1e-4 * np.ptp(nodes, axis=0).max()


def test_colors_are_levels_of_the_values(opened):
    tab = opened("motion")
    tab.select_option(".field", "displacement")
    result = results("motion")["circumcenter"]
    sizes = np.linalg.norm(result["displacement"].values, axis=2)
    top = max(np.linalg.norm(r["displacement"], axis=2).max() for r in results("motion").values())
    moment = f"p.play(false); p.moment = {float(result['time'][120])!r}; p.draw(); "
    got = evaluate(tab, moment + "return Array.from(p.results[0].shown.levels)")
    assert np.abs(np.array(got) - sizes[120] / top).max() < 2e-3
    assert "displacement" in tab.inner_text(".legend")


def test_plays_scrubs_and_picks_by_keys_and_mouse(opened):
    tab = opened("motion")
    assert tab.get_attribute(".toggle", "aria-label") == "Pause"
    tab.focus("canvas.over")
    tab.keyboard.press("Space")
    assert tab.get_attribute(".toggle", "aria-label") == "Play"
    tab.evaluate("document.querySelector('.scrub').value = 500")
    tab.dispatch_event(".scrub", "input")
    assert tab.evaluate(f"{PAGE}.moment") == pytest.approx(1.5, abs=0.01)
    before = tab.evaluate(f"{PAGE}.camera.azimuth")
    tab.focus("canvas.over")
    tab.keyboard.press("ArrowRight")
    assert tab.evaluate(f"{PAGE}.camera.azimuth") == before + 5
    x, y = evaluate(
        tab,
        """p.draw(); const at = p.camera.projector(p.view.views()[0]);
        return at(...p.results[0].positions.subarray(9, 12), [0, 0, 0]).slice(0, 2)""",
    )
    tab.click("canvas.over", position={"x": x, "y": y})
    assert tab.evaluate(f"{PAGE}.node") == 3
    assert "Node 3 moved by" in tab.inner_text(".status")
    assert "node 3" in tab.get_attribute(".charts [role=img]", "aria-label")
    tab.keyboard.press("n")
    assert tab.evaluate(f"{PAGE}.node") == 4


def test_the_spectrum_has_the_peak_of_the_motion(opened):
    tab = opened("motion")
    curve = "const c = p.plots[1].curves[0]; return [Array.from(c.x), Array.from(c.y)]"
    frequency, amplitude = evaluate(tab, curve)
    result = results("motion")["circumcenter"]
    axis = tab.evaluate(f"{PAGE}.axis")
    values = result["displacement"].values[:, 0, axis]
    t = result["time"].values
    window = np.hanning(len(t)) * (values - values.mean())
    peak = frequency[int(np.argmax(amplitude))]

    def at(f):
        return abs(np.sum(window * np.exp(-2j * np.pi * f * t)))

    assert at(peak) > 0.98 * max(map(at, np.linspace(0.05, frequency[-1], 2000)))


def test_still_for_those_who_ask_for_it_and_dark(opened):
    tab = opened("motion", reduced_motion="reduce", color_scheme="dark")
    assert tab.evaluate(f"{PAGE}.playing") is False
    assert tab.evaluate("document.documentElement.classList.contains('dark')")


def test_saves_curves_and_pictures(opened):
    tab = opened("motion", accept_downloads=True)
    with tab.expect_download() as curves:
        tab.click(".save-curves")
    text = Path(curves.value.path()).read_text("utf-8")
    assert text.startswith('"time (s)"') and len(text.splitlines()) > 250
    with tab.expect_download() as picture:
        tab.click(".save-picture")
    assert Path(picture.value.path()).read_bytes().startswith(b"\x89PNG")
