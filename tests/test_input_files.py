"""What is no file is refused by every reader at once, whatever its name promises."""

from __future__ import annotations

import os
import signal

import pytest

import foldyn as fd
from foldyn import experiment
from foldyn.analyses.reading import read_document
from foldyn.cases.csv_table import read_headings, read_numbers
from foldyn.errors import InputError
from foldyn.experiment.calibration import fit_file, measured_files
from foldyn.input_files import DEEPEST, from_json, from_toml, read_text

READERS = {
    "case": (fd.read_case, ".toml"),
    "fit": (fit_file.read_fit, ".toml"),
    "pattern": (fd.read_pattern, ".fold"),
    "history": (fd.Table.from_csv, ".csv"),
    "columns": (read_headings, ".csv"),
    "numbers": (lambda file: read_numbers(file, {"time": ("t", "s")}), ".csv"),
    "result": (fd.load, ".nc"),
    "tracks": (experiment.load_tracks, ".nc"),
    "measurement": (measured_files.recognize, ".nc"),
}
TEXTS = [name for name, (_, suffix) in READERS.items() if suffix != ".nc"]


@pytest.fixture(autouse=True)
def in_time():
    """A reader that waits for ever fails."""
    signal.signal(signal.SIGALRM, lambda *_: pytest.fail("still reading after 20 s"))
    signal.alarm(20)
    yield
    signal.alarm(0)


def refusal(name, path) -> str:
    with pytest.raises(InputError) as caught:
        READERS[name][0](path)
    assert str(caught.value).startswith(str(path))
    return str(caught.value)


@pytest.mark.parametrize("name", READERS)
def test_pipes_devices_and_folders_are_no_files(name, tmp_path):
    suffix = READERS[name][1]
    pipe, device, folder = (tmp_path / f"{kind}{suffix}" for kind in ("pipe", "device", "folder"))
    os.mkfifo(pipe)
    device.symlink_to("/dev/zero")
    folder.mkdir()
    for path in (pipe, device):
        assert "is a pipe or a device, not a file" in refusal(name, path)
    assert "is a folder" in refusal(name, folder) or name == "pattern"
    assert "there is no such file" in refusal(name, tmp_path / f"none{suffix}")


@pytest.mark.parametrize("name", TEXTS)
def test_texts_of_any_size_are_refused(name, tmp_path):
    path = tmp_path / f"large{READERS[name][1]}"
    with path.open("wb") as file:
        file.truncate(1 << 40)  # a hole, which takes no room
    assert "is larger than" in refusal(name, path)


def test_links_and_marks_are_followed(tmp_path):
    (tmp_path / "text").write_bytes("\ufeffa = 1".encode())
    (tmp_path / "link").symlink_to("text")
    assert read_text(tmp_path / "link", "a text", 1, "cut it") == "a = 1"
    assert read_document(tmp_path / "link") == {"a": 1}


@pytest.mark.parametrize(
    "text",
    [
        "a = " + "[" * 100_000,
        "a = " + "[" * 200 + "]" * 200,
        "a" + ".a" * 20_000 + " = 1",  # more than linear in tomllib: 9 s
        "[" + "a ." * 20_000 + "a]",
        "".join(f"[{'.'.join(['a'] * n)}]\nb = 1\n" for n in range(1, 49)) + "c.d.e.f.g = 1",
        "a = " + "9" * 5000,
        "a = ",
    ],
)
def test_deep_or_broken_toml_is_refused(text):
    with pytest.raises(InputError, match="is not valid TOML: ") as caught:
        from_toml(text)
    assert len(str(caught.value)) < 200


@pytest.mark.parametrize("text", ["[" * 100_000, "[" * 200 + "]" * 200, "9" * 5000, "{", ""])
def test_deep_or_broken_json_is_refused(text):
    with pytest.raises(InputError, match="is not valid JSON: ") as caught:
        from_json(text)
    assert len(str(caught.value)) < 200


def test_what_is_not_too_deep_is_read():
    depth = DEEPEST - 1
    assert from_json("[" * depth + "]" * depth)
    assert from_toml('a = "' + "a." * 40 + '"\n# a.a.a')
    assert from_toml(".".join(["a"] * depth) + " = 1")
