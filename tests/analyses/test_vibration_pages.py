"""What the pages of modes and frequency responses say about the numbers."""

from __future__ import annotations

import numpy as np
import pytest

import foldyn as fd
from case_texts import HELD_MIURA_TEXT, PLATE, changed
from foldyn import plots
from foldyn.analyses import read_case
from foldyn.analyses.frf import driven_direction
from foldyn.linear import peaks_of
from foldyn.plots.frf import curves_of
from foldyn.plots.readings import chosen_modes

SHEET = changed(
    HELD_MIURA_TEXT, "pattern.cells = [2, 1]; pattern.dihedral = 90; damping.alpha = 0.5"
)
PUSH = '[[drive]]\nnodes = "xmax"\nforce = [0, 0, 1e-4]\n'


@pytest.fixture
def write(tmp_path, monkeypatch):
    """Function that computes a case file and writes its page without a film."""
    monkeypatch.setattr("foldyn.analyses.modes.FRAMES", 2)

    def write_page(text: str, figures: str | None = "png"):
        file = tmp_path / "case.toml"
        model = "" if "[model]" in text else PLATE
        file.write_text(SHEET + model + text, "utf-8")
        case_file = read_case(file)
        results = {rule: case_file.run(rule) for rule in case_file.masses}
        page = case_file.analysis.page(case_file, results, tmp_path, figures=figures)
        return next(iter(results.values())), page.read_text("utf-8")

    return write_page


def test_modes_about_an_equilibrium(write):
    text = '[[loads]]\ngravity = [0, 0, -1e-3]\n[analysis]\nkind = "modes"\ncount = 2\n'
    found, page = write(text + 'state = "equilibrium"\nsecant = 0.5\n[output]\nnodes = "xmax"\n')
    assert found.attrs["state"] == "equilibrium"
    assert "over the equilibrium under the loads in gray" in page
    assert "of nodes 12, 13, 14, seen along x" in page
    assert "equivalent to an oscillation by 0.5 degrees" in page
    assert "alpha 0.5 1/s and beta 0 s" in page
    assert "no equilibrium" not in page


@pytest.mark.matrix
def test_which_modes_are_shown(write):
    asked = '[analysis]\nkind = "modes"\ncount = 5\nsecant = 1\n[output]\nshapes = [2]\n'
    found, _ = write(asked, figures=None)
    assert chosen_modes(found, 3) == [1, 2, 3]
    assert chosen_modes(found, (4, 2)) == [4, 2]
    found["rigid"][:2] = True
    assert chosen_modes(found, 2) == [3, 4]


@pytest.mark.matrix
def test_a_film_of_a_large_sheet_shows_fewer_modes(write, monkeypatch):
    monkeypatch.setattr("foldyn.analyses.modes.MOST_TRIANGLES", 70)  # 32 in a mode
    _, page = write(
        '[analysis]\nkind = "modes"\ncount = 3\nsecant = 1\n[output]\nanimation = "gif"\n'
    )
    assert "The same modes (the first 2) in motion" in page


@pytest.mark.matrix
def test_the_direction_is_that_of_the_drive_and_nodes_are_told(write):
    grid = "frequencies = { first = 0, last = 2, count = 21 }\n"
    output = f"[output]\nnodes = {list(range(3, 15))}\n"
    found, page = write(PUSH + f'[analysis]\nkind = "frf"\n{grid}secant = 1\n{output}')
    assert driven_direction(found) == "z"
    assert "of nodes 3, 4, 5, 6, 7, 8, 9, 10 (the first 8 of 12) along z" in page
    assert "displacement per newton of driving force, on all driven nodes together" in page
    assert f"Foldyn {fd.__version__}" in page and "alpha 0.5 1/s, beta 0 s" in page


@pytest.mark.matrix
def test_a_drive_backward_is_read_backward(write):
    """The response of a driven point along its drive has a positive real mobility."""
    grid = "frequencies = { first = 0.1, last = 2, count = 39 }\n"
    drive = "[[drive]]\nnodes = 13\nforce = [0, 0, -1]\n"
    found, page = write(drive + f'[analysis]\nkind = "frf"\n{grid}secant = 1\n')
    assert driven_direction(found) == "-z"
    assert "of node 13 along -z" in page
    (curve,), _ = curves_of({"": found}, [13], None, "mobility")
    assert curve.axis == "-z" and (curve.values.real > 0.0).all()
    (curve,), _ = curves_of({"": found}, [13], "z", "mobility")
    assert (curve.values.real < 0.0).all()
    assert peaks_of(found, 13, axis="-z") == peaks_of(found, 13, axis="z") != ()


@pytest.mark.matrix
def test_what_the_picture_marks_is_in_the_table(write):
    """A peak of 1 % of the highest one, which a logarithmic axis shows as well."""
    asked = '[analysis]\nkind = "frf"\nfrequencies = [0.5, 1, 2]\nsecant = 1\n'
    found, _ = write(PUSH + asked, figures=None)
    f = np.linspace(1.0, 10.0, 901)
    curve = sum(
        size / (f0**2 - f**2 + 2j * 0.01 * f0 * f) for size, f0 in ((1.0, 3.0), (0.04, 6.0))
    )
    response = found.isel(frequency=[0] * len(f)).assign_coords(frequency=f)
    response["receptance"][:] = 0.0
    response["receptance"].loc[{"node": 13, "axis": "z"}] = curve
    peaks = peaks_of(response, 13, axis="z")
    assert [round(peak.frequency, 1) for peak in peaks] == [3.0, 6.0]
    assert peaks[1].height < 0.02 * peaks[0].height
    assert peaks[1].damping_ratio == pytest.approx(0.01, rel=0.05)
    figure = plots.plot_frf({"": response}, [13], axes="z")
    marked = [line for line in figure.axes[0].lines if line.get_marker() == "o"]
    assert [round(x, 1) for line in marked for x in line.get_xdata()] == [3.0, 6.0]


@pytest.mark.matrix
def test_numbers_that_are_missing_are_explained(write):
    """A curve that ends above the half-power points tells no damping."""
    only, _ = write('[analysis]\nkind = "modes"\ncount = 1\nsecant = 1\n', figures=None)
    f0 = float(only["frequency"][0])
    lines = [round(share * f0, 6) for share in (0.87, 0.96, 1.05)]
    text = f'[analysis]\nkind = "frf"\nfrequencies = {lines}\nsecant = 1\n[output]\nnodes = 13\n'
    response, page = write(PUSH + text)
    (peak,) = peaks_of(response, 13, axis="z")
    assert np.isnan(peak.damping_ratio) and "circle_fit" in peak.note
    assert "Why numbers are missing from the table:" in page
    assert f"Peak at {peak.frequency:.4g} Hz of node 13" in page
    assert "circle_fit" not in page  # what a programmer would do about it


@pytest.mark.matrix
def test_a_response_that_depends_on_its_amplitude(write):
    grid = "frequencies = { first = 0.1, last = 1, count = 10 }\n"
    found, page = write(
        PUSH + '[model]\npreset = "herkal"\n'
        f'[analysis]\nkind = "frf"\nmethod = "harmonic"\n{grid}amplitude = 2.0\n'
    )
    largest = np.degrees(np.nanmax(found["swing"]))
    assert f"the largest is {largest:.3g} degrees" in page
    assert '<th scope="col" class="number">amplitude</th>' in page
    _, linear = write(PUSH + f'[analysis]\nkind = "frf"\n{grid}secant = 1\n', figures=None)
    assert ">amplitude</th>" not in linear
