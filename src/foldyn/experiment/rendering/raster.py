"""Rasterize triangles: one ray per pixel finds the nearest triangle, with its paper and light."""

from __future__ import annotations

from typing import Any

import numpy as np

from foldyn.jit.compiled import strict, strict_inlined

_MARGIN = 3  # pixels around a triangle's box, because distortion bends its edges slightly


@strict
def draw(
    slopes, nearness, pixels, triangles, flat, marked, dark, shade, grain, look, lens, shift, box,
    depth, bright,
):  # fmt: skip
    """Draw triangles over the content of `bright`, with the nearest in front.

    Parameters
    ----------
    slopes : ndarray, shape (n, 2)
        Rays of the nodes, (x, y)/z in the camera's axes.
    nearness : ndarray, shape (n,)
        1/z of the nodes (1/m).
    pixels : ndarray, shape (n, 2)
        Pixels of the nodes, for the boxes of the triangles.
    triangles : ndarray, shape (m, 3)
    flat : ndarray, shape (m, 3, 2)
        Corners of each triangle in the plane of its paper (m).
    marked : ndarray of bool, shape (m, 3)
        Corners around which the marker is painted.
    dark : ndarray of bool, shape (m,)
        Triangles that the marker inks.
    shade : ndarray, shape (m,)
        Light on each triangle.
    grain : ndarray, shape (k, k)
        Reflectance of the paper, as a tile that is repeated; k is a power of two.
    look : ndarray, shape (3,)
        Radius of the markers (m), reflectance of their ink, texels per m.
    lens : ndarray, shape (9,)
        Focal length, center u and v (pixels), then the six coefficients of the
        inverse of the distortion.
    shift : ndarray, shape (2,)
        Place of the ray within its pixel.
    box : ndarray of int, shape (2,)
        First column and row of the part of the image that is drawn.
    depth, bright : ndarray, shape (height, width), float32
        Nearness (1/z, 0 for nothing) and brightness of the picture.
    """
    height, width = bright.shape
    focal, cu, cv = lens[0], lens[1], lens[2]
    radius2, ink, texels = look[0] ** 2, look[1], look[2]
    mask = grain.shape[0] - 1
    scale, left = 1.0 / focal, box[0] + shift[0] - cu
    for t in range(len(triangles)):
        a, b, c = triangles[t]
        ax, ay = slopes[a]
        bx, by = slopes[b]
        cx, cy = slopes[c]
        area = (bx - ax) * (cy - ay) - (by - ay) * (cx - ax)
        if area == 0.0:
            continue
        # linear functions of the pixel: barycentric coordinates, 1/z, and (s, q)/z of the paper
        share_a = _plane(bx * cy - by * cx, by - cy, cx - bx, area)
        share_b = _plane(cx * ay - cy * ax, cy - ay, ax - cx, area)
        share_c = 1.0 - share_a[0] - share_b[0], -share_a[1] - share_b[1], -share_a[2] - share_b[2]
        na, nb, nc = nearness[a], nearness[b], nearness[c]
        near0, near1, near2 = _mix(share_a, share_b, share_c, na, nb, nc)
        fa, fb, fc = flat[t, 0], flat[t, 1], flat[t, 2]
        s0, s1, s2 = _mix(share_a, share_b, share_c, na * fa[0], nb * fb[0], nc * fc[0])
        q0, q1, q2 = _mix(share_a, share_b, share_c, na * fa[1], nb * fb[1], nc * fc[1])
        pu = np.array([pixels[a, 0], pixels[b, 0], pixels[c, 0]]) - box[0]
        pv = np.array([pixels[a, 1], pixels[b, 1], pixels[c, 1]]) - box[1]
        top = max(0, int(np.floor(pv.min())) - _MARGIN)
        bottom = min(height - 1, int(np.ceil(pv.max())) + _MARGIN)
        before = max(0, int(np.floor(pu.min())) - _MARGIN)
        after = min(width - 1, int(np.ceil(pu.max())) + _MARGIN)
        for row in range(top, bottom + 1):
            first, last = _span(pu, pv, row, before, after)
            y_row = (row + box[1] + shift[1] - cv) * scale
            for column in range(first, last + 1):
                x = (column + left) * scale
                y = y_row
                r2 = x * x + y * y
                factor = lens[8]
                for k in range(7, 2, -1):
                    factor = factor * r2 + lens[k]
                x *= factor
                y *= factor
                wa = share_a[0] + share_a[1] * x + share_a[2] * y
                wb = share_b[0] + share_b[1] * x + share_b[2] * y
                if wa < 0.0 or wb < 0.0 or wa + wb > 1.0:
                    continue
                near = near0 + near1 * x + near2 * y
                if near <= depth[row, column]:
                    continue
                depth[row, column] = near
                z = 1.0 / near
                s = (s0 + s1 * x + s2 * y) * z
                q = (q0 + q1 * x + q2 * y) * z
                value = _grain(grain, mask, s * texels, q * texels)
                if dark[t]:
                    for k in range(3):
                        ds, dq = s - flat[t, k, 0], q - flat[t, k, 1]
                        if marked[t, k] and ds * ds + dq * dq < radius2:
                            value = ink
                bright[row, column] = value * shade[t]


@strict_inlined
def _plane(c0: float, c1: float, c2: float, area: float) -> tuple[float, float, float]:
    return c0 / area, c1 / area, c2 / area


@strict_inlined
def _mix(a: Any, b: Any, c: Any, va: float, vb: float, vc: float) -> tuple[float, float, float]:
    """Coefficients of the linear function with given values at the three corners."""
    return (
        a[0] * va + b[0] * vb + c[0] * vc,
        a[1] * va + b[1] * vb + c[1] * vc,
        a[2] * va + b[2] * vb + c[2] * vc,
    )


@strict
def _span(pu: Any, pv: Any, row: int, before: int, after: int) -> tuple[int, int]:
    """Columns of a row that a triangle may cover, with a margin."""
    low, high = 1e30, -1e30
    for k in range(3):
        m = (k + 1) % 3
        u0, v0, u1, v1 = pu[k], pv[k], pu[m], pv[m]
        if v0 > v1:
            u0, v0, u1, v1 = u1, v1, u0, v0
        if v1 < row - _MARGIN or v0 > row + _MARGIN:
            continue
        for edge in (row - _MARGIN, row + _MARGIN):
            at = min(max(edge, v0), v1)
            u = u0 if v1 == v0 else u0 + (u1 - u0) * (at - v0) / (v1 - v0)
            low, high = min(low, u), max(high, u)
            if v1 == v0:
                low, high = min(low, u1), max(high, u1)
    first = int(np.floor(min(max(low, before), after))) - _MARGIN
    last = int(np.ceil(min(max(high, before), after))) + _MARGIN
    return max(before, first), min(after, last)


@strict_inlined
def _grain(grain: Any, mask: int, s: float, q: float) -> float:
    """Reflectance of the paper, interpolated between four texels."""
    i, j = int(np.floor(s)), int(np.floor(q))
    fs, fq = s - i, q - j
    i0, j0, i1, j1 = i & mask, j & mask, (i + 1) & mask, (j + 1) & mask
    near = grain[j0, i0] * (1.0 - fs) + grain[j0, i1] * fs
    far = grain[j1, i0] * (1.0 - fs) + grain[j1, i1] * fs
    return near * (1.0 - fq) + far * fq
