"""What the tests of messages for bad case files share."""

from __future__ import annotations

import pytest

from foldyn.errors import InputError


def edited(text: str, edits: list[tuple[str, str]]) -> str:
    """Text with things replaced that occur in it once."""
    for old, new in edits:
        assert text.count(old) == 1, old
        text = text.replace(old, new)
    return text


def check(read, text: str, message: str) -> None:
    """Reading fails, and one line of the message begins as told."""
    with pytest.raises(InputError) as caught:
        read(text)
    first, *more = str(caught.value).splitlines()
    path, _, line = first.partition(": ")
    assert path.endswith("case2.toml")
    lines = [line, *(other.removeprefix("  also ") for other in more)]
    assert any(line.startswith(message) for line in lines), lines
