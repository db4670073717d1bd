"""What compiles: the decorators of kernels, and how compiled kernels are kept and known again.

Importing this package starts Numba, with one clear message where its variables forbid that; so what
needs Numba imports from here before anything from Numba itself is used.
"""

from foldyn.jit.start import start

start()
