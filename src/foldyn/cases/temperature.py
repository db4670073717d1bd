"""`Temperature`: panels that stretch and curl as they are warmed."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Annotated, Any

import numpy as np
from numpy.typing import NDArray

from foldyn.arguments import Check, Key
from foldyn.cases.decode import Factor
from foldyn.cases.history import STEADY
from foldyn.cases.load import Load
from foldyn.cases.regions import Panels, resolve_panels
from foldyn.errors import InputError
from foldyn.mechanics.following import Following
from foldyn.structures import Laminate
from foldyn.structures.laminate import check_layers
from foldyn.structures.swelling import Swelling
from foldyn.values import number

MOST_STRAIN = 0.2  # free strain beyond which the laws of the sheet say nothing


@dataclass(frozen=True)
class Temperature(Load):
    """Panels that are warmer than at rest, times a history.

    Free panels would stretch by `expansion` times the change, and curl towards their front by
    `curvature` times it, without any stress; where they may not, they push. Other causes of free
    strains act in the same way: moisture, growth, a swelling gel.

    Bars and hinges get the rest angles of a paraboloid of that curvature; both models are exact for
    small slopes. Between the factors 0 and 1 the free strain is proportional to the factor to the
    first order in the strain.

    Parameters
    ----------
    change : float
        Change of the temperature, K, at factor 1.
    expansion : float
        Free strain per kelvin, 1/K.
    curvature : float
        Free curvature per kelvin, 1/(m K), positive where the sheet bends as at a valley.
    panels : int, sequence of int, or "all"
        Panels by number; all by default.
    layers : sequence of (float, float, float), optional
        Instead of expansion and curvature: thickness (m), Young's modulus (Pa) and expansion (1/K)
        of bonded layers from the back to the front, as of `Laminate`. The stiffness of the panels
        stays that of their sheet; `Laminate.sheet` gives the one that fits the layers.
    history : History or callable, optional
        Factor of time; constant by default.
    """

    change: Annotated[float, Check(number, unit="K"), Key("temperature")]
    expansion: Annotated[float | None, Check(number, unit="1/K")] = None
    curvature: Annotated[float | None, Check(number, unit="1/(m K)")] = None
    panels: Panels = "all"
    layers: Annotated[Sequence[Sequence[float]] | None, Check(check_layers)] = None
    history: Factor = STEADY

    apart = "a temperature acts on panels"

    def agree(self) -> None:
        """Ask for what says how the panels deform, and refuse strains that are too large."""
        given = self.given("expansion", "curvature")
        if self.layers is not None and given:
            raise InputError(f": the layers give the {given[0]}; leave it out", given[0])
        if self.layers is None and not given:
            raise InputError(
                ": give expansion (1/K), curvature (1/(m K)), or both, or the layers", "expansion"
            )
        strain = self.change * self._per_kelvin[0]
        if abs(strain) > MOST_STRAIN:
            raise InputError(
                f" = {self.change:g}: a free strain of {strain:.3g}; the laws of the sheet hold "
                f"up to about {MOST_STRAIN:g}: check the units (K, 1/K)",
                "change",
            )

    @property
    def _per_kelvin(self) -> tuple[float, float]:
        """Expansion (1/K) and curvature (1/(m K))."""
        if self.layers is not None:
            laminate = Laminate(self.layers)
            return laminate.expansion, laminate.curvature
        return self.expansion or 0.0, self.curvature or 0.0

    def swelling(self, structure: Any, place: str) -> Swelling:
        """See `Load`."""
        if structure.pattern is None:
            raise InputError(f"{place}: this structure has no pattern with panels")
        chosen = np.zeros(len(structure.pattern.faces))
        triangles = resolve_panels(structure, self.panels, f"{place}.panels")
        chosen[structure.triangle_panel[triangles]] = self.change
        expansion, curvature = self._per_kelvin
        return structure.swollen(chosen * expansion, chosen * curvature)

    def following(self, structure: Any, place: str) -> Following:
        """See `Load`."""
        return self.swelling(structure, place).forces

    def turns(self, structure: Any, place: str) -> NDArray[np.float64]:
        """See `Load`."""
        return self.swelling(structure, place).turns
