"""The live page and views in notebooks, in a real browser; skipped where none is found."""

from __future__ import annotations

import threading
import tomllib
from pathlib import Path

import pytest
from live_samples import FOLD, MIURA, write

import foldyn as fd
from browsers import listened
from foldyn.live.files import served

LIVE = "document.getElementById('live')"
COLORS = """page => { page.play(false); page.draw();
const c = document.createElement('canvas'), { canvas } = page.view;
c.width = canvas.width; c.height = canvas.height;
const x = c.getContext('2d'); x.drawImage(canvas, 0, 0);
return new Set(new Uint32Array(x.getImageData(0, 0, c.width, c.height).data.buffer)).size }"""


@pytest.fixture
def tab(browser):
    """A page that keeps what it complains of."""
    context = browser.new_context(reduced_motion="reduce", accept_downloads=True)
    yield listened(context)
    context.close()


@pytest.fixture(scope="module", params=[FOLD, MIURA], ids=["fold", "miura"])
def running(request, tmp_path_factory):
    path = write(tmp_path_factory.mktemp("live"), request.param)
    server, _ = served([path])
    with server:
        threading.Thread(target=server.serve_forever, daemon=True).start()
        server.path = path
        yield server
        server.shutdown()


def shown(tab, count):
    tab.wait_for_selector(f"#live[data-shown='{count}']", timeout=300_000)  # the first compiles


def opened(tab, server):
    tab.goto(server.address)
    shown(tab, 1)


def slide(tab, name, part):
    """Move a slider to a part of its way."""
    tab.evaluate(
        f"""(() => {{ const n = {LIVE}.live.numbers.find((each) => each.name === '{name}');
        const s = n.slider; s.value = Number(s.min) + {part} * (s.max - s.min);
        s.dispatchEvent(new Event('input')) }})()"""
    )


def nodes_of(tab):
    """Coordinates of the nodes that are shown, one after the other."""
    return tab.evaluate(f"Array.from({LIVE}.live.page.results[0].sheet.nodes)")


def hold_nodes(tab, server, dihedral):
    """Hold the sheet that is shown to the pattern of the case file with another dihedral."""
    table = tomllib.loads(server.path.read_text("utf-8"))["pattern"] | {"dihedral": dihedral}
    vertices = getattr(fd.patterns, table.pop("kind"))(**table).vertices
    assert nodes_of(tab)[: vertices.size] == pytest.approx(vertices.ravel(), abs=1e-6)


@pytest.mark.matrix
def test_a_slider_changes_the_picture_and_the_view_stays(tab, running):
    opened(tab, running)
    before = 1
    if tab.evaluate(f"{LIVE}.live.page.about.kind") != "modes":
        tab.select_option(".kind", "modes")
        before = 2
        shown(tab, before)
    tab.evaluate(f"{LIVE}.live.page.camera.turn(25, 5)")
    turned = tab.evaluate(f"{LIVE}.live.page.camera.azimuth")
    root = "document.querySelector('.foldyn')"
    tab.evaluate(f"{root}.dataset.mine = '1'")
    nodes = nodes_of(tab)
    slide(tab, "pattern.dihedral", 0.75)
    shown(tab, before + 1)
    dihedral = tab.evaluate(f"{LIVE}.live.wanted.numbers['pattern.dihedral']")
    assert 130 < dihedral < 140
    assert nodes_of(tab) != nodes
    hold_nodes(tab, running, dihedral)
    assert tab.get_attribute(".foldyn", "data-mine") == "1"  # in place
    assert tab.evaluate(f"{LIVE}.live.page.camera.azimuth") == turned
    assert tab.evaluate(f"({COLORS})({LIVE}.live.page)") > 5
    assert tab.errors == []
    assert {url.split("/")[2] for url in tab.asked if not url.startswith("blob:")} == {
        f"127.0.0.1:{running.server_port}"
    }


def test_an_error_is_told_and_the_last_good_picture_stays(tab, running):
    opened(tab, running)
    nodes = nodes_of(tab)
    tab.fill("input[id='live-pattern.dihedral']", "-5")
    tab.keyboard.press("Tab")
    shown(tab, 2)
    said = tab.inner_text(".problem")
    assert "dihedral" in said and "last good one" in said
    assert nodes_of(tab) == nodes
    tab.click(".back")
    shown(tab, 3)
    assert tab.inner_text(".problem") == ""
    assert tab.errors == []


