"""Springs of a case as arrays."""

from __future__ import annotations

from collections.abc import Iterable
from typing import Any

import numpy as np
from numpy.typing import NDArray

from foldyn.cases.selection import resolve_nodes
from foldyn.cases.supports import Spring
from foldyn.errors import InputError
from foldyn.mechanics.attached import GROUND, Springs, no_springs


def packed(parts: Iterable[tuple[str, Spring]], structure: Any) -> Springs:
    """Arrays of springs, each with its place for messages.

    Raises
    ------
    InputError
        A node is out of range, or the ends of a spring without a direction coincide.
    """
    x, none = structure.nodes, no_springs()
    ends, direction, stiffness = [none.ends], [none.direction], [none.stiffness]
    axial, vector, natural, along = [none.ends], [none.vector], [none.length], [none.length]
    for place, spring in parts:
        pairs, axes = spring_ends(structure, spring, place), spring_directions(spring)
        if axes is not None:
            ends.append(np.repeat(pairs, len(axes), axis=0))
            direction.append(np.tile(axes, (len(pairs), 1)))
            stiffness.append(np.full(len(pairs) * len(axes), spring.stiffness))
            continue
        apart = x[pairs[:, 1]] - x[pairs[:, 0]]
        length = np.linalg.norm(apart, axis=1)
        _check_apart(structure, pairs, length, place)
        axial.append(pairs)
        vector.append(apart)
        rest = spring.rest_length
        natural.append(length if rest is None else np.full(len(length), rest))
        along.append(np.full(len(length), spring.stiffness))
    vectors = np.concatenate(vector)
    length = np.linalg.norm(vectors, axis=1)
    return Springs(
        ends=np.concatenate(ends).astype(np.int64),
        direction=np.concatenate(direction),
        stiffness=np.concatenate(stiffness),
        axial_ends=np.concatenate(axial).astype(np.int64),
        vector=vectors,
        length=length,
        stretch=length - np.concatenate(natural),
        axial_stiffness=np.concatenate(along),
    )


def spring_ends(structure: Any, spring: Spring, place: str) -> NDArray[np.int64]:
    """Ends (k, 2) of the springs of a part; `GROUND` in place of the second."""
    if spring.nodes is not None:
        nodes = resolve_nodes(structure, spring.nodes, f"{place}.nodes")
        return np.stack([nodes, np.full(len(nodes), GROUND)], axis=1)
    pairs = np.array(spring.between, np.int64)
    for k, pair in enumerate(pairs):
        resolve_nodes(structure, pair.tolist(), f"{place}.between[{k}]")
    return pairs


def spring_directions(spring: Spring) -> NDArray[np.float64] | None:
    """Unit vectors (k, 3) along which a part's springs act; None of the line between their ends."""
    if spring.direction is not None:
        vector = np.array(spring.direction)
        return (vector / np.linalg.norm(vector))[None]
    return np.eye(3) if spring.nodes is not None else None


def _check_apart(structure: Any, pairs: NDArray, length: NDArray, place: str) -> None:
    size = float(np.ptp(structure.nodes, axis=0).max())
    meet = np.flatnonzero(length <= 1e-9 * size)
    if meet.size:
        raise InputError(
            f" = {pairs[meet[0]].tolist()}: these nodes coincide, so that the line between them "
            'has no direction; give direction, as in direction = "x"',
            f"{place}.between[{meet[0]}]",
        )
