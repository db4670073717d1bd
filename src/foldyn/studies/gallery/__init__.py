"""Motions to look at: a self-deploying sheet, and a sheet that tumbles in free flight."""
