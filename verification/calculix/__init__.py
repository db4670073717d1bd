"""Folded sheets as solids in CalculiX."""
