"""What a method of frequency response gives."""

from __future__ import annotations

from typing import Any, NamedTuple

from numpy.typing import NDArray


class Answer(NamedTuple):
    """Response with what else a method tells.

    Attributes
    ----------
    response : ndarray, complex
        Per unit of the drive: of the free dofs, shape (m, nf), relative to the base, from methods
        on matrices; of all nodes, shape (m, n, 3), absolute, from simulated motions.
    more : dict
        Further variables of the dataset.
    facts : dict
        Attributes of the dataset.
    """

    response: NDArray[Any]
    more: dict[str, NDArray[Any]]
    facts: dict[str, Any]
