"""Numbers of case files that no machine can compute with: one short message, at the door."""

from __future__ import annotations

import re
import warnings
from itertools import cycle

import pytest

from case_texts import FOLD_TEXT, changed, edited
from foldyn.analyses.reading import check_values, read_case
from foldyn.errors import InputError
from pairwise import beyond

CASE = f"""{FOLD_TEXT.replace("simple_fold", "miura")}length_scale_ratio = 1.0
[damping]
alpha = 0.1
beta = 1e-7
[[supports]]
nodes = [0, 1, 2]
[[supports]]
nodes = [6]
axis = "z"
displacement = 0.001
history = {{ kind = "ramp", duration = 0.05 }}
[[loads]]
nodes = [7]
force = [0.01, 0, 0]
history = {{ kind = "table", times = [0, 1], values = [0, 1] }}
[[loads]]
creases = [0]
angle = 70
history = {{ kind = "chirp", from_frequency = 1, to_frequency = 2, duration = 0.1, phase = 0 }}
[initial]
spin = [0, 0, 0]
[analysis]
kind = "dynamics"
method = "newmark"
duration = 0.1
dt = 0.01
tolerance = 1e-4
start = 0.0
[output]
nodes = [7]
interval = 0.01
max_frequency = 5.0
"""
VIBRATION = """pattern = { kind = "kresling", sides = 6, storeys = 1 }; damping =; initial =;
loads =; output = { nodes = [7] }; supports = [{ nodes = [0, 1, 2, 3] }];
drive = [{ nodes = [7], force = [0.01, 0, 0] }]; model.crease_stiffness = 0.1;
analysis = { kind = "frf", method = "burst_random", averages = 4, seed = 1, burst = 0.5,
frequencies = { first = 1, last = 5, count = 41 }, amplitude = 1.0, duration = 10.0,
interval = 0.01,
window_rate = 0.0 }"""
SLOW = """pattern = { vertices = [[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0.5]],
faces = [[0, 1, 2], [0, 2, 3]] }; model.fold_law = { kind = "enhanced", theta1 = 45, theta2 = 315 };
damping =; initial =; supports = [{ nodes = [0, 1, 2] }]; output = { shapes = [0, 1] };
loads = [{ nodes = [3], force = [0, 0, 0.001] }]; analysis = { kind = "statics",
method = "arc_length", load_factors = [0, 1], steps = 5, first_step = 0.1, largest_turn = 10,
until = { node = 3, axis = "z", displacement = 0.1 } }"""
SHAKEN, PATH = (changed(CASE, " ".join(edits.split())) for edits in (VIBRATION, SLOW))
NUMBER = re.compile(r"(?<![\w.\"])-?\d[\d.]*(?:e-?\d+)?(?![\w.\"])")
WORDS = (
    "9223372036854775808", "-18446744073709551617", "0x" + "f" * 40, "0x" + "f" * 5000, "9" * 4400,
    "1e103", "1e308", "-1e308", "1e-300", "5e-324", "1e400", "nan", "-inf", "1e50", "1e-50",
    "9223372036854775807",
)  # fmt: skip
TEXTS = {"motion": CASE, "response": SHAKEN, "path": PATH}


def others(i: int) -> list[str]:
    """Kinds of case files in which `make test` does not try word i."""
    return [kind for k, kind in enumerate(TEXTS) if k != i % len(TEXTS)]


@pytest.mark.parametrize(
    ("kind", "word"),
    [
        *zip(cycle(TEXTS), WORDS, strict=False),
        *beyond((kind, word) for i, word in enumerate(WORDS) for kind in others(i)),
    ],
    ids=lambda text: text[:20],
)
def test_every_number_of_a_case_file_is_checked(kind, word, tmp_path):
    """Each of them in turn: the case is made without a word from NumPy, or refused in a few."""
    file, text = tmp_path / "case.toml", TEXTS[kind]
    file.write_text(text)
    read_case(file)
    places = list(NUMBER.finditer(text))
    assert len(places) > 20
    for place in places:
        file.write_text(text[: place.start()] + word + text[place.end() :])
        with warnings.catch_warnings():
            warnings.simplefilter("error", RuntimeWarning)
            try:
                read_case(file)
            except InputError as error:
                told = str(error).removeprefix(f"{file}: ")
                assert len(told) < 1000, told


@pytest.mark.parametrize(
    ("old", "new", "message"),
    [
        ("nodes = [0, 1, 2]", f"nodes = [0, {2**70}]",
         f"supports[0].nodes[1] = {2**70}: must be a whole number of at most 64 bits"),
        ("nodes = [7]\nforce", "nodes = 0x" + "f" * 5000 + "\nforce",
         "loads[0].nodes = a number of about 6021 digits: must be a whole number of at most 64"),
        ("nodes = [7]\ninterval", f"nodes = [{2**63}]\ninterval",
         "output.nodes[0] = 9223372036854"),
        ("interval = 0.01", "every_steps = " + "9" * 30, "output.every_steps = 9999"),
        ("interval = 0.01", "every_steps = " + "9" * 4400, "is not valid TOML: "),
        ("thickness = 0.01", "thickness = 1e103",
         "sheet.thickness = 1e+103: must be in size at most 1e+50"),
        ("thickness = 0.01", "thickness = 1e31", "sheet.thickness = 1e+31: must be in size"),
    ],
    ids=range(7),
)  # fmt: skip
def test_the_message_names_the_key(old, new, message, tmp_path):
    file = tmp_path / "case.toml"
    file.write_text(edited(CASE, (old, new)))
    with pytest.raises(InputError) as told:
        read_case(file)
    assert str(told.value).startswith(f"{file}: {message}")


def test_late_starts_and_small_tails_of_a_table_pass(tmp_path):
    file = tmp_path / "case.toml"
    late = ("start = 0.0", "start = 1e9")
    file.write_text(edited(CASE, late, ("values = [0, 1]", "values = [1e-200, 1]")))
    read_case(file)


MANY = ", ".join(f"k{i} = 1" for i in range(9000))
LONG = {
    "keys": "".join(f"key{i} = 1\n" for i in range(3000)),
    "a key": "k" * 90_000 + " = 1\n",
    "nodes": f"[[supports]]\nnodes = {list(range(13, 20_000))}\n",
    "nodes twice": f"[[supports]]\nnodes = {[5] * 20_000}\n",
    "a selection": f'[[supports]]\nnodes = "{"x" * 90_000}"\n',
    "sections": "[[supports]]\naxes = 3\n" * 2000,
    "a table": f"[[loads]]\nnodes = 7\nforce = {{ {MANY} }}\n",
    "a word": f'[[loads]]\nnodes = 7\nforce = "{"z" * 90_000}"\n',
}


@pytest.mark.parametrize("what", LONG)
def test_no_message_is_long(what, tmp_path):
    file = tmp_path / "case.toml"
    file.write_text(LONG[what] + CASE if what in ("keys", "a key") else CASE + LONG[what])
    with pytest.raises(InputError) as told:
        read_case(file)
    text = str(told.value)
    assert len(text) < 4000
    assert len(text.splitlines()) <= 20


def test_limits_are_checked_deep_and_in_order():
    document = {"a": {"b": [1, {"c": 2**63}]}, "d": 10**400}
    with pytest.raises(InputError, match=r"^a\.b\[1\]\.c = 9223372036854775808: must be"):
        check_values(document)
    check_values({"a": [1e-300, {"b": float("nan")}], "c": True, "d": "x"})
