"""`imperfect`: a pattern whose vertices are a little off, as those of a made sheet are."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from foldyn.errors import InputError
from foldyn.patterns.pattern import Pattern, Patterned, pattern_of
from foldyn.patterns.transforms import refuse_boards
from foldyn.values import number, numbers, show, whole


def imperfect(
    pattern: Pattern | Patterned,
    amplitude: ArrayLike,
    *,
    shapes: Any = None,
    modes: int | Sequence[int] = 1,
    correlation: float | None = None,
    seed: int = 0,
) -> Pattern:
    """Pattern with displaced vertices, which is free of stress in its imperfect shape.

    Give shapes, such as buckling modes, or the correlation length of a random field.

    Parameters
    ----------
    pattern : Pattern, or a structure with one
    amplitude : float or sequence of float
        Of shapes, the largest displacement (m) of a vertex, one for all or one for each; of random
        fields, their standard deviation.
    shapes : xarray.Dataset or array_like, optional
        A result of `buckling` or `modes`, or displacements (n, 3) or (k, n, 3) of the vertices and
        maybe further nodes.
    modes : int or sequence of int
        Numbers of the modes of such a result, from 1.
    correlation : float, optional
        Length (m) over which a random field is alike: vertices at a distance r move along their
        normals with the correlation exp(-r^2 / (2 correlation^2)).
    seed : int
        Of the random field; equal seeds give equal fields.

    Raises
    ------
    InputError
        Neither shapes nor a correlation, or both; shapes of another pattern; a mode that is not
        there.

    Examples
    --------
    >>> import foldyn as fd
    >>> pattern = fd.patterns.miura(cells=(2, 2), a=0.1, b=0.1, panel_angle=60, dihedral=120)
    >>> made = fd.imperfect(pattern, 1e-4, correlation=0.1, seed=3)
    >>> bool(abs(made.vertices - pattern.vertices).max() < 5e-4)
    True
    """
    own = pattern_of(pattern)
    refuse_boards(own, "has thick panels; make it imperfect before fd.thicken")
    if (shapes is None) == (correlation is None):
        raise InputError(": give shapes, or the correlation of a random field", "shapes")
    if correlation is not None:
        size = number("amplitude", amplitude, least=0.0, unit="m")
        length = number("correlation", correlation, above=0.0, unit="m")
        rng = np.random.default_rng(whole("seed", seed, least=0))
        return own.changed(vertices=own.vertices + size * _field(own, length, rng))
    moved = _shapes(own, shapes, modes)
    sizes = np.asarray(numbers("amplitude", amplitude), float).ravel()
    if len(sizes) not in (1, len(moved)):
        raise InputError(
            f" = {show(amplitude)}: give one number (m), or one for each of {len(moved)} shapes",
            "amplitude",
        )
    most = np.linalg.norm(moved, axis=2).max(axis=1)
    if not (most > 0.0).all():
        raise InputError(": moves no vertex; panels that buckle alone need welds inside", "shapes")
    return own.changed(vertices=own.vertices + np.einsum("k,kni->ni", sizes / most, moved))


def _shapes(pattern: Pattern, given: Any, modes: int | Sequence[int]) -> NDArray[np.float64]:
    """Displacements (k, n, 3) of the vertices."""
    count = len(pattern.vertices)
    if hasattr(given, "data_vars"):
        if "shape" not in given or "mode" not in given.dims:
            raise InputError(": give a result of fd.buckling or fd.modes", "shapes")
        known = given["mode"].values.tolist()
        for mode in np.atleast_1d(modes).tolist():
            if mode not in known:
                raise InputError(f": {mode} is not there; there are modes {show(known)}", "modes")
        found = given["shape"].sel(mode=np.atleast_1d(modes)).transpose("mode", "node", "axis")
        array = np.asarray(found.values, float)
    else:
        array = np.asarray(numbers("shapes", given), float)
        array = array[None] if array.ndim == 2 else array
    if array.ndim != 3 or array.shape[1] < count or array.shape[2] != 3:
        raise InputError(
            f": shape {array.shape}; give displacements of the {count} vertices along x, y, z",
            "shapes",
        )
    return array[:, :count]


def _field(pattern: Pattern, length: float, rng: np.random.Generator) -> NDArray[np.float64]:
    """Random displacements (n, 3) along the normals of the vertices, of variance 1."""
    x, normal = pattern.vertices, np.zeros_like(pattern.vertices)
    for face, own in zip(pattern.faces, pattern.face_normals, strict=True):
        normal[[*face]] += own
    size = np.linalg.norm(normal, axis=1, keepdims=True)
    normal = np.divide(normal, size, out=np.zeros_like(normal), where=size > 0.0)
    square = ((x[:, None] - x[None]) ** 2).sum(axis=2)
    values, ways = np.linalg.eigh(np.exp(-0.5 * square / length**2))
    heights = ways @ (np.sqrt(values.clip(min=0.0)) * rng.standard_normal(len(x)))
    return heights[:, None] * normal
