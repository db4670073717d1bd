"""What a reader does with a page: by keys alone, with an accessibility checker, into files."""

from __future__ import annotations

import csv
import re
import xml.etree.ElementTree as ElementTree
from pathlib import Path

import numpy as np
import pytest
from page_samples import ALL, PAINTERS, camera, case, evaluate, results

SVG = "{http://www.w3.org/2000/svg}"


def saved(tab, button):
    with tab.expect_download() as download:
        tab.click(button)
    return Path(download.value.path()).read_text("utf-8")


@pytest.mark.parametrize(
    ("kind", "scheme"), [*((kind, "light") for kind in ALL), ("motion", "dark"), ("modes", "dark")]
)
def test_an_accessibility_checker_finds_nothing_serious(opened, kind, scheme):
    checker = pytest.importorskip("axe_playwright_python.sync_playwright")
    tab = opened(kind, bypass_csp=True, color_scheme=scheme, reduced_motion="reduce")
    response = checker.Axe().run(tab).response
    assert {"button-name", "color-contrast"} <= {each["id"] for each in response["passes"]}
    grave = ("serious", "critical")
    assert [each for each in response["violations"] if each["impact"] in grave] == []


@pytest.mark.parametrize("kind", ALL)
def test_tab_reaches_every_control(opened, kind):
    tab = opened(kind, reduced_motion="reduce")
    wanted = evaluate(
        tab,
        """const all = p.root.querySelectorAll('button, select, input, canvas[tabindex]');
        return [...all].filter((e) => e.tabIndex >= 0 && e.checkVisibility()).length""",
    )
    evaluate(tab, "document.activeElement.blur(); window.reached = new Set(); return 0")
    for _ in range(wanted):
        tab.keyboard.press("Tab")
        evaluate(tab, "window.reached.add(document.activeElement); return 0")
    reached = "return [...window.reached].filter((e) => p.root.contains(e)).length"
    assert evaluate(tab, reached) == wanted
    assert tab.evaluate("getComputedStyle(document.activeElement).outlineStyle") != "none"


def test_a_motion_by_keys_alone(opened):
    tab = opened("motion", reduced_motion="reduce")
    tab.focus(".toggle")
    tab.keyboard.press("Enter")
    assert evaluate(tab, "return p.playing")
    tab.keyboard.press("Enter")
    tab.focus(".scrub")
    tab.keyboard.press("Home")
    assert evaluate(tab, "return p.moment") == 0.0
    tab.keyboard.press("End")
    assert evaluate(tab, "return p.moment") == pytest.approx(3.0)
    tab.focus(".field")
    tab.keyboard.press("ArrowDown")
    assert evaluate(tab, "return p.field") == "displacement"
    tab.focus("canvas.over")
    tab.keyboard.press("c")
    assert evaluate(tab, "return [p.node, p.crease]") == [None, 0]
    assert "Crease 0" in tab.inner_text(".status")
    key = tab.locator(".keys button", has_text="work")
    key.focus()
    tab.keyboard.press("Space")
    assert key.get_attribute("aria-pressed") == "false"
    assert not evaluate(tab, "return p.playing")


def test_the_turn_of_a_crease_is_that_of_the_result(opened):
    tab = opened("motion", reduced_motion="reduce")
    evaluate(tab, "p.pickCrease(0); return 0")
    found = evaluate(tab, "return Array.from(p.plots[0].curves[0].y)")
    structure, u = case().structure, results("motion")["circumcenter"]["displacement"].values
    turn = [np.degrees(structure.dihedrals(x)[0][0] - structure.fold_rest[0]) for x in u[::50]]
    assert np.abs(np.array(found)[::50] - turn).max() < 5e-3 * np.abs(turn).max()


@pytest.mark.parametrize("painter", PAINTERS)
def test_pixels_have_the_color_of_the_value(opened, painter):
    tab = opened("motion", painter=painter, reduced_motion="reduce")
    levels, pixels = evaluate(
        tab,
        """p.results[1].chosen = p.marks = p.ghost = false; p.field = 'energy'; p.recolor();
        p.camera.elevation = 90; p.moment = 0.4; p.draw();
        const copy = document.createElement('canvas');
        Object.assign(copy, { width: p.view.canvas.width, height: p.view.canvas.height });
        const c = copy.getContext('2d'); c.drawImage(p.view.canvas, 0, 0);
        const to = p.camera.projector(p.view.views()[0]);
        const x = p.results[0].positions;
        const pixel = (nodes) => { // beside the middle of a panel
          const s = [0, 1, 2].map((j) => nodes.reduce((sum, k) => sum + x[3 * k + j] / 4, 0.02));
          const [u, v] = to(...s, [0, 0, 0]).map((value) => value * p.view.dpr);
          return [...c.getImageData(u, v, 1, 1).data] };
        const panels = [[0, 1, 2, 3], [2, 3, 4, 5]];
        return [Array.from(p.results[0].shown.levels), panels.map(pixel)]""",
    )
    ramp = np.array([[int(color[k : k + 2], 16) for k in (1, 3, 5)] for color in STOPS], float)
    for level, pixel in zip(levels, pixels, strict=True):
        place = np.clip(level, 0.0, 1.0) * (len(ramp) - 1)
        wanted = [np.interp(place, range(len(ramp)), ramp[:, k]) for k in range(3)]
        shade = np.dot(pixel[:3], wanted) / np.dot(wanted, wanted)
        assert 0.6 < shade < 1.06
        assert np.abs(pixel[:3] - shade * np.array(wanted)).max() < 4.0


