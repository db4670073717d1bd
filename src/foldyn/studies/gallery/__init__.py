"""Motions to look at: a self-deploying sheet, and one that tumbles in free flight."""
