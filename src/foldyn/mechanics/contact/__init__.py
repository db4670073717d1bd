"""Contact of a sheet with itself and with planes, for any model."""
