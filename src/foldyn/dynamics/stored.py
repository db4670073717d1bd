"""Motions whose results go to files."""

from __future__ import annotations

from typing import TYPE_CHECKING

from foldyn.dynamics.keeping import Keeping, unwritable
from foldyn.dynamics.motion import Motion
from foldyn.dynamics.progress import Reporter
from foldyn.errors import ComputationError
from foldyn.results import load, save

if TYPE_CHECKING:
    import xarray


def stored(
    motion: Motion, keeping: Keeping, progress: bool | Reporter | None = None
) -> xarray.Dataset:
    """Integrate a motion into the file of its result; see `simulate`."""
    if finished := motion.finished(keeping):
        return finished
    with keeping.held():
        try:
            result = motion.run(progress, keeping)
        except ComputationError as error:
            if error.partial is not None:
                error.partial.attrs["stopped_because"] = str(error)
                error.partial = _saved(error.partial, keeping)
            raise
        return _saved(result, keeping)


def _saved(result: xarray.Dataset, keeping: Keeping) -> xarray.Dataset:
    """The result, from its file."""
    try:
        save(result, keeping.file)
    except OSError as error:
        text = f"{keeping.file}: {unwritable(error)}{keeping.summary}"
        raise ComputationError(text, result) from None
    keeping.remove()
    return load(keeping.file, whole=False)