STOPS = ("#fdf6e3", "#f6dca0", "#f2b95f", "#e58c3c", "#cc5d38", "#a3363f", "#6f1d44", "#3a0f3a")


def test_the_matrix_of_modes_shows_pairs_of_shapes(opened):
    tab = opened("modes", reduced_motion="reduce")
    cells = tab.locator(".mac button")
    assert cells.count() == 16
    cells.nth(0).focus()
    tab.keyboard.press("ArrowDown")
    tab.keyboard.press("ArrowRight")
    tab.keyboard.press("Enter")
    assert evaluate(tab, "return p.shown.map(({ name }) => name)") == ["circumcenter 2", "panel 2"]
    assert tab.evaluate("document.activeElement.dataset.key") == "mac 1 5"
    told = tab.evaluate("document.activeElement.textContent")
    assert told == f"{evaluate(tab, 'return p.about.mac[1][5]'):.2f}"


@pytest.mark.parametrize("painter", PAINTERS)
def test_a_photograph_lies_under_what_its_camera_sees(opened, painter):
    tab = opened("film", painter=painter, reduced_motion="reduce")
    assert tab.errors == []
    nodes = evaluate(
        tab,
        """p.seek(1.5); const v = p.view.views()[0]; const to = p.camera.projector(v);
        const f = p.camera.framed(v); const out = [];
        const x = p.results[0].positions;
        for (let k = 0; k < 18; k += 3) { const [a, b] = to(x[k], x[k + 1], x[k + 2], [0, 0, 0]);
          out.push([(a - v.x - f.left) / f.factor - 0.5, (b - v.y - f.top) / f.factor - 0.5]) }
        return out""",
    )
    u = results("motion")["circumcenter"]["displacement"].values[150, :6]
    assert np.abs(nodes - camera().project(case().structure.nodes[:6] + u)).max() < 0.05
    corner = evaluate(
        tab,
        """const c = p.view.under; const f = p.camera.framed(p.view.views()[0]);
        const [u, v] = [f.left + 9, f.top + 9].map((value) => value * p.view.dpr);
        return [...c.getImageData(u, v, 1, 1).data]""",
    )
    assert corner == [160, 160, 160, 255]  # that of 1 s
    tab.uncheck(".photograph")
    assert evaluate(tab, "return p.camera.photograph") is None


def test_a_vector_picture_has_the_lines_and_the_legend(opened):
    tab = opened("path", accept_downloads=True, reduced_motion="reduce")
    tab.select_option(".field", "displacement")
    ends = evaluate(
        tab,
        """p.seek(p.results[0].moments.at(-1)); const to = p.camera.projector(p.view.views()[0]);
        const x = p.results[0].positions;
        return [0, 3, 6, 9, 12, 15].map((k) => to(x[k], x[k + 1], x[k + 2], [0, 0, 0]))""",
    )
    root = ElementTree.fromstring(saved(tab, ".save-vector"))
    texts = ["".join(each.itertext()) for each in root.iter(f"{SVG}text")]
    assert {"node 0", "mountain crease"} <= set(texts)
    assert any(text.startswith("displacement (") for text in texts)
    paths = " ".join(each.get("d") for each in root.iter(f"{SVG}path"))
    points = np.array(re.findall(r"[ML](-?[\d.]+) (-?[\d.]+)", paths), float)
    for x, y, _ in ends:
        assert np.hypot(*(points - [x, y]).T).min() < 0.1
    assert root.find(f".//{SVG}linearGradient[@gradientUnits]") is not None


def test_the_table_has_what_is_drawn(opened):
    tab = opened("path", accept_downloads=True, reduced_motion="reduce")
    before = next(csv.reader(saved(tab, ".save-curves").splitlines()))
    tab.locator(".keys button", has_text="work").click()
    after = next(csv.reader(saved(tab, ".save-curves").splitlines()))
    (gone,) = (head for head in before if head not in after)
    assert gone.endswith("work")
    assert len(before) == len(after) + 2


def test_energies_of_each_result_can_be_seen(opened):
    tab = opened("motion", reduced_motion="reduce")
    tab.select_option(".told select", "panel")
    found = evaluate(tab, "return p.plots.at(-1).curves[0].y[30]")
    wanted = results("motion")["panel"]["kinetic"].values[30]
    ratio = found / wanted  # of units: a power of ten
    assert found > 0 and np.isclose(ratio, 10 ** round(np.log10(ratio)), rtol=1e-4)
