"""The dihedral angle of four points, its gradient and its second derivative, in closed form.

Points j, k span the axis, i and l are the wings. With b = x_k - x_j, r = x_i - x_j,
s = x_k - x_l, m = r x b and n = b x s,

    theta = atan2(|b| n.r, m.n) mod 2 pi,      theta = pi when flat.

Gradient: g_i = |b| m/|m|^2, g_l = -|b| n/|n|^2, g_j = (rho-1) g_i - sigma g_l and
g_k = (sigma-1) g_l - rho g_i, with rho = r.b/|b|^2 and sigma = s.b/|b|^2 (Liu and Paulino,
Proc. R. Soc. A 473, 2017, appendix; the second derivative follows by differentiation).
"""

from __future__ import annotations

import math

import numpy as np

from foldyn.jit.compiled import inner, inner_scalar, kernel, scalar
from foldyn.jit.eights import choose
from foldyn.mechanics.contact.distances import cross, dot

PI = math.pi
TAN_PI_8 = math.sqrt(2.0) - 1.0


@scalar
def branch_free_atan2(y, x):
    """atan2(y, x) without branches, so that loops over it vectorize; exact to 2 ulp.

    |t| <= tan(pi/8) after two reductions; there atan t = t + t^3 Q(t^2) with Q the Chebyshev fit
    of degree 10 (error 3e-17). atan2(0, 0) is nan.
    """
    ax, ay = abs(x), abs(y)
    steep = ay > ax
    low, high = choose(steep, ax, ay), choose(steep, ay, ax)
    upper = low > TAN_PI_8 * high
    t = choose(upper, low - high, low) / choose(upper, low + high, high)
    u = t * t
    q = -0.01917688711906226 * u + 0.03923165829558719
    q = q * u - 0.0508544973794026
    q = q * u + 0.0585814891280221
    q = q * u - 0.06664511447381948
    q = q * u + 0.07692183190826087
    q = q * u - 0.09090904578123903
    q = q * u + 0.11111111015256361
    q = q * u - 0.14285714284666542
    q = q * u + 0.1999999999999552
    q = q * u - 0.3333333333333333
    angle = t + t * u * q
    angle = choose(upper, angle + 0.25 * PI, angle)
    angle = choose(steep, 0.5 * PI - angle, angle)
    angle = choose(x < 0.0, PI - angle, angle)
    return choose(y < 0.0, -angle, angle)


@inner_scalar
def dihedral_gradient(jx, jy, jz, kx, ky, kz, ix, iy, iz, lx, ly, lz):
    """Dihedral (rad, 0..2 pi) and its gradient with respect to the points j, k, i, l."""
    bx, by, bz = kx - jx, ky - jy, kz - jz
    rx, ry, rz = ix - jx, iy - jy, iz - jz
    sx, sy, sz = kx - lx, ky - ly, kz - lz
    mx, my, mz = ry * bz - rz * by, rz * bx - rx * bz, rx * by - ry * bx
    nx, ny, nz = by * sz - bz * sy, bz * sx - bx * sz, bx * sy - by * sx
    bb = bx * bx + by * by + bz * bz
    mm = mx * mx + my * my + mz * mz
    nn = nx * nx + ny * ny + nz * nz
    length = math.sqrt(bb)
    # negating both arguments and adding pi moves the branch cut from flat to fully folded
    theta = PI + branch_free_atan2(
        -length * (rx * nx + ry * ny + rz * nz), -(mx * nx + my * ny + mz * nz)
    )
    once = 1.0 / (bb * mm * nn)
    fi = length * (bb * nn * once)
    fl = -length * (bb * mm * once)
    per_bb = mm * nn * once
    rho = (rx * bx + ry * by + rz * bz) * per_bb
    sigma = (sx * bx + sy * by + sz * bz) * per_bb
    gix, giy, giz = fi * mx, fi * my, fi * mz
    glx, gly, glz = fl * nx, fl * ny, fl * nz
    return (
        theta,
        (rho - 1.0) * gix - sigma * glx,
        (rho - 1.0) * giy - sigma * gly,
        (rho - 1.0) * giz - sigma * glz,
        (sigma - 1.0) * glx - rho * gix,
        (sigma - 1.0) * gly - rho * giy,
        (sigma - 1.0) * glz - rho * giz,
        gix,
        giy,
        giz,
        glx,
        gly,
        glz,
    )


