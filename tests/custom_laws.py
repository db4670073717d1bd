"""A law of one's own that several tests take."""

from __future__ import annotations

import foldyn as fd

CUBIC = fd.CustomHingeLaw(
    energy_of=lambda t, r: 0.5 * (t - r) ** 2 + 0.25 * (t - r) ** 4,
    moment_of=lambda t, r: (t - r) + (t - r) ** 3,
    slope_of=lambda t, r: 1.0 + 3.0 * (t - r) ** 2,
    name="cubic",
)
