"""Linear solvers of all analyses: sparse symmetric and banded factorizations; which one to use."""
