"""What a pattern is made of."""

from __future__ import annotations

import math
from dataclasses import dataclass, fields
from numbers import Real

from foldyn.errors import InputError


@dataclass(frozen=True)
class Sheet:
    """An isotropic elastic sheet.

    Parameters
    ----------
    youngs_modulus : float
        E (Pa), positive.
    poissons_ratio : float
        nu, -1 < nu < 0.5. N5B8 quadrilaterals need nu > 0: their spokes have an area
        proportional to nu.
    thickness : float
        t (m), positive.
    density : float, optional
        rho (kg/m3), positive. Needed for the mass; statics does without.
    length_scale_ratio : float, default 1
        L*/L_F, positive: the crease's softness in fold calibration; larger is softer.

    Raises
    ------
    InputError
        A value out of its range.
    """

    youngs_modulus: float
    poissons_ratio: float
    thickness: float
    density: float | None = None
    length_scale_ratio: float = 1.0

    def __post_init__(self) -> None:
        for field in fields(self):
            value = getattr(self, field.name)
            if value is None and field.name == "density":
                continue
            if isinstance(value, bool) or not isinstance(value, Real):
                raise InputError(f"sheet: {field.name} = {value!r}: give a number")
            value = float(value)
            if not math.isfinite(value):
                raise InputError(f"sheet: {field.name} = {value}: must be finite")
            if field.name == "poissons_ratio":
                if not -1.0 < value < 0.5:
                    raise InputError(
                        f"sheet: poissons_ratio = {value}: must lie between -1 and 0.5, both "
                        "excluded (0.5 makes the bar areas infinite)"
                    )
            elif value <= 0.0:
                raise InputError(f"sheet: {field.name} = {value}: must be greater than 0")
            object.__setattr__(self, field.name, value)  # in double precision
        g = self.bending_modulus
        if not (math.isfinite(g) and g > 1e-300):
            raise InputError(
                f"sheet: the bending stiffness E t^3 / 12(1 - nu^2) = {g} is out of range: check "
                f"youngs_modulus = {self.youngs_modulus:g} Pa and thickness = {self.thickness:g} m"
            )

    @property
    def bending_modulus(self) -> float:
        """E t^3 / (12 (1 - nu^2)), N m."""
        return self.youngs_modulus * self.thickness**3 / (12.0 * (1.0 - self.poissons_ratio**2))
