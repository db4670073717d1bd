"""The commands of docs/folding.md from a file to modes, and the frequencies of its table."""

from __future__ import annotations

import re
import shlex
from pathlib import Path

import numpy as np
import pytest

import foldyn as fd
from pairwise import beyond

ROOT = Path(__file__).resolve().parents[2]
PAGE = (ROOT / "docs" / "folding.md").read_text("utf-8")
(BLOCK,) = re.findall(r"^```sh\n(.*?)^```$", PAGE, re.M | re.S)
LINES = BLOCK.splitlines()
COMMANDS = {
    modes.split()[-1]: (fold, modes) for fold, modes in zip(LINES[::2], LINES[1::2], strict=True)
}
TABLE = {
    row[0]: row[1:]
    for row in re.findall(r"^\| `(\S+)` \|.*?\| (\d+) of (\d+) \|.*\| (\S+) \|$", PAGE, re.M)
}


def test_the_page_has_commands_for_each_pattern_of_its_table():
    files = sorted(path.stem for path in (ROOT / "examples" / "patterns").glob("*.fold"))
    assert sorted(COMMANDS) == sorted(TABLE) == files


@pytest.mark.matrix
@pytest.mark.parametrize(
    "name", ["square-twist", "bird-base", *beyond(["waterbomb", "crane", "miura", "resch"], 2)]
)
def test_a_file_is_folded_and_has_the_modes_of_the_page(name, workplace) -> None:
    (case_file,) = (
        b for b in re.findall(r"^```toml\n(.*?)^```$", PAGE, re.M | re.S) if "modes" in b
    )
    workplace.write(case_file, "modes.toml")
    fold, modes = (shlex.split(line)[1:] for line in COMMANDS[name])
    fold[1] = str(ROOT / fold[1])
    told = workplace.call(*fold, "--no-figures")
    turned, total, frequency = TABLE[name]
    assert told.status == 0
    assert told.out.startswith(f"{turned} of {total} mountains and valleys turn their way\n")
    assert turned == total
    assert workplace.call(*modes, "--no-figures").status == 0
    found = fd.load(Path(name) / "result.nc")
    assert int(found.rigid.sum()) == 6
    np.testing.assert_allclose(found.frequency[6], float(frequency), rtol=2e-3)
