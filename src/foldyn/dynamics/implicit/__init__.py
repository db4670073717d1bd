"""Parts shared by implicit integrators: Newton's method, its matrix, the step control."""
