"""What implicit integrators share: Newton's method in each step, its matrix, the step control."""
