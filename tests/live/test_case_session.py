"""What a page asks of a case file, and what comes back."""

from __future__ import annotations

import base64
import json
import tomllib
import zlib

import numpy as np
import pytest
from live_samples import FOLD, MIURA, write

import foldyn as fd
from foldyn.live import case_session
from foldyn.live.case_session import CaseSession


@pytest.fixture(scope="module")
def session(tmp_path_factory):
    return CaseSession(write(tmp_path_factory.mktemp("case")))


def wish(compute="modes", **numbers):
    numbers = {f"pattern.{name}": value for name, value in numbers.items()}
    return {"numbers": numbers, "compute": compute}


def test_what_it_offers(session, tmp_path):
    assert list(session.about["offers"]) == ["dynamics", "modes", "frf", "statics"]
    alone = CaseSession(write(tmp_path, MIURA))
    assert list(alone.about["offers"]) == ["modes"]  # nothing acts on it
    answer = alone.compute(wish("dynamics"))
    assert 'compute = "dynamics": choose one of modes' in answer["error"]
    json.dumps(session.about, allow_nan=False)


KINDS = {"modes": "modes", "frf": "response", "statics": "path", "dynamics": "motion"}


@pytest.mark.parametrize("kind", KINDS)
def test_computes_every_kind(session, kind):
    answer = session.compute(wish(kind))
    assert "error" not in answer, answer["error"]
    assert answer["about"]["kind"] == KINDS[kind]
    json.dumps(answer, allow_nan=False)
    named = answer["about"]["sheets"]["s0"]["nodes"]
    raw = zlib.decompress(base64.b64decode(answer["arrays"][named]), -15)
    nodes = np.frombuffer(raw, np.uint8).reshape(4, -1).T.copy().view("<f4").reshape(3, -1).T
    assert np.allclose(nodes[:6], fd.patterns.simple_fold(dihedral=90).vertices, atol=1e-6)


@pytest.mark.matrix
def test_a_response_curve_plays_its_motions(tmp_path, monkeypatch):
    head, _ = FOLD.replace('kind = "half_sine", duration', 'kind = "harmonic", frequency').split(
        "[analysis]"
    )
    curve = 'kind = "response"\nfrequencies = [0.3, 0.4]\nharmonics = 1\nlongest_step = 1.0\n'
    own = CaseSession(write(tmp_path, f"{head}[analysis]\n{curve}"))
    assert list(own.about["offers"]) == ["response", "modes", "frf", "statics", "dynamics"]
    answer = own.compute(wish("response"))
    assert answer["about"]["kind"] == "periodic" and answer["about"]["driven"]
    assert not any("in the span" in note for note in answer["notes"])
    for kind in KINDS:
        assert "error" not in own.compute(wish(kind)), kind
    monkeypatch.setattr(case_session, "MOST_FREE", 1)
    assert "with 6 modes instead of all" in own.compute(wish("response"))["notes"][0]


def test_modes_are_those_of_the_changed_case(session, tmp_path):
    answer = session.compute(wish(dihedral=120.0))
    got = [each["frequency"] for each in answer["about"]["results"]]
    path = write(tmp_path, FOLD.replace("dihedral = 90", "dihedral = 120"))
    case = fd.read_case(path).case()
    wanted = fd.modes(fd.Case(case.structure, case.supports), 6)["frequency"].values
    assert np.allclose(got, wanted[: len(got)], rtol=1e-9)


def test_bad_numbers_are_told_and_the_next_good_ones_computed(session):
    answer = session.compute(wish(dihedral=0.0))
    assert "dihedral" in answer["error"] and "must be between 0 and 180" in answer["error"]
    assert "fold.toml" not in answer["error"] and "about" not in answer
    for nonsense in (None, [], {"numbers": 3}, {"compute": "modes"}, wish(compute=None)):
        assert "error" in session.compute(nonsense)
    assert "error" not in session.compute(wish(dihedral=80.0))


def test_a_defect_is_told_as_one(session, monkeypatch):
    def broken(*_):
        raise ZeroDivisionError("division by zero")

    monkeypatch.setattr("foldyn.live.case_session.computed", broken)
    assert "could not be computed (ZeroDivisionError" in session.compute(wish())["error"]


def test_warnings_are_notes(session, monkeypatch):
    monkeypatch.setattr(case_session, "MOST_WORK", 1000.0)
    answer = session.compute(wish("dynamics"))
    (note,) = [note for note in answer["notes"] if "to keep the wait short" in note]
    assert "of 2 s are computed and shown, to keep the wait short" in note
    assert "error" not in answer


def test_saves_the_case_file_with_the_present_numbers(session, tmp_path):
    text = session.case_file(wish(dihedral=100.0))["text"]
    saved, before = tomllib.loads(text), tomllib.loads(FOLD)
    assert saved["pattern"] == {"kind": "simple_fold", "dihedral": 100.0}
    assert {**saved, "pattern": 0} == {**before, "pattern": 0}
    (angle,) = fd.read_case(write(tmp_path, text, "saved.toml")).pattern.dihedrals
    assert angle == pytest.approx(np.radians(260.0))


def test_a_wrong_file_is_refused(tmp_path):
    with pytest.raises(fd.errors.InputError, match=r"pattern.dihedral|dihedral = 500"):
        CaseSession(write(tmp_path, FOLD.replace("dihedral = 90", "dihedral = 500")))


def test_a_curve_has_the_loads_without_their_histories(tmp_path):
    path = write(tmp_path)
    _, result = case_session.computed(path, tomllib.loads(FOLD), "statics")
    assert float(result["load_factor"][-1]) == 1.0
    wanted = fd.trace(fd.case_of(result), steps=case_session.STEPS)
    assert np.allclose(result["displacement"], wanted["displacement"], atol=1e-12)
