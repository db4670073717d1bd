"""Herkal, Nagarajaiah and Paulino: Dynamic behavior of origami structures."""
