"""Sheets on which bars and hinges are less accurate, or once were: one of each kind.

They supplement the mixed sets: `references` stores their shell results, `mixed_models` compares
models.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import Any

from foldyn.patterns import Pattern
from foldyn.structures import PanelSheet, Sheet
from foldyn.studies.fidelity.cases import Held, polygons, supports
from foldyn.studies.fidelity.mixed import MixedCase

PLASTIC = Sheet(3e9, 0.35, 3e-4, density=1380.0, length_scale_ratio=4.0)
THICK = replace(PLASTIC, thickness=1e-3)
MIURA = {"cells": (2, 2), "a": 0.04, "b": 0.04, "panel_angle": 60, "dihedral": 110}
TOWER = {"sides": 6, "radius": 0.04, "height": 0.06, "twist": 30, "storeys": 1}


@dataclass(frozen=True)
class Gap(MixedCase):
    """A named case.

    Attributes
    ----------
    told : str
        What it represents.
    clamped : bool
        Whether the held edge is clamped.
    """

    told: str = ""
    clamped: bool = False

    @property
    def name(self) -> str:
        """What it represents."""
        return self.told

    def pattern(self) -> Pattern:
        """See `FidelityCase`."""
        return polygons(**self.shape) if self.kind == "polygons" else super().pattern()

    @property
    def held(self) -> Held:
        """See `FidelityCase`."""
        panel = self.support == "panel"
        return supports(self.kind, self.shape)["panel"] if panel else super().held

    @property
    def options(self) -> Mapping[str, Any]:
        """See `FidelityCase`."""
        return {"clamped": self.held.edges} if self.clamped else {}


def gaps() -> list[Gap]:
    """All gap cases: sheets of 0.3 mm and panels of 40 mm unless their names say otherwise."""
    patched = replace(PLASTIC, panels=[PanelSheet(list(range(0, 16, 2)), thickness=1e-3)])
    cells = {"cells": (3, 3)}
    return [
        _sheet("1 x 1 cells, free", {"cells": (1, 1)}, "free"),
        _sheet("1 x 1 cells, one edge held", {"cells": (1, 1)}),
        _sheet("panels 4 times as long as wide", {"b": 0.16}),
        _sheet("panels 8 times as long as wide", {"b": 0.32}),
        _sheet("skew panels, 30 degrees", {"panel_angle": 30}),
        _sheet("skew panels, 20 degrees", {"panel_angle": 20}),
        _sheet("nearly flat, 176 degrees", {"dihedral": 176}),
        _sheet("one edge clamped, 3 x 3 cells", cells, clamped=True),
        _sheet("two edges held, 3 x 3 cells", cells, "two edges"),
        _sheet("the same, 1 mm", cells, "two edges", THICK),
        _sheet("every other panel 1 mm", {}, sheet=patched),
        Gap("polygons", {"sides": 6, "edge": 0.04}, "panel", PLASTIC, "two hexagons, one held"),
        Gap("kresling", TOWER, "one edge", PLASTIC, "Kresling cell"),
        Gap("kresling", TOWER, "one edge", THICK, "Kresling cell, 1 mm"),
        Gap("kresling", {**TOWER, "storeys": 4}, "one edge", PLASTIC, "Kresling tower, 4 storeys"),
    ]


def _sheet(
    told: str,
    shape: Mapping[str, Any],
    support: str = "one edge",
    sheet: Sheet = PLASTIC,
    clamped: bool = False,
) -> Gap:
    """A Miura-ori."""
    return Gap("miura", {**MIURA, **shape}, support, sheet, told, clamped)
