"""Folded sheets in CalculiX: one layer of solids C3D20R for each panel, tied along creases.

The mean displacement of back and front of a panel at an edge is tied to that of its neighbor, or
held, and springs resist the turn of one relative to the other. Solids become a thin sheet, as in
the theory of Kirchhoff: shear moduli across the thickness are `STIFF` times as large, stretching
does not change the thickness, and at edges the sheet turns about the edge's normal by the slope
of its own displacement, and stays straight across its thickness.
"""

from __future__ import annotations

import os
import subprocess
from collections.abc import Iterable, Iterator
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from foldyn.patterns import Pattern
from foldyn.structures.material_axes import material_axes
from foldyn.structures.sheet import Sheet
from verification.calculix.mesh import cell_ends, panel_mesh, shares

STIFF = 30.0
BACK, FRONT, MIDDLE = range(3)
SMALL = 1e-9  # factors of equations, relative to the largest, that count as 0

Term = tuple[int, int, int, float]  # node of the middle, layer, axis, factor


class Loads(NamedTuple):
    """Loads: on panels (np, 3), Pa, on edges, N/m, and on vertices, N."""

    panels: NDArray
    edges: dict[tuple[int, int], NDArray]
    vertices: dict[int, NDArray]


class Solids:
    """Solids of a pattern, whose first panel is held along its edges.

    Parameters
    ----------
    pattern : Pattern
    sheet : Sheet
        The same for all panels.
    stiffness : (nc,)
        Stiffness of the creases, N m/rad.
    """

    def __init__(self, pattern: Pattern, sheet: Sheet, stiffness: NDArray) -> None:
        self.pattern, self.sheet, self.stiffness = pattern, sheet, stiffness
        ends = cell_ends(pattern, sheet.thickness)
        self.panels = [panel_mesh(pattern.vertices[[*face]], ends) for face in pattern.faces]
        counts = [len(own.nodes) for own in self.panels]
        self._first = np.cumsum([0, *counts])
        self._points = np.concatenate([own.nodes for own in self.panels])
        self._normal = np.repeat([own.frame[2] for own in self.panels], counts, axis=0)

    def solved(self, loads: Loads) -> tuple[list[NDArray], NDArray]:
        """Forces and moments of each panel, (cells, 4, 2, 3), and moments (nc,) of creases, N."""
        own = os.environ | {"OMP_NUM_THREADS": "1", "OPENBLAS_NUM_THREADS": "1"}
        with TemporaryDirectory() as folder:
            deck = "\n".join([*self._deck(loads), ""])
            Path(folder, "sheet.inp").write_text(deck, encoding="utf-8")
            made = subprocess.run(
                ["ccx", "sheet"], cwd=folder, env=own, capture_output=True, text=True, check=False
            )
            if "*ERROR" in made.stdout or made.returncode:
                raise RuntimeError(made.stdout[-2000:])
            lines = Path(folder, "sheet.dat").read_text(encoding="utf-8").splitlines()
        rows = [row for row in map(str.split, lines) if row and row[0].isdecimal()]
        turns = np.array([float(row[1]) for row in rows if len(row) == 4])
        stress = np.array([row[2:] for row in rows if len(row) == 8], float).reshape(-1, 8, 6)
        share, length = self._creases()
        each = np.split(stress, np.cumsum([len(own.cells()) for own in self.panels])[:-1])
        turned = (share * turns.reshape(share.shape)).sum(axis=1) / length
        return list(map(self._resultants, range(len(each)), each)), self.stiffness * turned / length

    def _resultants(self, p: int, stress: NDArray) -> NDArray:
        """Forces and moments (c, 4, 2, 3) of a panel, from stresses (c, 8, 6) in space."""
        t, frame = self.sheet.thickness, self.panels[p].frame
        tensor = stress[..., [[0, 3, 4], [3, 1, 5], [4, 5, 2]]]
        flat = np.einsum("ai,cpij,bj->cpab", frame, tensor, frame)[..., [0, 1, 0], [0, 1, 1]]
        back, front = flat[:, :4], flat[:, 4:]  # at t / sqrt(12) from the middle
        return np.stack([0.5 * t * (front + back), t**2 / 48**0.5 * (front - back)], axis=2)

    # ------------------------------------------------------------------ places
    def _edge(self, p: int, low: int, high: int) -> NDArray:
        """Nodes of a panel's edge, from the vertex `low` to the other."""
        face = list(self.pattern.faces[p])
        k = face.index(low)
        if face[(k + 1) % len(face)] == high:
            return self._first[p] + self.panels[p].line(k)
        return self._first[p] + self.panels[p].line(face.index(high))[::-1]

    def _places(self) -> dict[tuple[int, ...], list[int]]:
        """Nodes of all panels at vertices (v,) and on edges (low, high, k)."""
        found: dict[tuple[int, ...], list[int]] = {}
        for p, face in enumerate(self.pattern.faces):
            for a, b in zip(face, (*face[1:], face[0]), strict=True):
                low, high = sorted((a, b))
                line = self._edge(p, low, high).tolist()
                found.setdefault((a,), []).append(line[0 if a == low else -1])
                for k, node in enumerate(line[1:-1]):
                    found.setdefault((low, high, k), []).append(node)
        return found

    def _creases(self) -> tuple[NDArray, NDArray]:
        """Shares (nc, 2n + 1), m, of the points of creases, and their lengths (nc,)."""
        lines = zip(
            self.pattern.crease_faces[:, 0].tolist(), self.pattern.creases.tolist(), strict=True
        )
        share = np.array([shares(self._points[self._edge(p, *pair)]) for p, pair in lines])
        return share, share.sum(axis=1)

    def _forces(self, loads: Loads) -> NDArray:
        """Forces (m, 3), N, on the nodes of the middle."""
        found, places = np.zeros_like(self._points), self._places()
        for p, own in enumerate(self.panels):
            found[self._first[p] : self._first[p + 1]] = own.areas()[:, None] * loads.panels[p]
        for vertex, force in loads.vertices.items():
            found[places[vertex,][0]] += force
        for (low, high), force in loads.edges.items():
            p = next(k for k, face in enumerate(self.pattern.faces) if {low, high} <= {*face})
            line = self._edge(p, low, high)
            found[line] += shares(self._points[line])[:, None] * force
        return found

    # ------------------------------------------------------------------ the deck
    def _deck(self, loads: Loads) -> Iterator[str]:
        yield "*NODE"
        for layer, shift in ((BACK, -0.5), (FRONT, 0.5), (MIDDLE, 0.0)):
            at = self._points + shift * self.sheet.thickness * self._normal
            for node, point in enumerate(at.tolist()):
                yield _line(self._number(node, layer), *point)
        yield from self._cells()
        for terms in (*self._ties(), *self._slopes(), *self._straight()):
            yield from self._equation(terms)
        yield from self._springs()
        yield from ("*BOUNDARY", _line("TURNS", 2, 3), "*STEP", "*STATIC", "*CLOAD")
        force = self._forces(loads)
        for node, axis in np.argwhere(force).tolist():
            for layer in (BACK, FRONT):
                yield _line(self._number(node, layer), axis + 1, 0.5 * float(force[node, axis]))
        yield from ("*NODE PRINT, NSET=TURNS", "U")
        for p in range(len(self.panels)):
            yield from (f"*EL PRINT, ELSET=PANEL_{p}, GLOBAL=YES", "S")
        yield "*END STEP"

    def _number(self, node: int, layer: int) -> int:
        return 1 + node + layer * len(self._points)

    def _cells(self) -> Iterator[str]:
        number, fibers = 0, material_axes(self.pattern, self.sheet)
        for p, own in enumerate(self.panels):
            axes = own.frame[:2]
            if fibers is not None:
                axes = np.stack([fibers[p], np.cross(own.frame[2], fibers[p])])
            yield f"*ELEMENT, TYPE=C3D20R, ELSET=PANEL_{p}"
            for cell in (self._first[p] + own.cells()).tolist():
                number += 1
                layers = [(cell[:4], BACK), (cell[:4], FRONT), (cell[4:], BACK), (cell[4:], FRONT),
                          (cell[:4], MIDDLE)]  # fmt: skip
                nodes = [self._number(node, layer) for some, layer in layers for node in some]
                yield from (_line(number, *nodes[:12]) + ",", _line(*nodes[12:]))
            yield f"*ORIENTATION, NAME=AXES_{p}"
            yield _line(*axes.ravel().tolist())
            yield f"*SOLID SECTION, ELSET=PANEL_{p}, MATERIAL=SHEET, ORIENTATION=AXES_{p}"
        (first, second), nu = self.sheet.moduli, self.sheet.poissons_ratio
        shear = self.sheet.shear_modulus or first / (2.0 * (1.0 + nu))
        yield from ("*MATERIAL, NAME=SHEET", "*ELASTIC, TYPE=ENGINEERING CONSTANTS")
        yield _line(first, second, first, nu, 0.0, 0.0, shear, STIFF * first / 3.0)
        yield _line(STIFF * first / 3.0, 293.0)

    def _ties(self) -> Iterator[list[Term]]:
        """Equal mean displacements of back and front where panels meet; none where held."""
        for place, nodes in self._places().items():
            fixed = set(place[:2]) <= {*self.pattern.faces[0]} and nodes[0] < self._first[1]
            for node in nodes if fixed else nodes[1:]:
                pairs = [(node, 1.0)] if fixed else [(node, 1.0), (nodes[0], -1.0)]
                for axis in range(3):
                    yield [(m, layer, axis, c) for m, c in pairs for layer in (FRONT, BACK)]

    def _lines(self) -> Iterator[tuple[int, NDArray]]:
        for p, own in enumerate(self.panels):
            yield from ((p, self._first[p] + own.line(k)) for k in range(len(own.grid)))

    def _slopes(self) -> Iterator[list[Term]]:
        """On edges, the turn about the normal of the edge is the slope of the displacement."""
        for p, line in self._lines():
            at = self._points[line]
            along = (at[-1] - at[0]) / np.linalg.norm(at[-1] - at[0])
            x, normal, lead = (at - at[0]) @ along, self.panels[p].frame[2], np.abs(along).argmax()
            for i in range(1, len(line) - 1):
                slope = np.zeros(len(line))
                if i % 2:
                    slope[[i - 1, i + 1]] = np.array([-1.0, 1.0]) / (x[i + 1] - x[i - 1])
                else:
                    slope[i - 2 : i + 1] = np.array([0.5, -2.0, 1.5]) / (x[i] - x[i - 2])
                    slope[i : i + 3] += np.array([-1.5, 2.0, -0.5]) / (x[i + 2] - x[i])
                factor = -0.5 * np.multiply.outer([slope, slope], normal)  # layer, node, axis
                factor[BACK, i] += along / self.sheet.thickness
                factor[FRONT, i] -= along / self.sheet.thickness
                order = np.argwhere(np.abs(factor) > SMALL * np.abs(factor).max()).tolist()
                order.sort(key=lambda one: one != [BACK, i, lead])
                yield [(int(line[j]), layer, axis, float(factor[layer, j, axis]))
                       for layer, j, axis in order]  # fmt: skip

    def _straight(self) -> Iterator[list[Term]]:
        for node in sorted({node for _, line in self._lines() for node in line[::2].tolist()}):
            for axis in range(3):
                yield [(node, layer, axis, c)
                       for layer, c in ((MIDDLE, 1.0), (FRONT, -0.5), (BACK, -0.5))]  # fmt: skip

    def _springs(self) -> Iterator[str]:
        """Further nodes, whose displacement along x is the turn that opens a crease."""
        share, length = self._creases()
        number, turn = sum(len(own.cells()) for own in self.panels), 3 * len(self._points)
        for c, (low, high) in enumerate(self.pattern.creases.tolist()):
            along = (self.pattern.vertices[high] - self.pattern.vertices[low]) / length[c]
            both = [self._edge(p, low, high) for p in self.pattern.crease_faces[c].tolist()]
            for pair, stiffness in zip(
                np.transpose(both).tolist(), self.stiffness[c] * share[c] / length[c], strict=True
            ):
                number, turn = number + 1, turn + 1
                yield from ("*NODE, NSET=TURNS", _line(turn, *self._points[pair[0]].tolist()))
                terms = []
                for node, sign in zip(pair, (1.0, -1.0), strict=True):
                    inward = sign * np.cross(self._normal[node], along) / self.sheet.thickness
                    inward[np.abs(inward) < SMALL * np.abs(inward).max()] = 0.0
                    for layer, side in ((BACK, 1.0), (FRONT, -1.0)):
                        terms += [(node, layer, k, side * inward[k]) for k in inward.nonzero()[0]]
                yield from self._equation(terms, f"{turn}, 1, 1.0")
                yield from (f"*ELEMENT, TYPE=SPRING1, ELSET=SPRING_{number}", _line(number, turn))
                yield from (f"*SPRING, ELSET=SPRING_{number}", "1", _line(float(stiffness)))

    def _equation(self, terms: Iterable[Term], first: str = "") -> Iterator[str]:
        texts = [first] if first else []
        texts += [_line(self._number(m, layer), k + 1, float(c)) for m, layer, k, c in terms]
        yield from ("*EQUATION", f"{len(texts)}")
        yield from (", ".join(texts[k : k + 4]) for k in range(0, len(texts), 4))


def _line(*values: Any) -> str:
    return ", ".join(f"{v:.12g}" if isinstance(v, float) else str(v) for v in values)
