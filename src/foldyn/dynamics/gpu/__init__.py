"""Motions on a GPU: kernels of explicit methods, their inputs, and the code that runs them."""
