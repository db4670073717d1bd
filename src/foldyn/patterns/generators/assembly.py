"""A pattern assembled from its panels, crease families and letters."""

from __future__ import annotations

from collections import Counter
from collections.abc import Mapping, Sequence
from typing import Any, TypeVar

from numpy.typing import ArrayLike

from foldyn.patterns.pattern import Pattern
from foldyn.patterns.topology import Edge, around, edge_of

T = TypeVar("T")


def assembled(
    name: str,
    vertices: ArrayLike,
    faces: Sequence[Sequence[int]],
    families: Mapping[str, Sequence[Edge]],
    letters: Mapping[str, str] | None = None,
    angles: Mapping[str, float] | None = None,
    custom: Mapping[str, Any] | None = None,
    periods: Sequence[Sequence[Edge]] = (),
) -> Pattern:
    """Assemble a pattern; edges in families that belong to a single panel are left out.

    An edge may be listed twice.

    Parameters
    ----------
    name : str
    vertices : array_like, shape (n, 3) or (n, 2)
    faces : sequence of sequences of int
    families : mapping from str to sequences of vertex pairs
    letters : mapping, optional
        Assignment of each family.
    angles : mapping, optional
        Angle (rad) to fold each family to, valleys positive.
    custom : mapping, optional
    periods : sequence of sequences of vertex pairs
        Both as in `Pattern`.

    Returns
    -------
    Pattern
    """
    panels = Counter(edge_of(a, b) for face in faces for a, b in around(face))

    def shared_by(count: int) -> dict[str, list[Edge]]:
        edges = {family: [edge_of(*pair) for pair in pairs] for family, pairs in families.items()}
        found = {family: [e for e in own if panels[e] == count] for family, own in edges.items()}
        return {family: own for family, own in found.items() if own}

    creases = shared_by(2)

    def each(values: Mapping[str, T]) -> dict[Edge, T]:
        return {pair: values[f] for f, pairs in creases.items() if f in values for pair in pairs}

    rim = {pair: "B" for pair, count in panels.items() if count == 1}
    return Pattern(
        vertices,
        faces,
        rim | each(letters) if letters else None,
        name,
        fold_angles=each(angles) if angles else None,
        families=creases,
        custom=custom,
        periods=periods,
        rim_families=shared_by(1),
    )
