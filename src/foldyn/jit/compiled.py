"""Decorators of compiled functions; only this module calls Numba's `njit` and `cfunc`.

Compiled functions are stored on disk (`kernel_cache`) and self-contained: each function runs its
own copies of the functions that it calls. Numba links copies of a function's callees into its
module and optimizes them there again, but leaves these copies weak: a function of the same name
that the process has loaded before replaces them. So which of two versions runs, equal except for
rounding, would depend on what was compiled or loaded earlier: a run that compiles would differ in
the last bit from a run that loads the same kernels from disk. Here the copies that remain after
optimization are private to the module.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

from llvmlite.binding import Linkage
from numba import cfunc, njit
from numba.core.codegen import JITCodeLibrary
from numba.core.compiler import Compiler

from foldyn.jit.kernel_cache import Kept

# of all fast-math options, only fused multiply-adds: NaN must survive
_FUSED = {"contract"}


class AloneLibrary(JITCodeLibrary):
    """Machine code of one compiled function, with private copies of its callees.

    A function that only compiled functions call is never run itself and has no machine code.
    """

    called_alone = False  # whether only compiled functions call it

    def _finalize_final_module(self) -> None:
        # callers link Numba's usual version, which equal functions may replace
        shared = self._final_module.clone()
        for function in self._final_module.functions:
            if function.is_declaration:
                continue
            if function.linkage == Linkage.external:  # the function itself and its wrappers
                shared.get_function(function.name).linkage = Linkage.linkonce_odr
            elif function.linkage == Linkage.linkonce_odr:  # copies of its callees
                function.linkage = Linkage.internal
            if self.called_alone:
                function.linkage = Linkage.available_externally
        self._shared_module = shared
        super()._finalize_final_module()


class Alone(Compiler):
    """Numba's compiler with `AloneLibrary`."""

    def compile_extra(self, func: Any) -> Any:
        """Compile a Python function."""
        self.state.library = AloneLibrary(self.state.targetctx.codegen(), func.__qualname__)
        self.state.library.enable_object_caching()
        flags = self.state.flags
        self.state.library.called_alone = flags.no_cpython_wrapper and flags.no_cfunc_wrapper
        return super().compile_extra(func)


def _decorator(*, inner: bool = False, **options: Any) -> Callable[..., Any]:
    """Decorator of compiled functions.

    inner : for calls from compiled functions only. A function that Python calls needs code to
    unpack its arguments; if the argument is a whole model, most functions are shorter than this
    code.
    """
    # error_model="numpy": a division by zero gives inf or nan, which the solvers check for, instead
    # of needing a branch in every loop. No address of these functions is called; but without
    # Numba's wrapper for such calls, LLVM inlines them into the wrapper for Python, which counts
    # references: contact took twice as long
    options |= {"no_cpython_wrapper": inner, "no_cfunc_wrapper": inner}
    compiled = njit(error_model="numpy", pipeline_class=Alone, **options)

    def decorate(function: Callable[..., Any]) -> Any:
        dispatcher: Any = compiled(function)
        dispatcher._cache = Kept(function)  # like Numba's njit(cache=True)
        if inner:
            _shut(dispatcher)
        return dispatcher

    return decorate


def _shut(dispatcher: Any) -> None:
    """Refuse calls from Python, which would crash the process: there is no entry point."""

    def add(result: Any) -> None:
        dispatcher.overloads[tuple(result.signature.args)] = result

    def refuse(*_: Any, **__: Any) -> None:
        raise TypeError(f"{dispatcher.__name__} is for compiled functions; Python cannot call it")

    dispatcher.add_overload, dispatcher._compile_for_args = add, refuse


kernel = _decorator(fastmath=_FUSED)
# like `kernel`, but inlined into each compiled caller and optimized there
inlined = _decorator(fastmath=_FUSED, inline="always")
# called by kernels only
inner = _decorator(fastmath=_FUSED, inner=True)
# laws and other small formulas, inlined into their callers
scalar = _decorator(fastmath=_FUSED, forceinline=True)
inner_scalar = _decorator(fastmath=_FUSED, forceinline=True, inner=True)
# sums in any order, so that they vectorize; NaN survives here too
summing = _decorator(fastmath=_FUSED | {"reassoc"})
# without Python's lock: for functions that threads run together
shared = _decorator(fastmath=_FUSED, nogil=True)
# arithmetic exactly as written, for pictures
strict = _decorator()
strict_inlined = _decorator(inline="always")


class Addressed:
    """A function of one signature that compiled code calls by address, stored on disk.

    Its first argument is the address of a context, whose type determines the compiled version.
    Callers receive addresses as data; they differ in every process. Such a function raises no
    exception and allocates nothing: on errors it returns nan.

    Parameters
    ----------
    function : callable
    signature : Numba types of the arguments after the context
    """

    def __init__(self, function: Callable[..., Any], signature: tuple[Any, ...]) -> None:
        self._signature = signature
        options: dict[str, Any] = {"no_cpython_wrapper": True, "no_cfunc_wrapper": False}
        compiled = njit(error_model="numpy", pipeline_class=Alone, fastmath=_FUSED, **options)
        self._dispatcher: Any = compiled(function)
        self._dispatcher._cache = self._cache = Kept(function)
        _shut(self._dispatcher)

    def at(self, context: Any) -> int:
        """Address in this process for the type of a `Context`."""
        kinds = (context.kind, *self._signature)
        if kinds not in self._dispatcher.overloads:
            self._dispatcher.compile(kinds)
        made = self._dispatcher.overloads[kinds]
        return made.library.get_pointer_to_function(made.fndesc.llvm_cfunc_wrapper_name)


def addressed(*signature: Any) -> Callable[[Callable[..., Any]], Addressed]:
    """Decorator of functions that are called by address; see `Addressed`."""
    return lambda function: Addressed(function, signature)


def callback(signature: str, function: Callable[..., Any]) -> Any:
    """Compile a user's function for calls by address; it is not stored on disk."""
    # a division by zero gives inf or nan: an exception cannot leave through an address
    return cfunc(signature, error_model="numpy")(function)


def ready(function: Any) -> bool:
    """Whether a compiled function is stored on disk; otherwise its first use compiles it."""
    return function._cache.ready()
