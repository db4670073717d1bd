"""What is about compiling: decorators of kernels, kernels on disk, what kernels do below Python.

Importing this package starts Numba, with one clear message where its variables forbid that; so what
needs Numba imports from here before anything from Numba itself is used.
"""

from foldyn.jit.start import start

start()
