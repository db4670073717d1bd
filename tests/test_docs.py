"""What the documentation shows works, and every key of a case file is described."""

from __future__ import annotations

import io
import re
import runpy
import shutil
import tomllib
from contextlib import redirect_stdout
from inspect import signature
from pathlib import Path

import numpy as np
import pytest

import features
import foldyn as fd
from foldyn.analyses import ANALYSES, read_case
from foldyn.cases import LOADS, SUPPORTS, BaseMotion, Force, Table
from foldyn.cases.decode import law_from, laws_from
from foldyn.cli.main import main
from foldyn.tables import keys, table_under
from named_models import named
from pairwise import FEW

DOCS = Path(__file__).resolve().parents[1] / "docs"


def blocks(page: str, language: str) -> list[str]:
    text = (DOCS / page).read_text("utf-8")
    return re.findall(rf"^```{language}\n(.*?)^```$", text, re.M | re.S)


def executed(*codes: str, **names) -> dict:
    """What Python blocks define."""
    for code in codes:
        exec(compile(code, "a page", "exec"), names)
    return names


def case_of_page(folder: Path, text: str):
    """A case file of a page, read."""
    (folder / "case.toml").write_text(text, "utf-8")
    return read_case(folder / "case.toml")


def without_loads() -> str:
    """The case file of the page on them, with one mass rule, up to its loads."""
    page = blocks("case-file.md", "toml")[0].partition("[[loads]]")[0]
    return page.replace('mass = ["circumcenter", "consistent"]\n', "")


