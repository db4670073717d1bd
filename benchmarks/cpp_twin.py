"""The C++ twin, called through ctypes."""

from __future__ import annotations

import ctypes
from ctypes import POINTER, Structure, byref, c_double, c_int64, c_uint32

import numpy as np
from numpy.typing import NDArray
from problem import Problem

KINDS = {"C++": 0, "C++ from lengths": 1, "C++ AVX-512": 2, "C++ AVX-512 from lengths": 3}
_doubles, _indices = POINTER(c_double), POINTER(c_uint32)


class _Run(Structure):
    _fields_ = (
        ("start", c_int64), ("end", c_int64), ("law", c_int64),
        ("theta1", c_double), ("theta2", c_double),
    )  # fmt: skip


class _Model(Structure):
    _fields_ = (
        ("nodes", c_int64), ("bars", c_int64), ("hinges", c_int64), ("runs", c_int64),
        ("rest", _doubles), ("bar", _indices), ("bar_vector", _doubles),
        ("bar_per_length2", _doubles), ("bar_stiffness", _doubles), ("hinge", _indices),
        ("hinge_stiffness", _doubles), ("hinge_rest", _doubles), ("hinge_offset", _doubles),
        ("run", POINTER(_Run)), ("inverse_mass", _doubles), ("load", _doubles),
        ("alpha", c_double),
    )  # fmt: skip


def load(path: str) -> ctypes.CDLL:
    """Open the compiled twin and declare its functions."""
    library = ctypes.CDLL(path)
    for name in ("twin_integrate", "twin_force", "probe_triad", "probe_flop"):
        getattr(library, name).restype = c_double
    return library


def kinds(library: ctypes.CDLL) -> list[str]:
    """Names of the kernels that this machine can run."""
    wide = bool(library.twin_has_avx512())
    return [name for name in KINDS if wide or "AVX-512" not in name]


def aligned(array: NDArray) -> NDArray:
    """Copy that starts at a multiple of 64 bytes."""
    room = np.empty(array.nbytes + 64, np.uint8)
    shift = -room.ctypes.data % 64
    out = room[shift : shift + array.nbytes].view(array.dtype).reshape(array.shape)
    out[...] = array
    return out


class CppTwin:
    """One of the C++ kernels on one problem."""

    def __init__(self, problem: Problem, library: ctypes.CDLL, name: str) -> None:
        self.problem, self.library, self.name = problem, library, name
        self.kind = c_int64(KINDS[name])
        self.stride = 4 if "AVX-512" in name else 3
        runs = (_Run * len(problem.runs))(*[_Run(*run) for run in problem.runs])
        arrays = {
            "rest": self._padded(problem.rest),
            "bar": problem.bars,
            "bar_vector": problem.bar_vector.T,
            "bar_per_length2": problem.bar_per_length2,
            "bar_stiffness": problem.bar_stiffness,
            "hinge": problem.hinges,
            "hinge_stiffness": problem.hinge_stiffness,
            "hinge_rest": problem.hinge_rest,
            "hinge_offset": problem.hinge_offset,
            "inverse_mass": self._padded(problem.inverse_mass),
            "load": self._padded(problem.load),
        }
        arrays = {name: aligned(np.ascontiguousarray(array)) for name, array in arrays.items()}
        self._keep = (runs, arrays)  # the structure below holds addresses only
        pointers = {
            name: array.ctypes.data_as(_indices if array.dtype == np.uint32 else _doubles)
            for name, array in arrays.items()
        }
        self.model = _Model(
            nodes=len(problem.rest), bars=len(problem.bars), hinges=len(problem.hinges),
            runs=len(problem.runs), run=runs, alpha=problem.case.damping.alpha, **pointers,
        )  # fmt: skip

    def _padded(self, array: NDArray) -> NDArray:
        out = np.zeros((len(array), self.stride))
        out[:, :3] = array
        return out

    def force(self, u: NDArray) -> NDArray:
        """Internal force (n, 3) at displacement u (n, 3)."""
        state = aligned(self._padded(u))
        out = aligned(np.zeros_like(state))
        self.library.twin_force(
            self.kind, byref(self.model), c_int64(1), state.ctypes.data_as(_doubles),
            out.ctypes.data_as(_doubles),
        )  # fmt: skip
        return out[:, :3].copy()

    def force_seconds(self, times: int) -> float:
        """Seconds for one evaluation of the force at the start, mean of `times`."""
        state = aligned(self._padded(self.problem.start))
        out = aligned(np.zeros_like(state))
        return self.library.twin_force(
            self.kind, byref(self.model), c_int64(times), state.ctypes.data_as(_doubles),
            out.ctypes.data_as(_doubles),
        ) / times  # fmt: skip

    def run(self, steps: int) -> tuple[float, NDArray]:
        """Seconds for `steps` RK4 steps from the start, and the displacement then."""
        u = aligned(self._padded(self.problem.start))
        v = aligned(np.zeros_like(u))
        seconds = self.library.twin_integrate(
            self.kind, byref(self.model), c_int64(steps), c_double(self.problem.dt),
            u.ctypes.data_as(_doubles), v.ctypes.data_as(_doubles),
        )  # fmt: skip
        return seconds, u[:, :3].copy()


def flop_peak(library: ctypes.CDLL) -> float:
    """Flop per second of fused multiply-adds on one core, best of twenty."""
    return max(library.probe_flop(c_int64(5_000_000)) for _ in range(20))


def bandwidth(library: ctypes.CDLL, size: int) -> float:
    """Bytes per second of a triad on arrays of `size` bytes in all, on one core."""
    n = max(size // 24, 512)
    arrays = [aligned(np.ones(n)) for _ in range(3)]
    pointers = [array.ctypes.data_as(_doubles) for array in arrays]
    return library.probe_triad(c_int64(n), c_int64(20), *pointers)
