"""Generators of common patterns, each in a file of its own."""
