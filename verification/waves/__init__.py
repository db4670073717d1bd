"""Waves in periodic origami: bands of sheets, and impacts on chains of Kresling cells."""
