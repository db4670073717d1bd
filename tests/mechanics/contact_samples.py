"""Sheets that touch themselves, for tests of contact."""

from __future__ import annotations

import numpy as np

import foldyn as fd
from foldyn.mechanics.contact.candidates import PLANE_COLUMNS, Sheets, Tables, tables
from foldyn.mechanics.contact.term import ContactTerm
from named_models import named

T = 0.24e-3
SHEET = fd.Sheet(
    youngs_modulus=1.219e9, poissons_ratio=0.2, thickness=T, density=690.0, length_scale_ratio=2.7
)
NO_HINGES = np.zeros((0, 4), np.int64)


def miura(dihedral: float, cells: int = 2, **options) -> fd.Structure:
    """A folded Miura sheet of paper."""
    pattern = fd.patterns.miura(
        cells=(cells, cells), a=0.02, b=0.02, panel_angle=60, dihedral=dihedral
    )
    return fd.discretize(pattern, SHEET, fold_law="linear", **named(options))


def sheets(nodes, triangles, panel, thickness: float, planes=(), friction=0.0) -> Sheets:
    """What may touch of some triangles, with a stiffness of 1 N/m."""
    count = int(np.max(panel)) + 1
    table = np.zeros((len(planes), PLANE_COLUMNS))
    for row, (point, normal, rough) in zip(table, planes, strict=True):
        row[:3], row[3:6], row[6], row[10] = point, normal, rough, -1
    return Sheets(
        np.array(nodes, float), np.array(triangles), np.array(panel),
        np.full(count, thickness), 1.0, True, friction, table, np.zeros(len(nodes), bool),
    )  # fmt: skip


def tables_of(structure: fd.Structure, thickness: float = T) -> Tables:
    """Tables of a structure without hinges."""
    own = sheets(structure.nodes, structure.triangles, structure.triangle_panel, thickness)
    return tables(own, NO_HINGES)


def touching(structure: fd.Structure, planes=(), thickness: float = T) -> ContactTerm:
    """Contact of a structure."""
    nodes, panel = structure.nodes, structure.triangle_panel
    return ContactTerm(sheets(nodes, structure.triangles, panel, thickness, planes), structure.body)
