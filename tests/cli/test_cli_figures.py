"""The figures and the page that `foldyn run` leaves."""

from __future__ import annotations

import base64
import json
import re
import subprocess
import sys
from html import escape, unescape
from pathlib import Path

import pytest

import foldyn as fd
from case_texts import HELD_MIURA_TEXT
from foldyn.analyses import motion
from foldyn.cli.folder import STAMP
from foldyn.cli.main import main
from foldyn.errors import InputError
from foldyn.plots.writers import find_ffmpeg
from foldyn.report import album
from pairwise import beyond

FEW = "output.interval = 0.02"
PICTURES = ("structure.png", "laws.png", "load.png", "motion.png", "energies.png")


@pytest.mark.matrix
def test_figures_of_a_tiny_case(workplace, edited) -> None:
    output = 'output = { interval = 0.02, nodes = [7], axis = "x", max_frequency = 20.0 }'
    rules = 'model.mass = ["panel", "circumcenter"]'
    workplace.write(edited(f'{rules}; title = "Miura & <co>"; {output}'))
    results = ("result-panel.nc", "result-circumcenter.nc")
    page = workplace.page(*PICTURES, results=results)
    assert page.count("<img ") == len(PICTURES)
    assert "<h1>Miura &amp; &lt;co&gt;</h1>" in page
    for rule in ("panel", "circumcenter"):
        assert f"<td>{rule}</td>" in page
    for told in (
        "youngs modulus 1e+06 Pa; ", "scheme n5b8; mass panel, circumcenter; ",
        "calibration plate", "alpha 0.0628 1/s; beta 0 s; state rest",
        "<td>Fix: nodes ", "history half sine (duration 0.05)",
        "9 vertices, 4 panels, 4 creases, 13 nodes", "in the solver; ", "<td>none</td>",
        f"Foldyn {fd.__version__}</td>",
        "<td>foldyn run case.toml --out r --figures png</td>",
        "<summary>The case file case.toml</summary>",
        escape(Path("case.toml").read_text("utf-8")),
    ):  # fmt: skip
        assert told in page, told


@pytest.mark.matrix
def test_a_film_where_it_is_asked_for(workplace, edited, monkeypatch) -> None:
    """Of three pictures, as films have tests of their own."""
    draw = motion.plots.animate
    monkeypatch.setattr(
        motion.plots, "animate", lambda *of, **how: draw(*of, **how | {"frames": 3})
    )
    workplace.write(edited(FEW))
    done = workplace.good("run", "case.toml", "--out", "r", "--film", "gif")
    assert "r/motion.gif" in done.new
    assert main(["run", "case.toml", "--out", "r", "--quiet"]) == 0
    assert not Path("r/motion.gif").exists()  # it would show the old motion


def test_a_film_instead_of_a_gif(workplace, edited) -> None:
    try:
        find_ffmpeg()
    except InputError:
        pytest.skip("needs ffmpeg or imageio-ffmpeg")
    workplace.write(edited(f'{FEW}; output.animation = "mp4"'))
    done = workplace.good("run", "case.toml", "--out", "r")
    assert "r/motion.mp4" in done.new and "r/motion.gif" not in done.new
    page = Path("r/report.html").read_text(encoding="utf-8")
    assert base64.b64encode(Path("r/motion.mp4").read_bytes()).decode() in page
    assert page.count("<video ") == 1


def test_mp4_without_ffmpeg_is_refused_at_once(workplace, edited, monkeypatch) -> None:
    def missing() -> str:
        raise InputError("MP4 needs ffmpeg: install it")

    monkeypatch.setattr("foldyn.plots.writers.find_ffmpeg", missing)
    workplace.write(edited(f'{FEW}; output.animation = "mp4"'))
    line = workplace.refused("run", "case.toml", "--out", "r")
    assert line.startswith('case.toml: output.animation = "mp4": MP4 needs ffmpeg')
    assert workplace.call("run", "case.toml", "--out", "r", "--no-figures").status == 0


@pytest.mark.matrix
def test_figures_of_many_nodes_and_no_load(workplace, monkeypatch) -> None:
    """A sheet without loads shows some of its vertices, not hundreds of rows."""
    shown = []
    monkeypatch.setattr(motion.plots, "animate", lambda *_, **__: Path("r/structure.png"))
    draw = motion.plots.plot_history

    def drawn(result, nodes, **options):
        shown.extend(nodes)
        return draw(result, nodes, **options)

    monkeypatch.setattr(motion.plots, "plot_history", drawn)
    large = HELD_MIURA_TEXT.replace('"miura"', '"miura"\ncells = [2, 2]')
    brief = '[analysis]\nkind = "dynamics"\nduration = 0.01\n[output]\ninterval = 0.001\n'
    workplace.write(large + brief)
    workplace.good("run", "case.toml", "--out", "r", "--figures", "png")
    assert len(shown) == album.MOST_NODES
    page = Path("r/report.html").read_text(encoding="utf-8")
    assert f"the first {album.MOST_NODES} of 20" in page
    assert not Path("r/load.png").exists()


@pytest.mark.matrix
def test_a_page_without_figures(workplace, edited) -> None:
    """It has what they show, as charts of the page; libraries it does without are not loaded."""
    workplace.write(edited(FEW))
    code = "import sys; from foldyn.cli.main import main; status = main(sys.argv[1:]); "
    code += "unused = {'matplotlib', 'shapely', 'scipy.spatial'} & set(sys.modules); "
    code += "sys.exit(status or 10 * len(unused))"
    assert subprocess.call([sys.executable, "-c", code, "run", "case.toml", "--quiet"]) == 0
    folder = Path("case-results")
    assert {path.name for path in folder.iterdir()} == {STAMP, "report.html", "result.nc"}
    page = (folder / "report.html").read_text(encoding="utf-8")
    assert page.count("data-foldyn=") == 1 and "<img " not in page
    plots = [json.loads(unescape(text)) for text in re.findall(r'data-plot="(.*?)"', page)]
    titles = [plot["title"].split(":")[0] for plot in plots]
    assert titles == ["folds", "bends", "bars", ""]
    load = plots[-1]["curves"][0]
    assert max(load["y"]) == pytest.approx(0.01, rel=1e-3)
    assert "The structure" in page and "The motion" in page


@pytest.mark.parametrize("form", beyond(["svg", "pdf"]))
def test_figures_for_a_paper_stand_beside_the_page(workplace, edited, form) -> None:
    workplace.write(edited(FEW))
    done = workplace.good("run", "case.toml", "--out", "r", "--figures", form)
    names = [name.replace("png", form) for name in PICTURES]
    assert set(done.new) == {"r", *(f"r/{name}" for name in (*names, "result.nc", "report.html"))}
    page = Path("r/report.html").read_text(encoding="utf-8")
    assert "<img " not in page and "data-plot=" in page
    assert main(["run", "case.toml", "--out", "r", "--quiet"]) == 0
    assert not list(Path("r").glob(f"*.{form}"))  # they would show the old motion


def test_figures_and_none_are_refused(workplace, edited) -> None:
    workplace.write(edited(""))
    line = workplace.refused("run", "case.toml", "--figures", "png", "--no-figures")
    assert "--figures: draws figures; leave out --no-figures" in line
