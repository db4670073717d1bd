"""What pages hold of bands: Bloch modes that fit together from cell to cell."""

from __future__ import annotations

from importlib import import_module

import numpy as np
import pytest
from decode import changing, decoded
from page_samples import PAGE, bands_file, evaluate, results

import foldyn as fd
from foldyn.errors import InputError
from foldyn.viewer import stage
from foldyn.viewer.waves import OF_SHAPES, smooth


@pytest.fixture(scope="module")
def part():
    shown = results("bands")
    return stage(shown, {name: fd.case_of(one) for name, one in shown.items()}, "title", [0])


def shapes_of(part) -> np.ndarray:
    """Bloch modes (state, band, phase, node, axis) of the page."""
    (about,) = part.about["results"]
    states, phases, bands = about["sizes"]
    values = changing(part.arrays, about["displacement"])
    rows = -(-phases // about["every"])
    return (values[:, 0] + 1j * values[:, 1]).reshape(states, bands, rows, *values.shape[2:])


@pytest.mark.matrix
def test_modes_are_those_of_the_result_but_for_size_and_phase(part):
    (result,) = results("bands").values()
    own = result["shape"].transpose("state", "band", "phase", "node", "axis").values
    found = shapes_of(part)
    own = own / np.linalg.norm(own, axis=-1).max(axis=-1)[..., None, None]
    overlap = np.einsum("...na,...na->...", own.conj(), found)
    turned = own * np.exp(1j * np.angle(overlap))[..., None, None]
    assert np.abs(turned - found).max() < 2.0 * OF_SHAPES


@pytest.mark.matrix
def test_of_many_modes_every_kth_is_kept(monkeypatch, part):
    monkeypatch.setattr(import_module("foldyn.viewer.waves"), "MOST_NUMBERS", 3000)
    shown = results("bands")
    fewer = stage(shown, {name: fd.case_of(one) for name, one in shown.items()}, "title", [0])
    (about,) = fewer.about["results"]
    assert about["every"] > 1
    kept, all_of_them = np.abs(shapes_of(fewer)), np.abs(shapes_of(part))
    off = np.abs(kept - all_of_them[:, :, :: about["every"]]).max()
    assert off < 2.0 * np.sqrt(2.0) * OF_SHAPES  # of two complex numbers


@pytest.mark.matrix
def test_modes_go_on_smoothly_and_have_one_size():
    (result,) = results("bands").values()
    shapes = smooth(result["shape"].transpose("state", "band", "phase", "node", "axis").values)
    np.testing.assert_allclose(np.linalg.norm(shapes, axis=-1).max(axis=-1), 1.0)
    overlap = np.einsum("...na,...na->...", shapes[:, :, :-1].conj(), shapes[:, :, 1:])
    assert (overlap.real >= -1e-12).all()
    assert np.abs(overlap.imag).max() < 1e-12 * np.abs(overlap).max()


def test_maps_bring_nodes_and_waves_to_their_partners(part):
    """A vertex on one side of a cell is the next cell's on the other, and swings with its phase."""
    (about,) = part.about["results"]
    states = about["sizes"][0]
    maps = decoded(part.arrays, about["maps"]).reshape(states, 2, 3, 4)
    places = decoded(part.arrays, about["places"]).reshape(states, -1, 3)
    waves, shapes = np.array(part.about["wave"])[:: about["every"]], shapes_of(part)
    cell = fd.UnitCell(bands_file().case())
    copies = cell.copies
    checked = 0
    for one, (kind, offset) in enumerate(zip(copies.kind, copies.offset, strict=True)):
        first = copies.first[kind]
        if one == first:
            continue
        step = offset - copies.offset[first]
        factor = np.exp(1j * waves @ step)[:, None]
        assert np.abs(shapes[:, :, :, one] - factor * shapes[:, :, :, first]).max() < 4 * OF_SHAPES
        if sorted(step.tolist()) == [0, 1]:
            (period,) = np.flatnonzero(step)
            moved = maps[:, period, :, :3] @ places[:, first, :, None]
            moved = moved[..., 0] + maps[:, period, :, 3]
            np.testing.assert_allclose(moved, places[:, one], atol=1e-6)
            checked += 1
    assert checked >= 4


@pytest.mark.matrix
def test_bands_without_a_case_file_have_a_page_if_they_have_shapes():
    """The gaps are those of the path; phases of a grid lie on none."""
    pattern = fd.patterns.miura(dihedral=60)
    structure = fd.discretize(
        pattern, fd.Sheet(1e6, 0.25, 0.01, 1.0, length_scale_ratio=10.0), preset="plate"
    )
    cell = fd.UnitCell(fd.Case(structure))
    path = cell.path("G-X-M-G", 13)
    found = fd.bands(cell, path, count=5, shape=True)
    (about,) = stage({"": found}, {"": cell.case}, "title", [0]).about["results"]
    ((state, below, bottom, top),) = about["gaps"]
    values = np.sort(found["frequency"].values, axis=1)
    assert (state, below) == (0, 4)
    np.testing.assert_allclose([bottom, top], [values[:, 3].max(), values[:, 4].min()], rtol=1e-5)
    for bad, message in (
        (fd.bands(cell, path, count=2), "without shape have no page; compute them with shape=True"),
        (
            fd.bands(cell, cell.grid(3), count=2, shape=True),
            "without distance .*; take phases of cell.p",
        ),
    ):
        with pytest.raises(InputError, match=message):
            stage({"": bad}, {"": cell.case}, "title", [0])


def test_full_gaps_are_those_of_the_result(part):
    (result,) = results("bands").values()
    full = result.isel(gap=result["gap_direction"].values == "all")
    found = np.array(part.about["results"][0]["gaps"]).reshape(-1, 4)
    np.testing.assert_array_equal(found[:, 0], full["gap_state"])
    np.testing.assert_allclose(found[:, 3] - found[:, 2], full["gap_width"], rtol=1e-3)


def test_a_click_on_a_band_shows_its_mode(opened):
    """The page's nodes are where the Bloch wave of the nearest point puts them, in every cell."""
    tab = opened("bands", reduced_motion="reduce")
    (result,) = results("bands").values()
    phase, band = 2, 2  # at the next one, the corner of the zone, pairs of bands meet
    x, y = evaluate(
        tab,
        f"""const c = p.plots[0]; const curve = c.curves[{band}];
        const box = c.plot.over.getBoundingClientRect();
        return [box.left + c.plot.valToPos(curve.x[{phase}], "x"),
                box.top + c.plot.valToPos(curve.y[{phase}], "y")]""",
    )
    tab.mouse.click(x, y)
    found, at, state = evaluate(tab, "return [p.analysis.band, p.analysis.phase, p.analysis.state]")
    assert (found, at) == (band, phase)
    here = result.isel(state=state, phase=phase, band=band)
    assert f"Band 3, {float(here['frequency']):.4g} Hz" in tab.inner_text(".status")
    cells, positions, rest, scale = evaluate(
        tab,
        """p.phase = 0.7; p.draw(); const [r] = p.results; return [p.about.cells,
        Array.from(r.positions), Array.from(r.sheet.nodes), p.scale * p.analysis.swing(r)]""",
    )
    moved = (np.array(positions) - np.array(rest)).reshape(len(cells), -1, 3) / scale
    shape = here["shape"].transpose("node", "axis").values
    shape = shape / np.linalg.norm(shape, axis=1).max()
    wave = np.array(cells) @ here["wave_vector"].values
    wanted = shape * np.exp(1j * (wave - 0.7))[:, None, None]
    # the mode of an eigenvector may begin at any phase
    angles = np.linspace(0.0, 2.0 * np.pi, 721)
    off = [np.abs((wanted * np.exp(1j * a)).real - moved).max() for a in angles]
    assert min(off) < 0.02
    assert tab.errors == []


def test_the_slider_shows_another_state(opened):
    tab = opened("bands", reduced_motion="reduce")
    (result,) = results("bands").values()
    for state in (0, 1):
        tab.evaluate(f"document.querySelector('.states input').value = {state}")
        tab.dispatch_event(".states input", "input")
        curves = evaluate(tab, "return p.plots[0].curves.map(({ y }) => Array.from(y))")
        own = result["frequency"].isel(state=state).transpose("band", "phase").values
        np.testing.assert_allclose(curves, own, rtol=1e-6, atol=1e-6 * own.max())
        told = tab.inner_text(".states")
        assert told.split() == ["dihedral", f"{result['state'].values[state]}°"]
    assert tab.evaluate(f"{PAGE}.plots.length") >= 4  # bands, attenuation, damping, the zone
    assert tab.errors == []
