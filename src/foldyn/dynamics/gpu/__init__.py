"""Motions on a GPU: the kernels of explicit methods, what they take, and what runs them."""
