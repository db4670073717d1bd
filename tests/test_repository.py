"""What must hold of the repository as a whole."""

from __future__ import annotations

import re
import runpy
import shutil
import subprocess
import sys
from importlib import import_module
from itertools import product
from pathlib import Path

import pytest

import foldyn as fd
from pairwise import in_pairs

ROOT = Path(__file__).resolve().parents[1]
SOURCES = sorted((ROOT / "src").glob("**/*.py"))
MOST_LINES = 550

# a home folder, a workplace, a temporary folder: of one machine, not of the project
MACHINE_PATHS = re.compile(
    r"(?:/root|/home/\w+|/Users/\w+|/work|/mnt/\w+|/opt/\w+|/tmp|C:\\Users)/"
)
TEXT = {".py", ".md", ".toml", ".cff", ".yaml", ".yml", ".lock", ".txt", ".cfg", ".json", ""}


def tracked_files() -> list[Path]:
    if not (ROOT / ".git").exists() or shutil.which("git") is None:
        pytest.skip("not a git checkout")
    command = ["git", "ls-files", "--cached", "--others", "--exclude-standard", "-z"]
    listing = subprocess.run(command, cwd=ROOT, check=True, capture_output=True, text=True).stdout
    return [ROOT / name for name in listing.split("\0") if name and (ROOT / name).is_file()]


@pytest.mark.matrix
def test_layers_contract():
    script = Path(sys.executable).with_name("lint-imports")
    if not script.exists():
        pytest.skip("needs import-linter")
    command = [script, "--no-cache"]
    done = subprocess.run(command, cwd=ROOT, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stdout + done.stderr


def test_files_stay_short():
    sizes = {path.relative_to(ROOT): len(path.read_text("utf-8").splitlines()) for path in SOURCES}
    assert not {path: size for path, size in sizes.items() if size > MOST_LINES}


def test_no_paths_of_a_machine():
    found = []
    for path in tracked_files():
        if path.suffix not in TEXT or path == Path(__file__).resolve():
            continue
        for number, line in enumerate(path.read_text("utf-8").splitlines(), 1):
            if MACHINE_PATHS.search(line):
                found.append(f"{path.relative_to(ROOT)}:{number}: {line.strip()[:80]}")
    assert not found, "\n".join(found)


def test_lock_names_versions_only():
    lines = (ROOT / "requirements.lock").read_text("utf-8").splitlines()
    pins = [line for line in lines if line and not line.lstrip().startswith("#")]
    assert len(pins) > 50
    assert [line for line in pins if not re.match(r"^[a-z0-9-]+==[\w.]+( ;.*)?$", line)] == []


def test_shipped_cases_are_in_the_package():
    names = {path.name for path in (ROOT / "src/foldyn/studies/herkal/cases").glob("*.toml")}
    assert {"case1.toml", "case2.toml", "case3.toml", "case4.toml"} <= names


@pytest.mark.parametrize(
    ("page", "registry"),
    [
        ("patterns.md", "patterns.GENERATORS"),
        ("laws.md", "materials.BAR_LAWS"),
        ("laws.md", "materials.HINGE_LAWS"),
        ("mass.md", "structures.MASS_RULES"),
        ("integrators.md", "dynamics.METHODS"),
        ("statics.md", "statics.METHODS"),
        ("statics.md", "statics.SOLVERS"),
        ("pattern-files.md", "formats.FORMATS"),
        ("loads.md", "cases.HISTORIES"),
    ],
)
def test_every_registry_row_has_a_docs_row(page, registry):
    module, name = registry.split(".")
    registry = getattr(import_module(f"foldyn.{module}"), name)
    text = (ROOT / "docs" / page).read_text("utf-8")
    rows = [line.split("|")[1] for line in text.splitlines() if line.startswith("| `")]
    missing = [key for key in registry if f"`{key}`" not in "".join(rows)]
    assert not missing, f"docs/{page} has no row for {missing}"


def test_every_top_level_name_is_in_the_api_page():
    text = (ROOT / "docs/api.md").read_text("utf-8")
    public = [name for name in fd.__all__ if not name.startswith("_")]
    missing = [name for name in public if not re.search(rf"\b{name}\b", text)]
    assert not missing, f"docs/api.md does not show {missing}"


@pytest.mark.matrix
def test_no_module_imports_itself_by_way_of_others():
    """Circles of imports, in functions and for type checkers included."""
    grimp = pytest.importorskip("grimp")  # comes with import-linter
    graph = grimp.build_graph("foldyn")
    left = {module: graph.find_modules_directly_imported_by(module) for module in graph.modules}
    while free := [module for module, imported in left.items() if not imported & left.keys()]:
        for module in free:
            del left[module]
    assert not left, sorted(left)


def test_lines_of_code_are_neither_blank_nor_comments_nor_docstrings(tmp_path):
    file = tmp_path / "some.py"
    file.write_text(
        '"""A\n\nB."""\n\nx = """a\n\nb"""  # c\n# d\ndef f():\n    """F."""\n    return x\n'
    )
    assert runpy.run_path(str(ROOT / "tools/size.py"))["code_lines"](file) == 5


def test_a_few_of_a_product_hold_each_pair():
    options = "abcd", {"x": 0, "y": 0}, [1, 2, 3]
    few = [row.values for row in in_pairs(*options) if not row.marks]
    assert len(few) == 12
    for i, j in ((0, 1), (0, 2), (1, 2)):
        assert {(row[i], row[j]) for row in few} == {*product(options[i], options[j])}