@pytest.mark.matrix
def test_page_on_nonlinear_vibration_shows_what_it_says(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    codes = blocks("nonlinear-vibration.md", "python")
    names = executed(*(code.replace("(1e-4, 0.04)", "(1e-4, 0.01)") for code in codes))
    assert names["folds"].frequency.values == pytest.approx([0.6321, 0.6273], abs=1e-4)
    assert names["curve"].attrs["complete"] == 1
    assert names["one"].stable


@pytest.fixture(scope="module")
def tutorial(tmp_path_factory):
    """The names that the tutorial makes, what it prints, and its folder."""
    folder = tmp_path_factory.mktemp("tutorial")
    shutil.copy(DOCS.parent / "examples" / "patterns" / "miura.fold", folder)
    printed = io.StringIO()
    with pytest.MonkeyPatch.context() as patch, redirect_stdout(printed):
        patch.chdir(folder)
        names = executed(*blocks("tutorial.md", "python"))
    return names, printed.getvalue(), folder


@pytest.mark.matrix
def test_the_tutorial_prints_what_it_shows(tutorial):
    _, printed, folder = tutorial
    page = (DOCS / "tutorial.md").read_text("utf-8")
    for line in printed.splitlines():
        assert f"```\n{line}\n```" in page
    assert all((folder / f"{name}.pdf").stat().st_size > 1000 for name in ("modes", "tip"))


@pytest.mark.matrix
def test_the_case_file_of_the_tutorial_is_its_python_case(tutorial):
    names, _, folder = tutorial
    (block,) = blocks("tutorial.md", "toml")
    (folder / "sheet.toml").write_text(block, "utf-8")
    assert main(["run", str(folder / "sheet.toml"), "--out", str(folder / "out")]) == 0
    found = fd.load(folder / "out" / "result.nc")
    np.testing.assert_array_equal(found.time, names["motion"].time)
    size = float(abs(names["motion"].displacement).max())
    np.testing.assert_allclose(
        found.displacement, names["motion"].displacement, rtol=0, atol=1e-12 * size
    )


@pytest.mark.matrix
def test_the_error_that_the_tutorial_states(tutorial):
    worst = float(abs(fd.fidelity(tutorial[0]["case"], count=4).result.error[:, 0]).max())
    page = (DOCS / "tutorial.md").read_text("utf-8")
    assert f"within {100 * worst:.1f} % in all four modes" in page


def test_the_quantities_of_the_results_page_can_be_sampled():
    pattern = fd.patterns.miura(cells=(1, 1), a=1.0, b=1.0, panel_angle=60, dihedral=60)
    structure = fd.discretize(pattern, fd.Sheet(1e6, 0.25, 0.01, 1.0), preset="plate")
    case = fd.Case(structure, loads=[fd.Force([6, 7, 8], (0.01, 0.0, 0.0))])
    (block,) = (b for b in blocks("results.md", "python") if "sample=" in b)
    motion = executed(block, fd=fd, np=np, case=case)["trajectory"]
    assert motion["opening"].dims == ("time",) and motion["opening"].attrs["units"] == "m"
    assert motion["momentum"].dims == ("time", "node", "axis")
    impulse = motion["momentum"].sum("node").sel(axis="x").values
    np.testing.assert_allclose(impulse, 0.03 * motion["time"], rtol=1e-9, atol=1e-15)


def test_the_case_file_page_shows_a_case_file(tmp_path):
    page, moving, actuated, *_ = blocks("case-file.md", "toml")
    assert case_of_page(tmp_path, page).masses == ["circumcenter", "consistent"]
    rest = re.sub(r"^\[\[(supports|loads)\]\]\n(.+\n)*", "", page, flags=re.M)
    case = case_of_page(tmp_path, rest + moving + actuated).case()
    assert len(case.supports) == 3
    assert case.imposed.sum() == 2
    assert len(case.base_terms) == 1
    assert len(case.actuated_creases) == len(case.structure.folds)


def test_the_patterns_page_shows_every_generator_by_calls_that_run():
    page = (DOCS / "patterns.md").read_text("utf-8")
    calls = "".join(blocks("patterns.md", "python"))
    for kind in fd.patterns.GENERATORS:
        assert f"fd.patterns.{kind}(" in calls
        picture = f"images/pattern-{kind.replace('_', '-')}.png"
        assert f"({picture})" in page
        assert (DOCS / picture).stat().st_size < 150_000
    names = executed(calls)
    assert len(names["links"]) == 14
    assert names["structure"].options.crease_stiffness == {"zigzag": 0.1, "straight": 0.3}


def test_the_patterns_page_names_the_arguments_and_families_of_every_generator():
    page = (DOCS / "patterns.md").read_text("utf-8")
    for kind, make in fd.patterns.GENERATORS.items():
        ((arguments, families),) = re.findall(rf"^\| `{kind}` \| (.*) \| (.*) \|$", page, re.M)
        assert re.findall(r"`(\w+)`", arguments) == list(signature(make).parameters)
        pattern = make(storeys=2) if kind == "kresling" else make()
        assert set(re.findall(r'"(\w+)"', families)) <= set(pattern.families)


def test_the_loads_page_shows_a_case_that_can_be_made_and_creases_that_are_actuated():
    block, actuated, *_ = blocks("loads.md", "python")
    names = executed(block)
    assert len(names["case"].following_terms) == 2
    assert executed(actuated, **names)["path"].attrs["status"] == "complete"
    listed = (DOCS / "loads.md").read_text("utf-8")
    assert all(f"`fd.{kind.__name__}(" in listed for kind in LOADS)


def test_the_buckling_page_gives_eulers_loads_and_ten_more(capsys):
    names = executed(*blocks("buckling.md", "python"))
    assert names["found"].load_factor.values == pytest.approx([0.822, 3.29, 7.40], rel=0.03)
    printed = [float(word) for word in re.findall(r"[\d.]+", capsys.readouterr().out)]
    assert printed[3] - printed[0] == pytest.approx(10.0, rel=1e-3)
    assert printed[-1] == pytest.approx(printed[0], rel=1e-3)


def test_the_laws_page_shows_one_model_in_python_and_in_a_case_file():
    python, toml = blocks("laws.md", "python"), blocks("laws.md", "toml")
    first, second = (tomllib.loads(block)["model"]["fold_law"] for block in toml)
    assert law_from(first, fd.materials.HINGE_LAWS) == executed(python[0])["law"]
    laws = executed("\n".join(python))["laws"]
    assert laws_from(second, fd.materials.HINGE_LAWS) == laws


def test_the_path_of_the_case_file_page_can_be_followed(tmp_path):
    *_, slow, _, _ = blocks("case-file.md", "toml")
    case_file = case_of_page(tmp_path, without_loads() + slow)
    path = fd.trace(case_file.case(), **case_file.analysis.arguments)
    moved = path.displacement.sel(node=7, axis="x").values
    assert moved[-1] >= 0.02 > moved[-2]  # until
    assert case_file.output.shapes == (0, -1)


@pytest.mark.matrix
def test_the_response_of_the_case_file_page_can_be_computed(tmp_path):
    *_, shaken, _ = blocks("case-file.md", "toml")
    case_file = case_of_page(tmp_path, without_loads() + shaken)
    response = fd.linear.frf(case_file.case(), **case_file.analysis.arguments)
    (drive,) = case_file.analysis.arguments["drive"]
    assert response.attrs["drive_force"] == pytest.approx(0.001 * 3)  # on three vertices
    assert drive.nodes == "xmax"
    assert case_file.output.quantity == "mobility"


@pytest.mark.matrix
def test_the_bands_of_the_case_file_page_are_those_of_its_states(tmp_path):
    *_, repeated = blocks("case-file.md", "toml")
    bare = re.sub(r"^\[\[supports\]\]\n(.+\n)*", "", without_loads(), flags=re.M)
    plain = bare.replace('preset = "herkal"\n', "")  # whose bends have no slope
    found = case_of_page(tmp_path, plain + repeated).run(points=5, zone=2)
    assert found["state"].values.tolist() == [40, 60, 80, 100, 120]
    assert found.sizes["band"] == 5


@pytest.mark.matrix
def test_compress_release_vibrate_of_the_statics_page():
    names = executed(blocks("statics.md", "python")[-1])
    path, motion = names["path"], names["motion"]
    np.testing.assert_array_equal(motion.displacement[0], path.displacement[5])
    top = motion.displacement.sel(node=3, axis="x").values
    assert top[0] == pytest.approx(0.010)
    assert top.min() < -0.002  # it springs back beyond its height


@pytest.mark.matrix
def test_the_page_on_waves_in_chains_follows_an_impact(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    names = executed(*blocks("wave-chains.md", "python"))
    assert names["rarefaction"].peak[0] > 0.0 > names["compression"].peak[0]
    assert np.abs(names["turn"].displacement).max() > 0.1  # rad
    assert len(names["quiet"].supports) > len(names["case"].supports)
    np.testing.assert_allclose(names["waves"].speeds[0], 39.6, rtol=1e-3)
    assert names["passed"].ratio[-1] < 1e-6 * names["passed"].ratio.max()
    assert {path.stem for path in tmp_path.iterdir()} == {"strain", "spectrum", "transmission"}


def test_the_folding_page_folds_a_pattern_and_computes_its_modes():
    names = executed(*blocks("folding.md", "python"))
    assert names["folding"].kind == "rigid"
    assert (names["modes"].frequency > 0.0).all()


@pytest.mark.matrix
def test_the_numbers_of_the_statics_page_are_what_its_script_computes():
    script = runpy.run_path(str(DOCS / "statics_figures.py"))
    page = (DOCS / "statics.md").read_text("utf-8")
    _, results = script["compute"]()
    script["check"](results)
    assert script["deflection_table"](results) in page
    assert f"{script['frequency'](results['motion']):.1f} Hz" in page
    folds = 100 * results["shares"][2, "superlinear"][[1, -1], 2]
    bends = 100 * results["shares"][3, "superlinear"][[1, -1], 1]
    assert f"folds hold {folds[0]:.0f} % of the energy at a ratio of 1 and {folds[1]:.0f} %" in page
    assert f"bends hold {bends[0]:.0f} % and {bends[1]:.0f} %" in page


@pytest.mark.matrix
def test_the_page_on_long_motions_finds_jumps_chaos_and_basins():
    with redirect_stdout(io.StringIO()):
        names = executed(*blocks("long-motions.md", "python"))
    up, down = names["turn"] * names["found"].jump_between.values.mean(axis=1)
    assert 1.28 < up < 1.29 and 1.115 < down < 1.125
    assert 0.09 < names["exponent"].exponent < 0.12
    assert names["basins"].share.values.tolist() == [0.5, 0.5]


def test_the_loads_page_shows_a_table_that_can_be_read(tmp_path):
    (text,), (_, toml) = blocks("loads.md", "text"), blocks("loads.md", "toml")
    (tmp_path / "pulse.csv").write_text(text, "utf-8")
    page, *_ = blocks("case-file.md", "toml")
    old = 'history = { kind = "pulse", duration = 1.0 }\n'
    assert old in page
    history = case_of_page(tmp_path, page.replace(old, toml)).case().loads[0].history
    assert history == Table([0.0, 0.0025, 0.005], [0.0, 0.0125, 0.0])


def sections() -> list[tuple[str, str]]:
    """(section, key) of the case file."""
    parts = {"supports": SUPPORTS, "loads": LOADS, "drive": (Force, BaseMotion)}
    found = [(name, key) for name in parts for kind in parts[name] for key in kind.by_key()]
    found += [(name, "history") for name in ("supports", "loads")]
    for schema in (kind.schema for kind in ANALYSES.values()):
        for name in keys(schema):
            table = table_under(name, schema)
            found += [(name, key) for key in (keys(table) if table else ())]
    return sorted(set(found))


@pytest.mark.parametrize(("section", "key"), sections())
def test_every_key_of_a_case_file_is_described(section, key):
    text = (DOCS / "case-file.md").read_text("utf-8")
    (part,) = re.findall(rf"^## `\[+{section}\]+`.*?(?=^## |\Z)", text, re.M | re.S)
    assert re.search(rf"^\| [^|]*`{key}`", part, re.M), f"docs/case-file.md: no row for {key}"


def test_sections_are_found():
    assert {section for section, _ in sections()} >= {"sheet", "model", "loads", "analysis"}
    assert {("analysis", "duration"), ("analysis", "load_factors")} <= set(sections())


@pytest.mark.matrix
def test_inertia_table_is_what_the_code_gives_and_knows_the_rhombus():
    script = runpy.run_path(str(DOCS / "inertia_table.py"))
    page = (DOCS / "mass.md").read_text("utf-8")
    assert script["with_table"](page) == page
    assert script["table"]() in page
    # by hand: m h^2/3 exactly; corners at 0, 0, h, h and the center at h/2
    rhombus = script["parallelogram"](1, 1, 60)
    for rule, corner, center in (("panel", 1 / 5, 1 / 5), ("circumcenter", 1 / 8, 1 / 2)):
        by_hand = 3 * (2 * corner + center / 4) - 1
        assert script["errors"](rule, rhombus, "n5b8") == pytest.approx([by_hand] * 4)


def test_what_a_swinging_panel_and_a_twisting_one_make_of_a_rule():
    """A square panel on a hinge, by `modes`; the twist by hand: integral of (x y)^2 is 1/9."""
    page = (DOCS / "mass.md").read_text("utf-8")
    square = fd.Pattern(
        [[0, -1, 0], [0, 0, 0], [-1, 0, 0], [-1, -1, 0], [1, 0, 0], [1, -1, 0]],
        [[0, 1, 2, 3], [0, 5, 4, 1]],
    )
    sheet = fd.Sheet(1e9, 0.25, 0.01, 1.0)

    def swing(rule: str) -> float:
        laws = {"fold_law": "linear", "bend_law": "linear", "crease_stiffness": 1e-6}
        s = fd.discretize(square, sheet, mass=rule, **named(laws))
        held = [node for node in range(len(s.nodes)) if s.nodes[node, 0] < 1e-9]
        return float(fd.modes(fd.Case(s, [fd.Fix(held, "xyz")]), 1).frequency[0])

    true = np.sqrt(1e-6 / (0.01 / 3.0)) / (2 * np.pi)  # a panel of 0.01 kg and 1 m
    rows = re.findall(r"([\d.]+) % with `(\w+)`", page)
    assert len(rows) == 4
    for percent, rule in rows:
        assert 100 * swing(rule) / true == pytest.approx(float(percent), abs=0.06), rule
    corners = fd.Pattern([[-1, -1, 0], [1, -1, 0], [1, 1, 0], [-1, 1, 0]], [[0, 1, 2, 3]])
    for rule, twist in (("consistent", 6), ("inertia_exact", 3)):
        mass = fd.discretize(corners, sheet, mass=rule, preset="plate").mass
        w = np.array([1.0, -1.0, 1.0, -1.0, 0.0])
        assert w @ (mass @ w) == pytest.approx(mass.sum() / twist)
        assert f"m w^2/{twist}$" in page


@pytest.mark.matrix
def test_the_page_on_features_has_the_table_of_what_goes_with_what():
    text, names = features.PAGE.read_text("utf-8"), list(features.FEATURES)
    (listed,) = re.findall(r"^With all methods: (.*)\.$", text, re.M)
    some = names[2::3] if FEW else names
    said, again = features.refusals(some), "python tests/features.py writes it anew"
    for name in some:
        whole = not any(said[name, method] for method in features.COLUMNS)
        assert whole == (name in listed.split("; ")), again
        assert whole or features.row(name, said) in text, again
    assert FEW or features.table(said) in text, again


@pytest.mark.matrix
def test_the_example_of_the_readme_is_short_moves_and_saves(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    (block,) = blocks("../README.md", "python")
    assert len([line for line in block.splitlines() if line.strip()]) <= 12
    trajectory = executed(block)["trajectory"]
    assert float(abs(trajectory.displacement).max()) > 1e-3
    (saved,) = tmp_path.glob("*.nc")
    np.testing.assert_array_equal(fd.load(saved).displacement, trajectory.displacement)
