"""Superelements: panels condensed from small shells."""

from foldyn.superelements.structure import Superelements, SuperelementsOptions, superelements

__all__ = ["Superelements", "SuperelementsOptions", "superelements"]
