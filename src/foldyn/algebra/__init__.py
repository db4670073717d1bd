"""Linear solvers of all analyses: sparse symmetric and banded factorizations, and their choice."""
