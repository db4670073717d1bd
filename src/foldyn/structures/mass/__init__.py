"""Mass rules: how the mass of panels is distributed to nodes, one rule a file.

A rule takes a `Surface` and returns the nodal mass matrix (n, n), kg; one value serves the three
axes. `MASS_RULES` is the registry.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping

from scipy import sparse

from foldyn.errors import InputError
from foldyn.structures.mass.centroid import centroid
from foldyn.structures.mass.circumcenter import circumcenter
from foldyn.structures.mass.consistent import consistent
from foldyn.structures.mass.equi_inertial import equi_inertial, equi_inertial_acute
from foldyn.structures.mass.inertia import rotational_inertia, rotational_inertia_errors
from foldyn.structures.mass.inertia_exact import inertia_exact
from foldyn.structures.mass.mixed_voronoi import mixed_voronoi
from foldyn.structures.mass.panel import panel
from foldyn.structures.mass.surface import Surface

MASS_RULES: Mapping[str, Callable[[Surface], sparse.csr_array]] = {
    "equi_inertial": equi_inertial,
    "equi_inertial_acute": equi_inertial_acute,
    "panel": panel,
    "centroid": centroid,
    "circumcenter": circumcenter,
    "consistent": consistent,
    "mixed_voronoi": mixed_voronoi,
    "inertia_exact": inertia_exact,
}


def check_mass_rule(name: str) -> None:
    """Refuse a rule that does not exist."""
    if not isinstance(name, str) or name not in MASS_RULES:
        raise InputError(f"mass = {name!r}: choose one of {', '.join(MASS_RULES)}")


__all__ = [
    "MASS_RULES",
    "Surface",
    "check_mass_rule",
    "rotational_inertia",
    "rotational_inertia_errors",
]
