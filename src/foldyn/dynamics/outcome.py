"""How a stretch of compiled steps ended."""

DONE = 0
NOT_FINITE = 1
PENETRATION = 2
FULL = 3  # no room for another sample
STUCK = 4  # the error asks for a step that time cannot resolve
NOT_CONVERGED = 5  # the equations of an implicit step were not solved, however small the step
