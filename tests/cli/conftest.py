"""The command called in its own folder, and case files that take milliseconds."""

from __future__ import annotations

import base64
import re
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import pytest

from case_texts import FOLD_TEXT, changed
from foldyn.cli.folder import STAMP
from foldyn.cli.main import main
from foldyn.cli.run import DRAWN

ROUGH = re.compile("warning: .*(panels that stretch|lies? above .* of the panels' own frequency)")
MIURA = f"""title = "a Miura unit cell"
{FOLD_TEXT.replace("simple_fold", "miura")}[model]
preset = "plate"
mass = "circumcenter"
[damping]
alpha = 0.0628
[[supports]]
nodes = [0, 1, 2]
axes = "xyz"
[[loads]]
nodes = [7]
force = [0.01, 0, 0]
history = {{ kind = "half_sine", duration = 0.05 }}
[analysis]
kind = "dynamics"
method = "rk4"
duration = 0.1
[output]
interval = 0.01
"""


@dataclass(frozen=True)
class Outcome:
    """What a call of the command left."""

    status: int
    out: str
    err: str
    new: list[str]  # files and folders that were not there before

    def failure(self, *files: str) -> str:
        """Why a run failed that left these files and named them."""
        assert (self.status, {*files}) == (1, {name for name in self.new if name.endswith(".nc")})
        reason, kept = self.err.splitlines()
        assert kept == f"foldyn: kept what was computed: {', '.join(files)}"
        return reason


class Workplace:
    """A folder in which the command is called."""

    def __init__(self, folder: Path, capsys: pytest.CaptureFixture[str]) -> None:
        self.folder = folder
        self.capsys = capsys

    def write(self, content: str | bytes, name: str = "case.toml") -> None:
        raw = content.encode() if isinstance(content, str) else content
        path = self.folder / name
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_bytes(raw)

    def call(self, *arguments: str) -> Outcome:
        before = self.contents()
        self.capsys.readouterr()
        status = main(arguments)
        out, err = self.capsys.readouterr()
        after = self.contents()
        assert {name: after.get(name) for name in before} == before, "a file was changed"
        # that models are rough is told in small examples, whose tests are about something else
        told = "".join(line for line in err.splitlines(True) if not ROUGH.search(line))
        return Outcome(status, out, told, sorted(set(after) - set(before)))

    def good(self, *arguments: str) -> Outcome:
        """Call the command, which neither fails nor warns."""
        done = self.call(*arguments)
        assert (done.status, done.err) == (0, "")
        return done

    def refused(self, *arguments: str) -> str:
        """The one line that a call says of bad input, which leaves nothing."""
        bad = self.call(*arguments)
        assert (bad.status, bad.out, bad.new) == (2, "", []), bad
        (line,) = bad.err.splitlines()
        assert line.startswith("foldyn: ")
        return line.removeprefix("foldyn: ")

    def page(self, *pictures: str, results: Sequence[str] = ("result.nc",)) -> str:
        """The page of a run of case.toml, which holds just these pictures."""
        done = self.good("run", "case.toml", "--out", "r", "--figures", "png")
        drawn = {*pictures, "report.html"}
        assert set(done.new) == {"r", *(f"r/{name}" for name in (*drawn, *results))}
        assert drawn <= set(DRAWN)
        page = Path("r/report.html").read_text(encoding="utf-8")
        for name in pictures:
            assert base64.b64encode(Path("r", name).read_bytes()).decode() in page, name
        return page

    def run(self, content: str | bytes, *arguments: str) -> Outcome:
        """Write case.toml and run it without figures."""
        self.write(content)
        return self.call("run", "case.toml", "--no-figures", *arguments)

    def contents(self) -> dict[str, bytes | None]:
        """All but the stamps of results folders, which have tests of their own."""
        paths = sorted(path for path in self.folder.rglob("*") if path.name != STAMP)
        name = {path: path.relative_to(self.folder).as_posix() for path in paths}
        return {name[p]: p.read_bytes() if p.is_file() else None for p in paths}


@pytest.fixture
def workplace(tmp_path, monkeypatch, capsys) -> Workplace:
    monkeypatch.chdir(tmp_path)
    return Workplace(tmp_path, capsys)


@pytest.fixture
def edited():
    """Function that gives the Miura's case file with keys changed."""
    return lambda edits: changed(MIURA, edits)


@pytest.fixture
def miura() -> str:
    return MIURA
