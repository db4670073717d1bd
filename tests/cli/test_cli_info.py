"""`foldyn info`, `--version`, and command lines that cannot be read."""

from __future__ import annotations

import platform
import re
import sys
import tomllib
from importlib import metadata
from pathlib import Path

import pytest

import foldyn as fd
from foldyn.cli.main import main
from foldyn.formats import FORMATS
from foldyn.linear import METHODS as RESPONSES
from foldyn.structures import MASS_RULES
from foldyn.studies import shipped_cases

ROOT = Path(__file__).resolve().parents[2]


def dependencies() -> set[str]:
    """Names of the packages that Foldyn needs, as the project states them."""
    project = tomllib.loads((ROOT / "pyproject.toml").read_text())["project"]
    return {re.findall(r"^[\w-]+", one)[0] for one in project["dependencies"]}


def test_info(workplace) -> None:
    told = workplace.call("info")
    assert (told.status, told.err, told.new) == (0, "", [])
    lines = told.out.splitlines()
    assert lines[0] == f"foldyn {fd.__version__}"
    assert any(line.startswith(f"python {platform.python_version()}") for line in lines)
    assert {"numpy", "h5py", "tomli-w", "threadpoolctl", "rslab"} <= (needed := dependencies())
    assert all(f"{name} {metadata.version(name)}" in lines for name in needed)
    (here,) = (line.split() for line in lines if line.startswith("processors: "))
    assert int(here[-1]) == min(8, int(here[1].rstrip(";")))  # no more than there are
    assert any(line.startswith("kernels of rk4: ") for line in lines)
    (parts,) = [line for line in lines if line.startswith("optional parts: ")]
    assert parts.startswith("optional parts: ffmpeg for MP4 animations, ")
    free, solver = [line for line in lines if line.startswith("linear solver")]
    assert free.endswith("rslab, found")
    found = fd.statics.SOLVERS["pardiso"].found()
    assert solver.endswith("pardiso, found" if found else "missing: pip install foldyn[mkl]")
    methods = (*fd.statics.METHODS, *RESPONSES)
    for name in (*fd.patterns.GENERATORS, *FORMATS, *MASS_RULES, *methods):
        assert name in told.out
    for name in shipped_cases():
        assert f"  {name}" in lines


def test_info_tells_where_ffmpeg_is_and_how_to_get_it(workplace, monkeypatch) -> None:
    monkeypatch.setattr("shutil.which", lambda name: f"bin/{name}")
    assert "MP4 animations, found: bin/ffmpeg" in workplace.call("info").out
    monkeypatch.setattr("shutil.which", lambda name: None)
    monkeypatch.setitem(sys.modules, "imageio_ffmpeg", None)
    assert "MP4 animations, missing: pip install imageio-ffmpeg" in workplace.call("info").out


def test_version(capsys) -> None:
    with pytest.raises(SystemExit) as left:
        main(["--version"])
    assert left.value.code == 0
    assert capsys.readouterr().out == f"foldyn {fd.__version__}\n"


@pytest.mark.parametrize("arguments", [[], ["run"], ["walk"], ["run", "a.toml", "--fast"]])
def test_a_wrong_command_line_has_status_2(workplace, arguments) -> None:
    before = workplace.contents()
    with pytest.raises(SystemExit) as left:
        main(arguments)
    assert left.value.code == 2
    assert "usage: foldyn" in workplace.capsys.readouterr().err
    assert workplace.contents() == before
