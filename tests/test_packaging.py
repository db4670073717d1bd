"""What users and other programs get: links, versions, requirements."""

from __future__ import annotations

import re
import tomllib
from pathlib import Path

import pytest

import foldyn as fd

ROOT = Path(__file__).resolve().parents[1]
RECIPE = ROOT / "conda" / "recipe.yaml"


def anchors(page: Path) -> set[str]:
    """Anchors of a page's headings."""
    headings = re.findall(r"^#+ (.*)$", page.read_text("utf-8"), re.M)
    return {re.sub(r"[^\w -]", "", one.lower()).replace(" ", "-") for one in headings}


@pytest.mark.parametrize("page", ["README.md", "CHANGELOG.md", "CONTRIBUTING.md"])
def test_links_lead_somewhere(page):
    """Those of the pages in docs are checked when they are built."""
    links = re.findall(r"\]\(([^)]+)\)", (ROOT / page).read_text("utf-8"))
    local = [link.partition("#") for link in links if "://" not in link]
    assert not [name for name, _, _ in local if not (ROOT / name).exists()]
    pairs = [(name or page, anchor) for name, _, anchor in local if anchor]
    assert not [pair for pair in pairs if pair[1] not in anchors(ROOT / pair[0])]


def test_the_readme_of_the_package_has_no_relative_links():
    """Its substitutions leave the text of links into the repository, and no pictures of it."""
    project = tomllib.loads((ROOT / "pyproject.toml").read_text("utf-8"))
    text = before = (ROOT / "README.md").read_text("utf-8")
    for one in project["tool"]["hatch"]["metadata"]["hooks"]["fancy-pypi-readme"]["substitutions"]:
        text = re.sub(one["pattern"], one["replacement"], text)
    assert re.findall(r"\]\((?!https:)[^)]*\)", text) == []
    assert "The tutorial goes from a crease pattern file" in text
    assert "![" in before and "![" not in text


def test_versions_agree():
    for name in ("CITATION.cff", "conda/recipe.yaml"):
        (version,) = re.findall(
            r'^ *version: "?(\d[^"\n]*)', (ROOT / name).read_text("utf-8"), re.M
        )
        assert version == fd.__version__, name


def test_the_conda_recipe_asks_for_what_the_package_asks_for():
    project = tomllib.loads((ROOT / "pyproject.toml").read_text("utf-8"))["project"]
    asked = {"python " + project["requires-python"]}
    asked |= {re.sub(r"(?<=\w)(?=>=)", " ", line) for line in project["dependencies"]}
    run = RECIPE.read_text("utf-8").partition("  run:\n")[2].partition("\ntests:")[0]
    listed = {one.replace("-base", "") for one in re.findall(r"^    - (.*)$", run, re.M)}
    assert asked - listed == {"rslab >=1.7,<2"}
    assert listed <= asked


def test_the_conda_recipe_renders():
    builder = pytest.importorskip("rattler_build", reason="needs py-rattler-build")
    recipe = builder.Stage0Recipe.from_file(RECIPE)
    assert [one.recipe.package.name for one in recipe.render(builder.VariantConfig())] == ["foldyn"]
