"""Superelements: panels as small shells, condensed onto shapes of their edges."""

from foldyn.condensation.structure import Superelements, SuperelementsOptions, superelements

__all__ = ["Superelements", "SuperelementsOptions", "superelements"]
