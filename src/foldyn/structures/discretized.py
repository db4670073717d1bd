"""What a pattern is discretized as, whatever the model: what a case holds."""

from __future__ import annotations

from collections.abc import Mapping
from functools import cached_property
from typing import Any, ClassVar, NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy import sparse

from foldyn.algebra.solvers import Fill
from foldyn.errors import InputError
from foldyn.materials import HingeLaw
from foldyn.mechanics.body import Body
from foldyn.structures.made import Made
from foldyn.structures.mass import Surface
from foldyn.structures.sheet import Sheet


class HingeKind(NamedTuple):
    """Hinges of one kind and law: rows (k, 2 or more) of their ends, stiffness and rest angle."""

    name: str
    law: HingeLaw
    nodes: NDArray
    stiffness: NDArray
    rest: NDArray


class Discretized(Made):
    """Base of the data classes that are structures.

    Attributes
    ----------
    nodes, bars : (n, 3), (nb, 2)
        Rest positions (m), the pattern's vertices first; pairs of nodes that must not meet.
    triangles, triangle_panel : (nt, 3), (nt,)
        Counter-clockwise from the front, and the panel of each.
    centers : (np,)
        Node number of each panel's center, -1 without one.
    mass : (n, n)
        Nodal mass matrix, kg; one value serves the three axes.
    folds, fold_rest, fold_law
        Hinge row (nf, 4), rest angle (nf,), rad, of each fold, and the law of all.
    body : Body
        What solvers take.
    kind : str
        Its name in case files.
    energy_groups : mapping of str to str
        Parts of its strain energy, and what they are.
    massless : str
        What of it has dofs without mass, "the rotations of a shell"; empty if nothing has.
    fill : Fill
        Memory of the factors of its tangent.
    """

    nodes: NDArray
    bars: NDArray
    triangles: NDArray
    triangle_panel: NDArray
    centers: NDArray
    pattern: Any
    sheet: Sheet
    mass: sparse.csr_array
    folds: NDArray
    fold_rest: NDArray
    fold_law: HingeLaw
    body: Body
    fill: Fill
    energy_groups: ClassVar[Mapping[str, str]]
    kind: ClassVar[str]
    massless: ClassVar[str] = ""

    @cached_property
    def bar_length(self) -> NDArray:
        """Rest lengths of the bars (nb,), m."""
        length = np.linalg.norm(self.nodes[self.bars[:, 1]] - self.nodes[self.bars[:, 0]], axis=1)
        length.setflags(write=False)
        return length

    @cached_property
    def surface(self) -> Surface:
        """Triangles with their masses: what a mass rule distributes.

        Raises
        ------
        InputError
            The sheet has no density.
        """
        if self.sheet.density is None:
            raise InputError("sheet: density is missing: give it (kg/m3), the mass needs it")
        a, b, c = (self.nodes[self.triangles[:, k]] for k in range(3))
        return Surface(
            nodes=self.nodes,
            faces=self.pattern.faces if self.pattern is not None else (),
            centers=self.centers,
            triangles=self.triangles,
            triangle_panel=self.triangle_panel,
            triangle_area=0.5 * np.linalg.norm(np.cross(b - a, c - a), axis=1),
            areal_density=self.sheet.density * self.sheet.thickness,
        )

    def _displacement(self, u: ArrayLike) -> NDArray:
        """Displacement (n, 3), checked."""
        array = np.ascontiguousarray(u, float)
        if array.shape not in (self.nodes.shape, (self.nodes.size,)):
            raise InputError(
                f"displacement of shape {np.shape(u)}: give {self.nodes.shape} (nodes, axes)"
            )
        return array.reshape(self.nodes.shape)
