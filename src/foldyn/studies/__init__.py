"""Studies of papers: shipped case files, one folder per paper."""

from __future__ import annotations

import os
from pathlib import Path

from foldyn.errors import InputError

_HERE = Path(__file__).parent


def shipped_cases() -> dict[str, Path]:
    """Shipped case files by name, such as "herkal/case1"."""
    found = {f"{path.parts[-3]}/{path.stem}": path for path in _HERE.glob("*/cases/*.toml")}
    return dict(sorted(found.items()))


def find_case(name: str) -> Path:
    """Path of a case file, given as a file or as the name of a shipped case ("herkal/case1").

    Raises
    ------
    InputError
        Neither such a file nor such a shipped case exists.
    """
    if os.path.exists(name):  # Path.exists raises if a name is too long
        return Path(name)
    known = shipped_cases()
    shipped = name.removesuffix(".toml")
    if shipped in known:
        return known[shipped]
    raise InputError(f"{name}: there is no such file; shipped cases are {', '.join(known)}")
