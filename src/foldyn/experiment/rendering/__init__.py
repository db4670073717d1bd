"""Synthetic pictures: films and photographs of simulated motions and paths."""
