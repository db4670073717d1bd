"""No kernel that was made from other sources is ever run."""

from __future__ import annotations

import ast
import inspect
import re
import subprocess
import sys
from functools import cache
from importlib import import_module
from pathlib import Path

import pytest
from jit_lab import ask, copy_package, edit, environment

from foldyn.jit import sources
from foldyn.jit.kernel_cache import Kept
from foldyn.jit.sources import PACKAGE, digest, imports, made_from, read
from pairwise import beyond

FILES = [  # kernels for GPUs are not kept, and import what is optional
    path for path in sorted(PACKAGE.rglob("*.py")) if path.parent.name != "gpu"
]
HALF_SINE = ("s = math.sin(math.pi * t / duration)", "s = 3.0 * math.sin(math.pi * t / duration)")
LAW = ("def moment(turn):", "def moment(turn):\n    return 7.0\n\n\ndef was(turn):")


@cache
def tree(path: Path) -> ast.Module:
    return ast.parse(path.read_text("utf-8"))


@pytest.mark.matrix
def test_kernels_follow_the_sources_of_what_they_call(tmp_path):
    """And no message, which compiles nothing anew."""
    package = copy_package(tmp_path)
    where = {"NUMBA_CACHE_DIR": str(tmp_path / "kept")}
    assert ask(package, **where) == (1.0, 1.0, 0)
    for path, old in {
        "cases/waveforms.py": '"""',
        "cases/histories.py": 'f"',
        "materials/superlinear.py": '"""',
        "errors.py": '"""',
    }.items():
        text = (package / path).read_text("utf-8")
        if old == 'f"':
            edit(package / path, old, old + " ")
        else:
            edit(package / path, text, "\n" + text)
    assert ask(package, **where) == (1.0, 1.0, 1)
    edit(package / "cases" / "histories.py", *HALF_SINE)
    edit(package / "materials" / "superlinear.py", *LAW)
    assert ask(package, **where) == (3.0, 7.0, 0)
    edit(package / "cases" / "histories.py", *HALF_SINE[::-1])
    edit(package / "materials" / "superlinear.py", *LAW[::-1])
    assert ask(package, **where) == (1.0, 1.0, 1)  # both versions stay side by side


def files_of(path: str, name: str) -> set[str]:
    return {found.relative_to(PACKAGE).as_posix() for found, _ in made_from(PACKAGE / path, name)}


def test_what_a_kernel_is_made_from():
    law, switch, fields = "materials/superlinear.py", "materials/switch.py", "mechanics/model.py"
    assert {law, switch, "jit/compiled.py"} <= files_of("mechanics/plates.py", "_forces")
    assert {law, switch, fields} <= files_of("mechanics/bars_hinges.py", "_forces")
    assert "cases/histories.py" in files_of("dynamics/parts.py", "histories")
    # a loop holds none of what it calls by address
    loop = files_of("dynamics/runge_kutta.py", "advance")
    assert not {law, switch, "mechanics/force.py", "cases/histories.py"} & loop
    # and not from what only tells or draws, which would compile all anew with every change
    others = {"cases/document.py", "cases/case.py", "dynamics/driver.py", "mechanics/plates.py"}
    assert not others & loop
    assert "dynamics/runge_kutta.py" not in files_of("mechanics/force.py", "internal_force")


def written(folder, texts):
    """Write files by their names."""
    for name, text in texts.items():
        (folder / name).parent.mkdir(parents=True, exist_ok=True)
        (folder / name).write_text(text, "utf-8")


def clear_sources():
    """Forget what was read of files."""
    for found in vars(sources).values():
        if hasattr(found, "cache_clear"):
            found.cache_clear()


def kernels():
    """All compiled functions of the package: their files and names, and the functions."""
    for path in FILES:
        if "@" in (text := path.read_text("utf-8")) and ("jit" in text or "term import" in text):
            parts = path.relative_to(PACKAGE.parent).with_suffix("").parts
            for value in list(vars(import_module(".".join(parts))).values()):
                found = getattr(value, "_dispatcher", value)
                if isinstance(getattr(found, "_cache", None), Kept):
                    yield found._cache._source, found.py_func


@pytest.mark.matrix
def test_a_kernel_is_made_from_all_that_it_names():
    for source, function in kernels():
        made = made_from(*source)
        for name in {*function.__code__.co_names} & function.__globals__.keys():
            named = function.__globals__[name]
            named = getattr(named, "_dispatcher", named)
            if isinstance(getattr(named, "_cache", None), Kept):
                assert named._cache._source in made, (source, name)
            elif isinstance(named, type) and named.__module__.startswith("foldyn."):
                path = Path(inspect.getfile(named)).resolve()
                assert (path, named.__name__) in made or path.parent == PACKAGE / "jit", name


