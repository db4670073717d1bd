"""The same force and RK4 loop in JAX, compiled whole, double precision, on one CPU core."""

from __future__ import annotations

import time
from functools import partial
from typing import Any

import numpy as np
from numpy.typing import NDArray
from problem import ENHANCED, SUPERLINEAR, Problem, Run

try:
    import jax
    import jax.numpy as jnp
except ImportError:
    jax = None


def absent() -> bool:
    """Whether JAX is not installed."""
    return jax is None


def _cross(a: Any, b: Any) -> tuple:
    return a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]


def _dot(a: Any, b: Any) -> Any:
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]


def _difference(a: Any, b: Any) -> tuple:
    return tuple(p - q for p, q in zip(a, b, strict=True))


def _moment(theta: Any, rest: Any, run: Run) -> Any:
    d = theta - rest
    if run.law == SUPERLINEAR:
        return jnp.abs(d) * jnp.cbrt(d)
    if run.law == ENHANCED:
        edge = jnp.clip(theta, run.theta1, run.theta2)
        low, high = 0.5 * np.pi / run.theta1, 0.5 * np.pi / (2.0 * np.pi - run.theta2)
        half_p = jnp.where(theta < run.theta1, low, high)
        return edge - rest + jnp.tan(half_p * (theta - edge)) / half_p
    return d


def _force(u: tuple, a: dict, runs: tuple[Run, ...]) -> tuple:
    """Internal force, three arrays (n,), at the displacement u, three arrays (n,)."""

    def at(x: tuple, nodes: Any) -> tuple:
        return tuple(component[nodes] for component in x)

    du = _difference(at(u, a["bars"][1]), at(u, a["bars"][0]))
    vector = a["bar_vector"]
    x = _dot(du, tuple(2.0 * w + d for w, d in zip(vector, du, strict=True)))
    x = x * a["bar_per_length2"]
    e = x / (1.0 + jnp.sqrt(1.0 + x))
    t = a["bar_stiffness"] * 0.25 * e * (4.0 + e * (6.0 + e * (4.0 + e))) / (1.0 + e)

    position = tuple(r + d for r, d in zip(a["rest"], u, strict=True))
    j, k, i, l = (at(position, nodes) for nodes in a["hinges"])  # noqa: E741
    b, r, s = _difference(k, j), _difference(i, j), _difference(k, l)
    m, n = _cross(r, b), _cross(b, s)
    bb, mm, nn = _dot(b, b), _dot(m, m), _dot(n, n)
    length = jnp.sqrt(bb)
    theta = jnp.pi + jnp.arctan2(-length * _dot(r, n), -_dot(m, n))
    rest = a["hinge_rest"]
    value = jnp.concatenate(
        [_moment(theta[q.start : q.end], rest[q.start : q.end], q) for q in runs]
    )
    moment = a["hinge_stiffness"] * (value - a["hinge_offset"])
    rho, sigma = _dot(r, b) / bb, _dot(s, b) / bb
    fi, fl = moment * length / mm, -moment * length / nn
    zero, out = jnp.zeros(1), []
    for c in range(3):
        pull = t * (vector[c] + du[c])
        gi, gl = fi * m[c], fl * n[c]
        gj, gk = (rho - 1.0) * gi - sigma * gl, (sigma - 1.0) * gl - rho * gi
        parts = jnp.concatenate([-pull, pull, gj, gk, gi, gl, zero])
        out.append(parts[a["touching"]].sum(axis=0))
    return tuple(out)


def _march(start: Any, a: dict, runs: tuple[Run, ...], dt: float, steps: Any) -> Any:
    def acceleration(u: tuple, v: tuple) -> tuple:
        force = _force(u, a, runs)
        return tuple(
            (p - f) * w - a["alpha"] * q
            for p, f, w, q in zip(a["load"], force, a["inverse_mass"], v, strict=True)
        )

    def ahead(x: tuple, h: float, rate: tuple) -> tuple:
        return tuple(p + h * q for p, q in zip(x, rate, strict=True))

    def mean(x: tuple, *k: tuple) -> tuple:
        return tuple(
            p + dt / 6.0 * (a1 + 2.0 * (a2 + a3) + a4)
            for p, a1, a2, a3, a4 in zip(x, *k, strict=True)
        )

    def step(_: Any, state: tuple) -> tuple:
        u, v = state
        a1 = acceleration(u, v)
        v2 = ahead(v, 0.5 * dt, a1)
        a2 = acceleration(ahead(u, 0.5 * dt, v), v2)
        v3 = ahead(v, 0.5 * dt, a2)
        a3 = acceleration(ahead(u, 0.5 * dt, v2), v3)
        v4 = ahead(v, dt, a3)
        a4 = acceleration(ahead(u, dt, v3), v4)
        return mean(u, v, v2, v3, v4), mean(v, a1, a2, a3, a4)

    return jax.lax.fori_loop(0, steps, step, (start, tuple(jnp.zeros_like(x) for x in start)))


class JaxTwin:
    """Force and motion of one problem."""

    name = "JAX"

    def __init__(self, problem: Problem) -> None:
        jax.config.update("jax_enable_x64", True)
        self.problem = p = problem

        def columns(array: NDArray) -> tuple:
            return tuple(jnp.asarray(np.ascontiguousarray(column)) for column in array.T)

        self._arrays = {
            "touching": jnp.asarray(_touching(p)),
            "alpha": p.case.damping.alpha,
            **{name: columns(getattr(p, name).astype(np.int32)) for name in ("bars", "hinges")},
            **{
                name: columns(getattr(p, name))
                for name in ("rest", "bar_vector", "load", "inverse_mass")
            },
            **{
                name: jnp.asarray(getattr(p, name))
                for name in (
                    "bar_per_length2",
                    "bar_stiffness",
                    "hinge_stiffness",
                    "hinge_rest",
                    "hinge_offset",
                )
            },
        }
        self._force = jax.jit(partial(_force, runs=p.runs))
        self._march = jax.jit(partial(_march, runs=p.runs, dt=p.dt))
        self._start = columns(p.start)
        self._columns = columns

    def force(self, u: NDArray) -> NDArray:
        """Internal force (n, 3) at displacement u (n, 3)."""
        return np.stack(self._force(self._columns(u), self._arrays), -1)

    def run(self, steps: int) -> tuple[float, NDArray]:
        """Seconds for `steps` RK4 steps from the start, and the displacement then."""
        began = time.perf_counter()
        u, _ = jax.block_until_ready(self._march(self._start, self._arrays, steps=steps))
        return time.perf_counter() - began, np.stack(u, -1)


def _touching(p: Problem) -> NDArray:
    """Rows of contributions to each node (most, n), filled up with the number of the zero row.

    Contributions stand as first and second ends of all bars, then j, k, i, l of all hinges.
    """
    nodes = np.concatenate([p.bars.T.ravel(), p.hinges.T.ravel()]).astype(np.int64)
    by_node = np.argsort(nodes, kind="stable")
    counts = np.bincount(nodes, minlength=len(p.rest))
    first = np.concatenate([[0], np.cumsum(counts)[:-1]])
    table = np.full((counts.max(), len(p.rest)), len(nodes), np.int32)
    of = nodes[by_node]
    table[np.arange(len(nodes)) - first[of], of] = by_node
    return table