@inner_scalar
def dihedral_rates(
    jx, jy, jz, kx, ky, kz, ix, iy, iz, lx, ly, lz, vjx, vjy, vjz, vkx, vky, vkz, vix, viy, viz,
    vlx, vly, vlz,
):  # fmt: skip
    """Dihedral (rad), its gradient, and the rates of both for given point velocities.

    Returns 1 + 12 numbers, then the rates of these, 1 + 12 numbers.
    """
    bx, by, bz = kx - jx, ky - jy, kz - jz
    rx, ry, rz = ix - jx, iy - jy, iz - jz
    sx, sy, sz = kx - lx, ky - ly, kz - lz
    dbx, dby, dbz = vkx - vjx, vky - vjy, vkz - vjz
    drx, dry, drz = vix - vjx, viy - vjy, viz - vjz
    dsx, dsy, dsz = vkx - vlx, vky - vly, vkz - vlz
    mx, my, mz = ry * bz - rz * by, rz * bx - rx * bz, rx * by - ry * bx
    nx, ny, nz = by * sz - bz * sy, bz * sx - bx * sz, bx * sy - by * sx
    dmx = dry * bz - drz * by + ry * dbz - rz * dby
    dmy = drz * bx - drx * bz + rz * dbx - rx * dbz
    dmz = drx * by - dry * bx + rx * dby - ry * dbx
    dnx = dby * sz - dbz * sy + by * dsz - bz * dsy
    dny = dbz * sx - dbx * sz + bz * dsx - bx * dsz
    dnz = dbx * sy - dby * sx + bx * dsy - by * dsx
    bb = bx * bx + by * by + bz * bz
    mm = mx * mx + my * my + mz * mz
    nn = nx * nx + ny * ny + nz * nz
    length = math.sqrt(bb)
    theta = PI + branch_free_atan2(
        -length * (rx * nx + ry * ny + rz * nz), -(mx * nx + my * ny + mz * nz)
    )
    once = 1.0 / (bb * mm * nn)
    per_bb, per_mm, per_nn = mm * nn * once, bb * nn * once, bb * mm * once
    fi, fl = length * per_mm, -length * per_nn
    rho = (rx * bx + ry * by + rz * bz) * per_bb
    sigma = (sx * bx + sy * by + sz * bz) * per_bb
    dhalf = bx * dbx + by * dby + bz * dbz  # half the rate of bb
    dfi = fi * (dhalf * per_bb - 2.0 * (mx * dmx + my * dmy + mz * dmz) * per_mm)
    dfl = fl * (dhalf * per_bb - 2.0 * (nx * dnx + ny * dny + nz * dnz) * per_nn)
    drho = drx * bx + dry * by + drz * bz + rx * dbx + ry * dby + rz * dbz
    drho = (drho - 2.0 * rho * dhalf) * per_bb
    dsigma = dsx * bx + dsy * by + dsz * bz + sx * dbx + sy * dby + sz * dbz
    dsigma = (dsigma - 2.0 * sigma * dhalf) * per_bb
    gix, giy, giz = fi * mx, fi * my, fi * mz
    glx, gly, glz = fl * nx, fl * ny, fl * nz
    hix, hiy, hiz = dfi * mx + fi * dmx, dfi * my + fi * dmy, dfi * mz + fi * dmz
    hlx, hly, hlz = dfl * nx + fl * dnx, dfl * ny + fl * dny, dfl * nz + fl * dnz
    less_rho, less_sigma = rho - 1.0, sigma - 1.0
    # from motions relative to the axis, because translations do not turn the hinge
    rate = gix * drx + giy * dry + giz * drz + (sigma * glx - rho * gix) * dbx
    rate += (sigma * gly - rho * giy) * dby + (sigma * glz - rho * giz) * dbz
    rate -= glx * dsx + gly * dsy + glz * dsz
    return (
        theta,
        less_rho * gix - sigma * glx,
        less_rho * giy - sigma * gly,
        less_rho * giz - sigma * glz,
        less_sigma * glx - rho * gix,
        less_sigma * gly - rho * giy,
        less_sigma * glz - rho * giz,
        gix, giy, giz, glx, gly, glz,
        rate,
        drho * gix + less_rho * hix - dsigma * glx - sigma * hlx,
        drho * giy + less_rho * hiy - dsigma * gly - sigma * hly,
        drho * giz + less_rho * hiz - dsigma * glz - sigma * hlz,
        dsigma * glx + less_sigma * hlx - drho * gix - rho * hix,
        dsigma * gly + less_sigma * hly - drho * giy - rho * hiy,
        dsigma * glz + less_sigma * hlz - drho * giz - rho * hiz,
        hix, hiy, hiz, hlx, hly, hlz,
    )  # fmt: skip


@inner_scalar
def gradient_at(x):
    """`dihedral_gradient` of points (4, 3)."""
    return dihedral_gradient(
        x[0, 0], x[0, 1], x[0, 2], x[1, 0], x[1, 1], x[1, 2],
        x[2, 0], x[2, 1], x[2, 2], x[3, 0], x[3, 1], x[3, 2],
    )  # fmt: skip


