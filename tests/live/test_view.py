"""`fd.view`: what it takes, and what it leaves."""

from __future__ import annotations

import html
import re

import numpy as np
import pytest
from live_samples import MIURA, write

import foldyn as fd
from foldyn.live.files import served


@pytest.fixture(scope="module")
def case():
    structure = fd.discretize(fd.patterns.miura(), fd.Sheet(1e6, 0.25, 0.01, 1.0), preset="plate")
    return fd.Case(structure, [fd.Fix("xmin")])


def test_takes_what_has_a_shape(case, tmp_path):
    case_file = fd.read_case(write(tmp_path, MIURA))
    modes = fd.modes(case, 2)
    for what, title in (
        (case, "miura"), (case.structure, "miura"), (case.structure.pattern, "miura"),
        (case_file, "fold"), (modes, "Modes"), ({"a": modes, "b": modes}, "Modes"),
    ):  # fmt: skip
        made = fd.view(what)
        assert made.title == title and repr(made) == f"View(title='{title}', height=820)"
    assert fd.view(case, title="mine", height=400).title == "mine"
    names = [each["name"] for each in fd.view({"a": modes, "b": modes}).stage.about["results"]]
    assert names == ["a 1", "a 2", "b 1", "b 2"]


def test_refuses_what_has_none_and_results_of_several_kinds(case):
    path = fd.trace(case.altered(loads=[fd.Force(7, (1e-6, 0, 0))]), steps=1)
    for what, words in (
        (3, "what: give a result"),
        ({}, "what: give a result"),
        ("case.toml", "what: give a result"),
        ({"a": 3}, r"what\['a'\]"),
        ({"a": fd.modes(case, 1), "b": path}, r"several kinds \(modes, path\)"),
    ):
        with pytest.raises(fd.errors.InputError, match=words):
            fd.view(what)
    with pytest.raises(fd.errors.InputError, match="height = 5"):
        fd.view(case, height=5)


def test_a_frame_holds_the_page_and_nothing_gets_out(case, tmp_path):
    made = fd.view(case, title='a <b> "title"')
    frame = made._repr_html_()
    head, source = re.fullmatch(r'<iframe ([^<>]*) srcdoc="([^"]*)"></iframe>', frame).groups()
    assert 'sandbox="allow-scripts allow-downloads"' in head and "same-origin" not in head
    assert 'title="a &lt;b&gt; &quot;title&quot;"' in head
    assert html.unescape(source) == made.html()
    assert "default-src 'none'" in made.html() and "connect-src" not in made.html()
    assert made.save(tmp_path / "x.html").read_text("utf-8") == made.html()
    with pytest.raises(fd.errors.InputError, match="there is no directory"):
        made.save(tmp_path / "none" / "x.html")


def test_a_folding_has_its_states_and_angles():
    folding = fd.fold(fd.patterns.simple_fold(dihedral=170), 90.0, steps=4)
    made = fd.view(folding).stage
    (result,) = made.about["results"]
    assert made.about["kind"] == "folding"
    assert result["displacement"]["shape"] == [5, 6, 3]
    assert result["fields"]["turn"]["values"]["shape"] == [5, 1]
    assert np.isclose(np.degrees(folding.path["fold_angle"].values[-1, 0]), -90.0, atol=1e-6)


@pytest.mark.matrix
def test_files_that_do_not_go_together_are_refused(tmp_path):
    one = write(tmp_path, MIURA)
    with pytest.raises(fd.errors.InputError, match="FILE: 2 files that are not all results"):
        served([one, one])
    result = tmp_path / "modes.nc"
    fd.save(fd.read_case(one).run(), result)
    with pytest.raises(fd.errors.InputError, match="the same file twice"):
        served([result, result])
    (tmp_path / "other").mkdir()
    other = tmp_path / "other" / "modes.nc"
    other.write_bytes(result.read_bytes())
    server, title = served([result, other])
    server.server_close()
    assert title == f"Modes: {tmp_path.name}/modes, other/modes"


def test_a_port_that_is_taken_is_refused(tmp_path):
    one = write(tmp_path, MIURA)
    first, _ = served([one])
    with first, pytest.raises(fd.errors.InputError, match=r"--port = \d+: .*choose another"):
        served([one], first.server_port)
    with pytest.raises(fd.errors.InputError, match="--port = 70000"):
        served([one], 70000)
