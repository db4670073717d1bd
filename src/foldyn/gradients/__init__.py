"""Exact gradients of what Foldyn computes, with respect to a design's parameters."""

from foldyn.gradients.sensitivity import sensitivity

__all__ = ["sensitivity"]
