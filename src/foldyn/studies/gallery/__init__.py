"""Motions to look at: a sheet that deploys itself, and one that tumbles in free flight."""
