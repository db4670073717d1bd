"""How a stretch of compiled steps ended."""

DONE = 0
NOT_FINITE = 1
PENETRATION = 2
