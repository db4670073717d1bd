"""Exact gradients of what Foldyn computes, with respect to a design's parameters."""
