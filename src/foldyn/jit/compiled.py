"""The decorators of compiled functions: nothing else in the package calls Numba's own.

What they compile is kept on disk (`kept`) and stands alone: each function runs its own copies of
the functions that it calls. Numba links a function's callees into its module and optimizes them
there once more, but leaves these copies weak: they give way to any function of the same name that
the process has loaded before. So which of two versions ran, equal but for rounding, would depend on
what had been compiled or loaded earlier: a run that compiles would differ in the last bit from one
that loads the same kernels from disk. Here the copies that are left after optimizing are private
to the module.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

from llvmlite.binding import Linkage
from numba import cfunc, njit
from numba.core.codegen import JITCodeLibrary
from numba.core.compiler import Compiler

from foldyn.jit.kernel_cache import Kept

# fused multiply-adds are the only liberty taken: NaN must survive
_FUSED = {"contract"}


class AloneLibrary(JITCodeLibrary):
    """The machine code of one compiled function, with private copies of those it calls.

    One that only compiled functions call is never run itself: it has no machine code.
    """

    called_alone = False  # whether only compiled functions call it

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
            if self.called_alone:
                function.linkage = Linkage.available_externally
        self._shared_module = shared
        super()._finalize_final_module()


class Alone(Compiler):
    """Numba's compiler, with such a library."""

    def compile_extra(self, func: Any) -> Any:
        """Compile a Python function."""
        self.state.library = AloneLibrary(self.state.targetctx.codegen(), func.__qualname__)
        self.state.library.enable_object_caching()
        flags = self.state.flags
        self.state.library.called_alone = flags.no_cpython_wrapper and flags.no_cfunc_wrapper
        return super().compile_extra(func)


def _decorator(*, inner: bool = False, **options: Any) -> Callable[..., Any]:
    """Decorator of compiled functions.

    inner : for calls from compiled functions alone. What Python calls takes its arguments apart
        first, which is more code than most functions that get a whole model.
    """
    # error_model="numpy": a division by zero gives inf or nan (looked for by the solvers) instead
    # of a branch in every loop
    # nothing calls by address what has a name here; but without Numba's wrapper for that LLVM puts
    # the function into the one for Python, which counts references: contact took twice as long
    options |= {"no_cpython_wrapper": inner, "no_cfunc_wrapper": inner}
    compiled = njit(error_model="numpy", pipeline_class=Alone, **options)

    def decorate(function: Callable[..., Any]) -> Any:
        dispatcher: Any = compiled(function)
        dispatcher._cache = Kept(function)  # as njit(cache=True) sets Numba's own
        if inner:
            _shut(dispatcher)
        return dispatcher

    return decorate


def _shut(dispatcher: Any) -> None:
    """Refuse calls from Python, which would end the process: there is nothing to call."""

    def add(result: Any) -> None:
        dispatcher.overloads[tuple(result.signature.args)] = result

    def refuse(*_: Any, **__: Any) -> None:
        raise TypeError(f"{dispatcher.__name__} is for compiled functions; Python cannot call it")

    dispatcher.add_overload, dispatcher._compile_for_args = add, refuse


kernel = _decorator(fastmath=_FUSED)
# the same, and part of each compiled function that calls it: optimized there alone
inlined = _decorator(fastmath=_FUSED, inline="always")
# only called by kernels
inner = _decorator(fastmath=_FUSED, inner=True)
# laws and other small formulas: inlined into the kernels that call them
scalar = _decorator(fastmath=_FUSED, forceinline=True)
inner_scalar = _decorator(fastmath=_FUSED, forceinline=True, inner=True)
# sums whose order does not matter: in any order they can be vectorized; NaN survives here too
summing = _decorator(fastmath=_FUSED | {"reassoc"})
# without Python's lock: for functions that threads run together
shared = _decorator(fastmath=_FUSED, nogil=True)
# the arithmetic as it is written: pictures
strict = _decorator()
strict_inlined = _decorator(inline="always")


class Addressed:
    """A function of one signature that compiled code calls by its address, kept on disk.

    Its first argument is the address of a context, whose type decides what is compiled. Addresses
    reach their callers as data, and differ in every process. No exception leaves such a function,
    and it allocates nothing: where something is wrong it returns nan.

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
        """The address in this process for the type of a `Context`."""
        kinds = (context.kind, *self._signature)
        if kinds not in self._dispatcher.overloads:
            self._dispatcher.compile(kinds)
        made = self._dispatcher.overloads[kinds]
        return made.library.get_pointer_to_function(made.fndesc.llvm_cfunc_wrapper_name)


def addressed(*signature: Any) -> Callable[[Callable[..., Any]], Addressed]:
    """Decorator of functions that are called by their address; see `Addressed`."""
    return lambda function: Addressed(function, signature)


def callback(signature: str, function: Callable[..., Any]) -> Any:
    """Compile a user's function, to be called by its address; it is not kept on disk."""
    # a division by zero gives inf or nan here too: an exception cannot leave through an address
    return cfunc(signature, error_model="numpy")(function)


def ready(function: Any) -> bool:
    """Whether a compiled function is kept on disk (else its first use compiles)."""
    return function._cache.ready()