def test_no_kernel_is_made_from_what_tells_reads_or_draws():
    """So changes there compile nothing anew."""
    parts = set().union(*(made_from(*source) for source, _ in kernels()))
    places = {path.relative_to(PACKAGE) for path, _ in parts}
    told = {"analyses", "cli", "exports", "formats", "plots", "report", "results", "viewer"}
    assert not told & {place.parts[0] for place in places}
    others = [PACKAGE / place for place in places if place.parts[0] in ("algebra", "cases")]
    with_kernels = re.compile(r"from foldyn\.(jit\.compiled|mechanics\.term) import")
    assert all(with_kernels.search(path.read_text("utf-8")) for path in others)


@pytest.fixture
def package(monkeypatch, tmp_path):
    """A package with a kernel `total`; makes a digest of it after some files were written."""
    monkeypatch.setattr(sources, "PACKAGE", tmp_path)
    monkeypatch.setattr(sources, "_COMPILING", tmp_path / "jit")
    files = {
        "kernels.py": (
            "from foldyn.jit.compiled import kernel\n"
            "from foldyn.values import SCALE, other\n\n\n"
            "def told(x):\n    raise ValueError('a message')\n\n\n"
            "@kernel\ndef general(x):\n    return 3.0 * x\n\n\n"
            "@kernel\ndef total(x):\n    return SCALE * general(x) + A\n\n\n"
            "@kernel\ndef alone(x):\n    return x\n\n\n"
            "A, B = 1.0, 2.0\n"
        ),
        "values.py": "SCALE = FACTOR * 2.0\nFACTOR = 3.0\n\n\ndef other():\n    return 'said'\n",
        "jit/compiled.py": "def kernel(function):\n    return function\n",
    }

    def digest_of(name, path="kernels.py", old="", new=""):
        texts = dict(files)
        assert old in texts[path]
        texts[path] = texts[path].replace(old, new) if old else texts[path]
        written(tmp_path, texts)
        clear_sources()
        return digest(tmp_path / "kernels.py", name)

    yield digest_of
    clear_sources()


@pytest.mark.parametrize(
    ("path", "old", "new", "same"),
    [
        ("kernels.py", "SCALE *", "SCALE +", False),
        ("kernels.py", "3.0 * x", "4.0 * x", False),  # a function that it calls
        ("kernels.py", "A, B = 1.0", "A, B = 5.0", False),
        ("values.py", "FACTOR = 3.0", "FACTOR = 4.0", False),
        ("values.py", "'said'\n", "'said'\n\n\nif TYPE_CHECKING:\n    import this\n", True),
        ("jit/compiled.py", "return function", "return None", False),
        ("kernels.py", "a message", "another\\n message", True),
        ("kernels.py", "def told", "\n\ndef told", True),  # lines above do not matter
        ("kernels.py", "return x\n", "return 2.0 * x\n", True),
        ("values.py", "said", "told", True),
    ],
)
def test_a_kernel_depends_on_what_it_names(package, path, old, new, same):
    before = package("total")
    assert (package("total", path, old, new) == before) == same
    assert package("alone") != before


@pytest.mark.matrix
def test_imports_are_read_as_python_reads_them():
    for path in FILES:
        wanted = set()
        for node in ast.walk(tree(path)):
            if isinstance(node, ast.ImportFrom):
                assert node.level == 0, f"{path}: a relative import"
                if (node.module or "").partition(".")[0] == "foldyn":
                    wanted |= {(node.module, name.name) for name in node.names}
            elif isinstance(node, ast.Import):
                wanted |= {(name.name, "") for name in node.names if name.name[:6] == "foldyn"}
        found = {(module, name) for module, name, _ in imports(path.read_text("utf-8"))}
        assert wanted <= found, path


def test_names_that_a_package_passes_on_lead_to_their_files(monkeypatch, tmp_path):
    written(
        tmp_path,
        {
            "__init__.py": "",
            "kernels.py": "from foldyn.laws import law\nfrom foldyn import tools\n",
            "laws/__init__.py": "from foldyn.laws.one import law, o\nfrom foldyn.laws.two import b",
            "laws/one.py": "from foldyn.values import (\n    A,  # the first\n    B,\n)\n",
            "laws/two.py": "",
            "values.py": "",
            "tools/__init__.py": "",
            "tools/deep/more.py": "",
        },
    )
    monkeypatch.setattr(sources, "PACKAGE", tmp_path)
    monkeypatch.setattr(sources, "_home", sources._home.__wrapped__)
    monkeypatch.setattr(sources, "_READ", set())
    read(tmp_path / "kernels.py")
    found = {path.relative_to(tmp_path).as_posix() for path in sources._READ}
    wanted = {"kernels.py", "laws/one.py", "values.py", "tools/__init__.py", "tools/deep/more.py"}
    assert found == wanted


TOOLS = [(module, "__version__", "0.1") for module in (sources.numba, sources.np, sources.llvmlite)]
READER = sources.config._env_reloader


