"""What a pattern is made of."""

from __future__ import annotations

from dataclasses import dataclass, fields

from foldyn.errors import InputError
from foldyn.values import length, number


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
            name, value = f"sheet: {field.name}", getattr(self, field.name)
            if value is None and field.name == "density":
                continue
            if field.name == "thickness":
                checked = length(name, value)
            elif field.name == "poissons_ratio":
                checked = number(name, value)
                if not -1.0 < checked < 0.5:
                    raise InputError(
                        f"{name} = {checked}: must lie between -1 and 0.5, both excluded (0.5 "
                        "makes the bar areas infinite)"
                    )
            else:
                checked = number(name, value, above=0.0)
            object.__setattr__(self, field.name, checked)  # in double precision

    @property
    def bending_modulus(self) -> float:
        """E t^3 / (12 (1 - nu^2)), N m."""
        return self.youngs_modulus * self.thickness**3 / (12.0 * (1.0 - self.poissons_ratio**2))
