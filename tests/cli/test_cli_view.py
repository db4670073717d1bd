"""`foldyn view` as a process: its address, its end, what it refuses."""

from __future__ import annotations

import re
import signal
import urllib.request

import pytest
from processes import ended, start

import foldyn as fd


@pytest.fixture
def pattern(tmp_path):
    fd.write_pattern(fd.patterns.simple_fold(), tmp_path / "fold.fold")
    return tmp_path


@pytest.mark.matrix
def test_it_serves_the_page_until_it_is_ended(pattern):
    process = start(pattern, "view", "fold.fold", "--no-browser")
    assert process.stdout is not None
    address = process.stdout.readline().strip()
    assert re.fullmatch(r"http://127\.0\.0\.1:\d+/[\w-]{20,}", address)
    # by the same reader: what its buffer holds is lost to `ended`
    assert "until Ctrl-C" in process.stdout.readline()
    with urllib.request.urlopen(address, timeout=20) as page:
        assert b"data-foldyn" in page.read()
    process.send_signal(signal.SIGTERM)
    status, _, err = ended(process)
    assert (status, err) == (143, "foldyn: interrupted\n")


def test_quiet_prints_the_address_alone(pattern, workplace, monkeypatch):
    """Until Ctrl-C, which is no failure."""
    serving = "socketserver.BaseServer.serve_forever"
    monkeypatch.setattr(serving, lambda *_: signal.raise_signal(signal.SIGINT))
    done = workplace.good("view", "fold.fold", "--no-browser", "--quiet")
    (address,) = done.out.splitlines()
    assert address.startswith("http://127.0.0.1:")


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (["none.toml"], "none.toml: there is no such file"),
        (["fold.fold", "fold.fold"], "FILE: 2 files that are not all results"),
        (["fold.fold", "--port", "70000"], "--port = 70000"),
        (["bad.toml"], "bad.toml: is not valid TOML"),
        (["text.xyz"], "text.xyz"),
    ],
)
def test_what_cannot_be_shown_is_refused(pattern, workplace, arguments, words):
    (pattern / "bad.toml").write_text("a = [", "utf-8")
    (pattern / "text.xyz").write_text("1 2 3", "utf-8")
    assert words in workplace.refused("view", "--no-browser", *arguments)
