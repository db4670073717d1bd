"""What checks the package beyond its tests, by long computations whose results are stored here.

Run from the root of a clone, as `python -m verification.fidelity`. Nothing here is installed.
"""
