"""Generators of common patterns, one per file."""