@pytest.mark.parametrize(
    ("owner", "name", "value", "counts"),
    [
        *((*tool, True) for tool in TOOLS),
        (READER, "old_environ", READER.old_environ | {"NUMBA_OPT": "other"}, True),
        (READER, "old_environ", READER.old_environ | {"NUMBA_CACHE_DIR": "other"}, False),
        (READER, "old_environ", READER.old_environ | {"NUMBA_ENABLE_CUDASIM": "1"}, False),
    ],
)
def test_tools_and_their_variables_count(owner, name, value, counts, monkeypatch):
    source = PACKAGE / "mechanics/force.py", "internal_force"
    before = digest.__wrapped__(*source)
    monkeypatch.setattr(owner, name, value)
    monkeypatch.setattr(sources, "_tools", sources._tools.__wrapped__)
    assert (digest.__wrapped__(*source) != before) == counts


@pytest.mark.matrix
def test_all_that_compiles_is_compiled_in_one_place():
    decorators = {"jit", "njit", "cfunc", "vectorize", "guvectorize", "stencil", "prange"}
    for path in FILES:
        if path.relative_to(PACKAGE).as_posix() == "jit/compiled.py":
            continue
        for node in ast.walk(tree(path)):
            if isinstance(node, ast.ImportFrom) and (node.module or "").startswith("numba"):
                assert not decorators & {name.name for name in node.names}, path
            elif isinstance(node, ast.Import):
                whole = [name.name for name in node.names if name.name.startswith("numba")]
                assert not whole or path.parent == PACKAGE / "jit", path


BOTH = """
import sys
import numpy as np
from foldyn.jit.compiled import kernel
from foldyn.probes.sums import total
kinds = [np.float64, np.int64]
turn = int(sys.argv[1])
for kind in kinds[turn:] + kinds[:turn]:
    assert total(np.arange(5, dtype=kind)) == 10
"""


@pytest.mark.matrix
def test_processes_that_compile_the_same_at_once(tmp_path):
    package = copy_package(tmp_path)
    (package / "probes" / "sums.py").write_text(
        "from foldyn.jit.compiled import kernel\n\n@kernel\ndef total(x):\n    return x.sum()\n"
    )
    where = environment(package, NUMBA_CACHE_DIR=str(tmp_path / "kept"))
    processes = [
        subprocess.Popen([sys.executable, "-c", BOTH, str(turn)], env=where) for turn in range(2)
    ]
    assert [process.wait() for process in processes] == [0, 0]
    files = [path for path in (tmp_path / "kept").rglob("*") if path.is_file()]
    assert len(files) == 2 and all(path.suffix == ".nbc" for path in files)


RUN = """
import functools, hashlib, sys
import numpy as np, foldyn as fd
sheet = fd.Sheet(youngs_modulus=1e6, poissons_ratio=0.25, thickness=0.01, density=1.0)
pattern = fd.patterns.miura(cells=(1, 1), a=1.0, b=1.0, panel_angle=60, dihedral=60)
for word in sys.argv[1:]:
    kind, method, law = word.split("-")
    model = fd.discretize if kind == "bars" else functools.partial(fd.shell, divisions=2)
    push = fd.Force(nodes=[7], vector=(0.01, 0.0, 0.0), history=fd.HalfSine(duration=0.1))
    held = fd.Fix(nodes=[0, 1, 2], axes="xyz")
    case = fd.Case(model(pattern, sheet, fold_law=law), supports=[held], loads=[push])
    found = hashlib.sha256()
    if method == "forces":
        values = {"force": case.body.internal(np.linspace(0.0, 0.01, case.body.size))}
    else:
        motion = fd.simulate(case, duration=0.2, method=method)
        values = {name: motion[name].values for name in ("displacement", *sorted(motion.data_vars))}
    for array in values.values():
        found.update(np.ascontiguousarray(array).tobytes())
    print(word, found.hexdigest(), float(abs([*values.values()][0]).max()))
"""


def results(package: Path, *words: str, **variables: str) -> dict[str, tuple[str, float]]:
    """Digest and largest value of motions, or of forces, by their words."""
    command = [sys.executable, "-c", RUN, *words]
    where = environment(package, **variables)
    said = subprocess.run(command, env=where, capture_output=True, text=True, check=True).stdout
    lines = [line.split() for line in said.splitlines()]
    return {word: (bits, float(largest)) for word, bits, largest in lines}


@pytest.mark.parametrize("last", beyond(["bars-forces-enhanced", "bars-rk4-enhanced"]))
def test_compiled_and_loaded_kernels_give_the_same_bits(tmp_path, last):
    """Alone in its process, or after others."""
    package = copy_package(tmp_path, kernels=True)
    before = "bars-dormand_prince-enhanced"
    loaded = results(package, before, last)
    kept = str(tmp_path / "kept")
    assert results(package, last, NUMBA_CACHE_DIR=kept)[last] == loaded[last]


@pytest.mark.matrix
def test_motions_follow_histories_and_shells_follow_laws(tmp_path):
    package = copy_package(tmp_path, kernels=True)
    bars, shell = "bars-rk4-linear", "shell-forces-linear"
    before = results(package, bars, shell)
    edit(package / "cases" / "histories.py", *HALF_SINE)
    assert results(package, bars)[bars][1] > 2.0 * before[bars][1]
    edit(package / "materials" / "linear.py", "    return turn\n", "    return 1.2 * turn\n")
    assert results(package, shell)[shell][1] != before[shell][1]
