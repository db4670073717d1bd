from foldyn.attractors.diagram import bifurcation_diagram as bifurcation_diagram
from foldyn.attractors.grid import basins as basins
from foldyn.attractors.nearby import lyapunov_exponent as lyapunov_exponent
from foldyn.attractors.section import poincare_section as poincare_section
from foldyn.attractors.sweep import swept_sine as swept_sine

__all__: list[str]
