"""Compiled functions that stand alone: each runs its own copies of the functions that it calls.

Numba links a function's callees into its module and optimizes them there once more, but leaves
these copies weak: they give way to any function of the same name that the process has loaded
before. So which of two versions ran, equal but for rounding, depended on what had been compiled or
loaded earlier: a run that compiled differed in the last bit from one that loaded the same kernels
from disk. Here the copies that are left after optimizing are private to the module.
"""

from __future__ import annotations

from typing import Any

from llvmlite.binding import Linkage
from numba.core.codegen import JITCodeLibrary
from numba.core.compiler import Compiler


class AloneLibrary(JITCodeLibrary):
    """The machine code of one compiled function."""

    def _finalize_final_module(self) -> None:
        # what callers link in: as Numba does it, where this function gives way to equal ones
        shared = self._final_module.clone()
        for function in self._final_module.functions:
            if function.is_declaration:
                continue
            if function.linkage == Linkage.external:  # the function itself and its wrappers
                shared.get_function(function.name).linkage = Linkage.linkonce_odr
            elif function.linkage == Linkage.linkonce_odr:  # copies of what it calls
                function.linkage = Linkage.internal
        self._shared_module = shared
        super()._finalize_final_module()


class Alone(Compiler):
    """Numba's compiler, with such a library."""

    def compile_extra(self, func: Any) -> Any:
        """Compile a Python function."""
        self.state.library = AloneLibrary(self.state.targetctx.codegen(), func.__qualname__)
        self.state.library.enable_object_caching()
        return super().compile_extra(func)