def test_cells_change_the_number_of_nodes(tab, running):
    if "cells" not in running.path.read_text("utf-8"):
        pytest.skip("a single fold")
    opened(tab, running)
    tab.fill("input[id='live-pattern.cells[1]']", "3")
    tab.keyboard.press("Tab")
    shown(tab, 2)
    assert tab.evaluate(f"{LIVE}.live.page.results[0].sheet.vertices") == 5 * 7
    assert tab.evaluate(f"({COLORS})({LIVE}.live.page)") > 5
    assert tab.errors == []


def test_the_newest_of_many_wishes_is_shown(tab, running):
    opened(tab, running)
    for k in range(30):
        slide(tab, "pattern.dihedral", 0.3 + 0.01 * k)
        tab.wait_for_timeout(10)
    last = tab.evaluate(f"{LIVE}.live.wanted.numbers['pattern.dihedral']")
    tab.wait_for_timeout(300)
    sent = tab.evaluate(f"{LIVE}.live.sent")
    shown(tab, sent)
    hold_nodes(tab, running, last)
    assert sent <= 31


def test_saves_the_case_file(tab, running):
    opened(tab, running)
    slide(tab, "sheet.thickness", 0.6)
    with tab.expect_download() as saved:
        tab.click(".save")
    text = Path(saved.value.path()).read_text("utf-8")
    assert tomllib.loads(text)["sheet"]["thickness"] == tab.evaluate(
        f"{LIVE}.live.wanted.numbers['sheet.thickness']"
    )


@pytest.mark.parametrize("width", [1500, 900, 390])
def test_the_page_fits_the_window(tab, running, width):
    tab.set_viewport_size({"width": width, "height": 900})
    opened(tab, running)
    assert tab.evaluate("document.documentElement.scrollWidth") <= width


def test_a_server_that_is_gone_is_told(tab, running):
    opened(tab, running)
    tab.context.set_offline(True)
    slide(tab, "pattern.dihedral", 0.5)
    tab.wait_for_selector(".problem:not(:empty)")
    assert "start foldyn view again" in tab.inner_text(".problem")


def test_results_and_patterns_are_served(tab, tmp_path):
    fd.save(fd.read_case(write(tmp_path, MIURA)).run(), tmp_path / "modes.nc")
    flat = fd.patterns.simple_fold(dihedral=179.99)
    flat = flat.changed(fold_angles=[-1.5])
    fd.write_pattern(flat, tmp_path / "fold.fold")
    for name, kind in (("modes.nc", "modes"), ("fold.fold", "folding")):
        server, _ = served([tmp_path / name])
        with server:
            threading.Thread(target=server.serve_forever, daemon=True).start()
            tab.goto(server.address)
            tab.wait_for_selector(".foldyn[data-ready='1']")
            page = "document.querySelector('.foldyn').page"
            assert tab.evaluate(f"{page}.about.kind") == kind
            assert tab.evaluate(f"({COLORS})({page})") > 5
            if kind == "folding":
                share = tab.evaluate(f"[...{page}.results[0].load]")
                assert (share[0], share[-1]) == (0, 1)
            server.shutdown()
    assert tab.errors == []


@pytest.mark.parametrize("what", ["case", "modes", "pattern", "folding"])
def test_a_view_draws_in_a_notebook(tab, tmp_path, what):
    case = fd.read_case(write(tmp_path, MIURA)).case()
    shown = {
        "case": lambda: case,
        "modes": lambda: fd.modes(case, 2),
        "pattern": lambda: fd.patterns.kresling(),
        "folding": lambda: fd.fold(fd.patterns.simple_fold(dihedral=170), 90.0, steps=4),
    }[what]()
    notebook = tmp_path / "notebook.html"
    notebook.write_text(
        f"<!DOCTYPE html><meta charset=utf-8><p id=secret>{fd.view(shown)._repr_html_()}", "utf-8"
    )
    tab.goto(f"file://{notebook}")
    frame = tab.wait_for_selector("iframe").content_frame()
    frame.wait_for_selector(".foldyn[data-ready='1']")
    assert frame.evaluate(f"({COLORS})(document.querySelector('.foldyn').page)") > 5
    alone = "(() => { try { return parent.document.title } catch { return 'kept out' } })()"
    assert frame.evaluate(alone) == "kept out"
    assert tab.errors == []
    assert [url for url in tab.asked if not url.startswith(("file:", "about:", "blob:"))] == []
