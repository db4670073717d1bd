"""What structures of all models are: data that nobody changes, and that knows who made it."""

from __future__ import annotations

from dataclasses import dataclass, field, fields
from typing import Self

import numpy as np


@dataclass(frozen=True, eq=False)
class Made:
    """A structure of some model.

    Attributes
    ----------
    as_made : bool
        Whether `discretize`, or the function of its model, made it: then it makes the same again
        of pattern, sheet and options. `dataclasses.replace` does not hand it on.
    """

    as_made: bool = field(default=False, init=False)

    def __post_init__(self) -> None:
        for item in fields(self):
            value = getattr(self, item.name)
            if isinstance(value, np.ndarray):
                frozen = np.array(value)
                frozen.setflags(write=False)
                object.__setattr__(self, item.name, frozen)

    def marked(self) -> Self:
        """Mark it as made."""
        object.__setattr__(self, "as_made", True)
        return self
