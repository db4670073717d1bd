"""The folder of the results: checked before anything runs, written to afterwards."""

from __future__ import annotations

import tempfile
from pathlib import Path
from typing import TYPE_CHECKING

from foldyn.errors import ComputationError, InputError

if TYPE_CHECKING:
    import xarray

DRAWN = (
    "report.html",
    *(f"{name}.png" for name in ("structure", "laws", "load", "motion", "energies")),
    *(f"{name}.png" for name in ("reaction", "curve", "shapes")),
    *(f"{name}.png" for name in ("modes", "mac", "response", "nyquist")),
    *(f"{name}.{kind}" for name in ("motion", "path", "modes") for kind in ("gif", "mp4")),
)
"""All that the pages of `report` come with."""


def check_folder(folder: Path, out: str | None, names: list[str]) -> None:
    """Refuse a results folder that cannot be written, by trying; leaves nothing behind."""
    place = f"--out {folder}" if out is not None else f"results folder {folder}"
    if out == "":
        raise InputError("--out: is empty; name a folder")
    made: list[Path] = []
    try:
        for part in (*reversed(folder.parents), folder):
            if not part.exists():
                part.mkdir()
                made.append(part)
        if not folder.is_dir():
            raise InputError(f"{place}: is a file; name a folder")
        for name in names:
            if (folder / name).is_dir():
                raise InputError(
                    f"{place}: {folder / name} is a folder, a file of this name is to be written; "
                    "name another folder"
                )
        with tempfile.TemporaryFile(dir=folder):
            pass
    except (OSError, ValueError) as error:
        if isinstance(error, InputError):
            raise
        reason = getattr(error, "strerror", None) or error
        raise InputError(f"{place}: cannot be written ({reason}); name another folder") from None
    finally:
        for part in reversed(made):
            part.rmdir()


def remove_drawn(folder: Path) -> None:
    """Remove the figures of an earlier run: they would belie this one."""
    for name in DRAWN:
        (folder / name).unlink(missing_ok=True)


def save_result(result: xarray.Dataset, file: Path) -> str:
    """Write a result into a folder that is made where needed; returns the file's name."""
    from foldyn.results import save

    file.parent.mkdir(parents=True, exist_ok=True)
    try:
        save(result, file)
    except InputError as error:  # the input was right, but the folder has changed since
        raise ComputationError(str(error), result) from None
    return str(file)