@inner_scalar
def rates_at(x, v):
    """`dihedral_rates` of points and velocities (4, 3)."""
    return dihedral_rates(
        x[0, 0], x[0, 1], x[0, 2], x[1, 0], x[1, 1], x[1, 2],
        x[2, 0], x[2, 1], x[2, 2], x[3, 0], x[3, 1], x[3, 2],
        v[0, 0], v[0, 1], v[0, 2], v[1, 0], v[1, 1], v[1, 2],
        v[2, 0], v[2, 1], v[2, 2], v[3, 0], v[3, 1], v[3, 2],
    )  # fmt: skip


@inner_scalar
def hinge_at(x, hinges, e):
    """`dihedral_gradient` of row e of `hinges` (nh, 4), for points at x (n, 3)."""
    j, k, i, l = hinges[e, 0], hinges[e, 1], hinges[e, 2], hinges[e, 3]  # noqa: E741
    return dihedral_gradient(
        x[j, 0], x[j, 1], x[j, 2], x[k, 0], x[k, 1], x[k, 2],
        x[i, 0], x[i, 1], x[i, 2], x[l, 0], x[l, 1], x[l, 2],
    )  # fmt: skip


@inner_scalar
def _difference(points, p, q):
    return points[p, 0] - points[q, 0], points[p, 1] - points[q, 1], points[p, 2] - points[q, 2]


@inner
def add_hessian(points, gradient, moment, block):
    """Add moment times the second derivative of the dihedral to `block`.

    points and gradient are (4, 3), in the order j, k, i, l; block is (4, 3, 4, 3). Only four 3x3
    blocks are formulas; the others follow from symmetry and translation invariance.
    """
    b, r, s = _difference(points, 1, 0), _difference(points, 2, 0), _difference(points, 1, 3)
    m, n = cross(r, b), cross(b, s)
    bb, mm, nn = dot(b, b), dot(m, m), dot(n, n)
    length = math.sqrt(bb)
    rho, sigma = dot(r, b) / bb, dot(s, b) / bb
    bm, rm = cross(b, m), cross(r, m)
    bn, sn = cross(b, n), cross(s, n)
    cm, cn = moment * length / (mm * mm), moment * length / (nn * nn)
    dm, dn = moment / (length * mm), moment / (length * nn)
    for p in range(3):
        for q in range(3):
            ii = -cm * (m[p] * bm[q] + bm[p] * m[q])
            ik = cm * (m[p] * rm[q] + rm[p] * m[q]) + dm * m[p] * b[q]
            ij = -ii - ik
            ll = cn * (n[p] * bn[q] + bn[p] * n[q])
            lj = dn * n[p] * b[q] - cn * (n[p] * sn[q] + sn[p] * n[q])
            lk = -lj - ll
            rho_k = moment * (r[q] - 2.0 * rho * b[q]) / bb
            sigma_k = moment * (b[q] + s[q] - 2.0 * sigma * b[q]) / bb
            gi, gl = gradient[2, p], gradient[3, p]
            jk = gi * rho_k + (rho - 1.0) * ik - gl * sigma_k - sigma * lk
            block[2, p, 2, q] += ii
            block[3, p, 3, q] += ll
            block[2, p, 0, q] += ij
            block[0, q, 2, p] += ij
            block[2, p, 1, q] += ik
            block[1, q, 2, p] += ik
            block[3, p, 0, q] += lj
            block[0, q, 3, p] += lj
            block[3, p, 1, q] += lk
            block[1, q, 3, p] += lk
            block[0, p, 1, q] += jk
            block[1, q, 0, p] += jk
            # each column of blocks sums to zero (translation)
            block[0, q, 0, p] -= jk
            block[0, p, 0, q] -= ij + lj
            block[1, p, 1, q] -= jk + ik + lk


@inner_scalar
def carry_wing(block):
    """Distribute a block's entries (4, 3, 4, 3) at the last node to the first two nodes."""
    for row in range(2):
        for a in range(3):
            for w in range(4):
                for b in range(3):
                    block[row, a, w, b] += 0.5 * block[3, a, w, b]
    for v in range(3):
        for a in range(3):
            for column in range(2):
                for b in range(3):
                    block[v, a, column, b] += 0.5 * block[v, a, 3, b]


@kernel
def dihedrals_and_gradients(x, hinges):
    """Dihedrals (nh,), rad, of hinge rows (nh, 4) at positions x (n, 3); gradients (nh, 12), 1/m.

    Gradients are with respect to the nodes j, k, i, l.
    """
    angle, gradient = np.empty(hinges.shape[0]), np.empty((hinges.shape[0], 12))
    for e in range(hinges.shape[0]):
        found = hinge_at(x, hinges, e)
        angle[e] = found[0]
        for c in range(12):
            gradient[e, c] = found[c + 1]
    return angle, gradient
