"""What the tests of messages for bad case files share."""

from __future__ import annotations

import pytest

from case_texts import begins
from foldyn.errors import InputError


def check(read, text: str, message: str) -> None:
    """Reading fails, and one line of the message begins as told."""
    with pytest.raises(InputError) as caught:
        read(text)
    first, *more = str(caught.value).splitlines()
    path, _, line = first.partition(": ")
    assert path.endswith("case2.toml")
    lines = [line, *(other.removeprefix("  also ") for other in more)]
    assert any(begins(line, message) for line in lines), lines
