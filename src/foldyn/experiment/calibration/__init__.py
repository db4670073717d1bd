"""Calibration: numbers of a case file found from measurements."""
