"""What the tests of shells share: sheets of any mesh, states, factors and a Newton loop."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray
from scipy import sparse
from scipy.sparse.linalg import LinearOperator, eigsh, splu

import foldyn as fd
from foldyn.shells import Shell, ShellOptions
from foldyn.shells.mesh import ShellMesh, sides

SQUARE = fd.Pattern([[0, 0], [1, 0], [1, 1], [0, 1]], [[0, 1, 2, 3]])
SOUTH, EAST, NORTH, WEST = (0, 1), (1, 2), (2, 3), (0, 3)  # edges y = 0, x = 1, y = 1, x = 0


def grid(
    nx: int, ny: int, place: Callable[[NDArray, NDArray], NDArray], jitter: float = 0.0
) -> tuple[ShellMesh, NDArray]:
    """Mesh of nx by ny cells at place(x, y), 0 <= x, y <= 1; and its nodes (nx + 1, ny + 1).

    jitter : most by which inner nodes are moved, in cells.
    """
    i, j = np.meshgrid(np.arange(nx + 1.0), np.arange(ny + 1.0), indexing="ij")
    inner = (i > 0) & (i < nx) & (j > 0) & (j < ny)
    moved = np.random.default_rng(5).uniform(-jitter, jitter, (2, nx + 1, ny + 1)) * inner
    nodes = place((i + moved[0]).ravel() / nx, (j + moved[1]).ravel() / ny)
    number = np.arange(len(nodes)).reshape(nx + 1, ny + 1)
    triangles = []
    for a in range(nx):
        for b in range(ny):
            p, q, r, s = number[[a, a + 1, a + 1, a], [b, b, b + 1, b + 1]].tolist()
            triangles += [(p, q, s), (q, r, s)] if (a + b) % 2 else [(p, q, r), (p, r, s)]
    rim = {SOUTH: number[:, 0], EAST: number[-1], NORTH: number[::-1, -1], WEST: number[0]}
    edges = {edge: row.tolist() for edge, row in rim.items()}
    return ShellMesh(nodes, np.array(triangles), np.zeros(len(triangles), int), edges), number


def plane(x: NDArray, y: NDArray) -> NDArray:
    return np.stack([x, y, np.zeros_like(x)], axis=1)


def sheet_of(mesh: ShellMesh, sheet: fd.Sheet, clamped=(), mass: str = "lumped") -> Shell:
    """One smooth sheet of a mesh of `grid`, without creases."""
    return Shell(
        nodes=mesh.nodes,
        triangles=mesh.triangles,
        triangle_panel=mesh.panel,
        sides=sides(mesh, SQUARE, clamped),
        fold_stiffness=np.zeros(0),
        piece_rest=np.zeros(0),
        pattern=SQUARE,
        sheet=sheet,
        options=ShellOptions(mass=mass, clamped=tuple(clamped)),
    )


def with_rotations_on(s: Shell, nodes) -> tuple[Shell, list[tuple[int, int, int]]]:
    """The shell with a rotation on each free side between two of the nodes, where moments may act.

    And (triangle, side, rotation) of each.
    """
    found, rows = s.sides, []
    rotation, sign, free = found.rotation.copy(), found.sign.copy(), found.free.copy()
    on = np.isin(s.triangles, nodes)
    for t, k in np.argwhere(found.free & on & np.roll(on, -1, axis=1)).tolist():
        rows.append((t, k, found.rotations + len(rows)))
        rotation[t, k], sign[t, k], free[t, k] = rows[-1][2], 1.0, False
    changed = found._replace(
        rotation=rotation, sign=sign, free=free, rotations=found.rotations + len(rows)
    )
    return replace(s, sides=changed), rows


def split(s: Shell, q: NDArray) -> tuple[NDArray, NDArray]:
    """Displacements (n, 3) and rotations of a vector of all dofs."""
    return q[: s.nodes.size].reshape(-1, 3), q[s.nodes.size :]


def forces(s: Shell, q: NDArray) -> NDArray:
    force, couple = s.forces(*split(s, q))
    return np.concatenate([force.ravel(), couple])


def tangent(s: Shell, q: NDArray) -> sparse.csr_array:
    return s.tangent(*split(s, q))


def at_rest(s: Shell) -> NDArray:
    return np.zeros(s.nodes.size + s.rotations)


def random_state(s: Shell, seed: int = 0, shift: float = 0.05, turn: float = 0.2) -> NDArray:
    """Displacements of the size `shift` times the shortest side, and rotations (rad)."""
    rng = np.random.default_rng(seed)
    shortest = s.bar_length.min()
    u = shift * shortest * rng.uniform(-1, 1, s.nodes.size)
    return np.concatenate([u, turn * rng.uniform(-1, 1, s.rotations)])


def dofs(nodes, axes="xyz") -> NDArray:
    """Dofs of nodes."""
    nodes = np.atleast_1d(nodes)
    return (3 * nodes[:, None] + ["xyz".index(axis) for axis in axes]).ravel()


def factor(matrix):
    """Solver of a symmetric matrix."""
    return splu(
        matrix.tocsc(), permc_spec="MMD_AT_PLUS_A", diag_pivot_thresh=0.0,
        options={"SymmetricMode": True},
    ).solve  # fmt: skip


def equilibrium(
    s: Shell, q: NDArray, load: NDArray, fixed: NDArray, follower=None, tolerance: float = 1e-9
) -> NDArray:
    """Newton's method from q; follower(q) gives further forces and their derivative."""
    free = np.setdiff1d(np.arange(q.size), fixed)
    for _ in range(30):
        residual, matrix = load - forces(s, q), tangent(s, q)
        if follower is None:
            step = factor(matrix[free][:, free])(residual[free])
        else:
            more, slope = follower(q)
            residual, matrix = residual + more, matrix - slope
            step = splu(matrix[free][:, free].tocsc()).solve(residual[free])
        q = q.copy()
        q[free] += step
        if np.abs(step).max() < tolerance:
            return q
    raise AssertionError(f"no equilibrium: last step {np.abs(step).max():.1e}")


def angular_frequencies(s: Shell, fixed, count: int, shift: float) -> NDArray:
    """Lowest angular frequencies (rad/s): K with its rotations, M without; shift in rad/s."""
    stiffness = tangent(s, at_rest(s)).tocsr()
    rotations = sparse.csr_array((s.rotations, s.rotations))
    mass = sparse.csr_array(sparse.block_diag([sparse.kron(s.mass, np.eye(3)), rotations]))
    free = np.setdiff1d(np.arange(stiffness.shape[0]), fixed)
    stiffness, mass = stiffness[free][:, free], mass[free][:, free]
    solve = LinearOperator(stiffness.shape, matvec=factor(stiffness + shift**2 * mass))
    start = mass @ np.random.default_rng(0).standard_normal(len(free))
    square = eigsh(
        stiffness, count, mass, sigma=-(shift**2), OPinv=solve, v0=start, return_eigenvectors=False
    )
    return np.sqrt(np.maximum(np.sort(square), 0.0))


def rotation_matrix(seed: int) -> NDArray:
    """A random proper rotation, usually a large one."""
    q, r = np.linalg.qr(np.random.default_rng(seed).standard_normal((3, 3)))
    q = q * np.sign(np.diag(r))
    return q * np.sign(np.linalg.det(q))
