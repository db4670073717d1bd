"""Where long motions end: sweeps and their jumps, sections, exponents, basins of attraction."""

from foldyn.attractors.diagram import bifurcation_diagram
from foldyn.attractors.grid import basins
from foldyn.attractors.nearby import lyapunov_exponent
from foldyn.attractors.section import poincare_section
from foldyn.attractors.sweep import swept_sine

__all__ = [
    "basins",
    "bifurcation_diagram",
    "lyapunov_exponent",
    "poincare_section",
    "swept_sine",
]
