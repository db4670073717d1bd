"""Stresses of panels and moments of creases in given states, and their margins of safety."""
