"""Parts that implicit integrators share: Newton's method, its matrix, and the step control."""
