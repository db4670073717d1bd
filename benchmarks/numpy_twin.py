"""The same force and RK4 step in plain NumPy, whole arrays at a time."""

from __future__ import annotations

import time

import numpy as np
from numpy.typing import NDArray
from problem import ENHANCED, SUPERLINEAR, Problem, Run


def cross(a: NDArray, b: NDArray) -> NDArray:
    """Cross product of rows; np.cross is several times slower."""
    out = np.empty_like(a)
    out[:, 0] = a[:, 1] * b[:, 2] - a[:, 2] * b[:, 1]
    out[:, 1] = a[:, 2] * b[:, 0] - a[:, 0] * b[:, 2]
    out[:, 2] = a[:, 0] * b[:, 1] - a[:, 1] * b[:, 0]
    return out


def dot(a: NDArray, b: NDArray) -> NDArray:
    """Inner product of rows."""
    return np.einsum("ij,ij->i", a, b)


def enhanced(theta: NDArray, rest: NDArray, run: Run) -> NDArray:
    """Enhanced linear moment / k, as published."""
    value = theta - rest
    for beyond, edge, span in (
        (theta < run.theta1, run.theta1, run.theta1),
        (theta > run.theta2, run.theta2, 2.0 * np.pi - run.theta2),
    ):
        if beyond.any():
            half_p = 0.5 * np.pi / span
            value[beyond] = edge - rest[beyond] + np.tan(half_p * (theta[beyond] - edge)) / half_p
    return value


class NumpyTwin:
    """Force and motion of one problem."""

    name = "NumPy"

    def __init__(self, problem: Problem) -> None:
        self.problem = p = problem
        touched = np.concatenate([p.bars.T.ravel(), p.hinges.T.ravel()]).astype(np.int64)
        self._gather = np.argsort(touched, kind="stable")
        self._begin = np.searchsorted(touched[self._gather], np.arange(len(p.rest)))
        self._bars = p.bars.astype(np.int64)
        self._hinges = p.hinges.astype(np.int64)

    def force(self, u: NDArray) -> NDArray:
        """Internal force (n, 3) at displacement u (n, 3)."""
        p = self.problem
        du = u[self._bars[:, 1]] - u[self._bars[:, 0]]
        x = dot(du, 2.0 * p.bar_vector + du) * p.bar_per_length2
        e = x / (1.0 + np.sqrt(1.0 + x))
        stress = 0.25 * e * (4.0 + e * (6.0 + e * (4.0 + e))) / (1.0 + e)
        pull = (p.bar_stiffness * stress)[:, None] * (p.bar_vector + du)

        j, k, i, l = ((p.rest + u)[self._hinges[:, q]] for q in range(4))  # noqa: E741
        b, r, s = k - j, i - j, k - l
        m, n = cross(r, b), cross(b, s)
        bb, mm, nn = dot(b, b), dot(m, m), dot(n, n)
        length = np.sqrt(bb)
        theta = np.pi + np.arctan2(-length * dot(r, n), -dot(m, n))
        moment = theta - p.hinge_rest
        for run in p.runs:
            part = slice(run.start, run.end)
            if run.law == SUPERLINEAR:
                moment[part] = np.abs(moment[part]) * np.cbrt(moment[part])
            elif run.law == ENHANCED:
                moment[part] = enhanced(theta[part], p.hinge_rest[part], run)
        moment = p.hinge_stiffness * (moment - p.hinge_offset)
        rho, sigma = (dot(r, b) / bb)[:, None], (dot(s, b) / bb)[:, None]
        gi = (moment * length / mm)[:, None] * m
        gl = -(moment * length / nn)[:, None] * n
        gj, gk = (rho - 1.0) * gi - sigma * gl, (sigma - 1.0) * gl - rho * gi
        parts = np.concatenate([-pull, pull, gj, gk, gi, gl])
        return np.add.reduceat(parts[self._gather], self._begin)

    def acceleration(self, u: NDArray, v: NDArray) -> NDArray:
        """Acceleration (n, 3)."""
        p = self.problem
        return (p.load - self.force(u)) * p.inverse_mass - p.case.damping.alpha * v

    def run(self, steps: int) -> tuple[float, NDArray]:
        """Seconds for `steps` RK4 steps from the start, and the displacement then."""
        dt = self.problem.dt
        u, v = self.problem.start.copy(), np.zeros_like(self.problem.start)
        began = time.perf_counter()
        for _ in range(steps):
            a1 = self.acceleration(u, v)
            v2 = v + 0.5 * dt * a1
            a2 = self.acceleration(u + 0.5 * dt * v, v2)
            v3 = v + 0.5 * dt * a2
            a3 = self.acceleration(u + 0.5 * dt * v2, v3)
            v4 = v + dt * a3
            a4 = self.acceleration(u + dt * v3, v4)
            u = u + dt / 6.0 * (v + 2.0 * (v2 + v3) + v4)
            v = v + dt / 6.0 * (a1 + 2.0 * (a2 + a3) + a4)
        return time.perf_counter() - began, u
