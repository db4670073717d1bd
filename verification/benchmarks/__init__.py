"""Benchmarks that engineers know; `python -m verification.table` prints them beside our numbers."""
