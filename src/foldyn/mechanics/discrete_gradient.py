"""Forces whose work from one state to another is the change of the strain energy, exactly.

With the positions x0 and x1, their mean x and difference dx, each bar and hinge needs a force f
with f . dx = W1 - W0, without resultant or moment about x: then a free body conserves energy and
momenta for any step (Simo and Tarnow, Z. Angew. Math. Phys. 43, 1992; Gonzalez, J. Nonlinear Sci.
6, 1996).

Bars: E = (stretch^2 - 1)/2 is quadratic in the positions, so that f = (dW/dE) grad E(x) satisfies
this, with dW/dE the difference quotient.

Hinges: f = (dW/dtheta) g, with g a discrete gradient of the dihedral, g . dx = theta1 - theta0. If
the hinge rotates in the step, the mean of both positions is contracted, which would change the
dihedral. With w the Cayley vector of the rotation of the hinge's four points (least squares) and A
= (1 - skew(w)^2/4)^(1/2), the positions A x avoid that, and A^-1 grad theta(A x) has no resultant
and no moment about x. The work of this gradient differs from the change of the angle by second
order in the deformation within the step, or by third order if there is no rotation. The remaining
difference is corrected along the deformation, dx without its rigid part, which has no resultant and
no moment either.
"""

from __future__ import annotations

import math

import numpy as np

from foldyn.jit.compiled import inner_scalar, kernel
from foldyn.materials import series, switch
from foldyn.mechanics.dihedral import add_hessian, gradient_at
from foldyn.mechanics.energy import hinge_dihedral
from foldyn.mechanics.tangent import add_to_bar, add_to_hinge

GAUSS = 0.5 - math.sqrt(3.0) / 6.0  # first of the two Gauss points between 0 and 1
NOISE = 16.0 * float(np.finfo(float).eps)  # rounding errors, relative to an energy
LEAST = 1e-9  # strain or rad: for smaller changes the Gauss rule is exact
ANGLE_NOISE = 4e-15  # rad: smaller differences of a dihedral are rounding errors


@inner_scalar
def _extension(x):
    """Stretch minus one, from x = stretch^2 - 1."""
    return x / (1.0 + math.sqrt(1.0 + x))


@kernel
def mean_stress(code, address, x, change):
    """Mean stress S / E_y of a bar whose stretch^2 - 1 goes from x to x + 2 change, and its slope.

    The mean stress is the difference quotient of energy and strain, computed as Gauss quadrature
    plus the error of this quadrature. The slope is the derivative with respect to the end strain.
    """
    stress, slope = 0.0, 0.0
    for point in (GAUSS, 1.0 - GAUSS):
        e = _extension(x + 2.0 * point * change)
        stress += 0.5 * switch.bar_stress(code, e, address[1])
        slope += 0.5 * point * switch.bar_slope(code, e, address[2])
    before = switch.bar_energy(code, _extension(x), address[0])
    after = switch.bar_energy(code, _extension(x + 2.0 * change), address[0])
    missed = after - before - stress * change
    if abs(change) > LEAST and abs(missed) > NOISE * max(abs(before), abs(after)):
        stress += missed / change
    return stress, slope


@kernel
def mean_moment(code, address, p, share, rest, theta, change):
    """Mean moment / k, and its slope, of a hinge that turns by `change`; see `mean_stress`."""
    moment, slope, a, b, c, d = 0.0, 0.0, p[0], p[1], p[2], p[3]
    for point in (GAUSS, 1.0 - GAUSS):
        t = theta + point * change
        moment += 0.5 * series.series_moment(code, t, rest, a, b, c, d, share, address)
        slope += 0.5 * point * series.series_slope(code, t, rest, a, b, c, d, share, address)
    before = series.series_energy(code, theta, rest, a, b, c, d, share, address)
    after = series.series_energy(code, theta + change, rest, a, b, c, d, share, address)
    missed = after - before - moment * change
    size = max(abs(before), abs(after))
    if p[2] != 0.0 or p[3] != 0.0:  # subtractions of stress-free laws lose digits
        size += 1.0 + abs(p[2]) + abs(p[3])
    if abs(change) > LEAST and abs(missed) > NOISE * size:
        moment += missed / change
    return moment, slope


@inner_scalar
def _mean_moment(model, e, code, address, theta, change):
    """Mean moment / k, and its slope, of hinge e of a model."""
    p, share, rest = model.hinge_parameters[e], model.hinge_share[e], model.hinge_rest[e]
    return mean_moment(code, address, p, share, rest, theta + model.hinge_offset[e, 0], change)


@inner_scalar
def _bar_step(model, e, u0, u1, mean):
    """Stretch^2 - 1 of bar e at u0, and the change of strain; puts the mean vector into `mean`."""
    a, b, per = model.bars[e, 0], model.bars[e, 1], model.bar_per_length2[e]
    x, change = 0.0, 0.0
    for c in range(3):
        d0, d1 = u0[b, c] - u0[a, c], u1[b, c] - u1[a, c]
        mean[c] = model.bar_vector[e, c] + 0.5 * (d0 + d1)
        x += d0 * (2.0 * model.bar_vector[e, c] + d0)
        change += mean[c] * (d1 - d0)
    return x * per, change * per


@kernel
def add_bar_forces(model, u0, u1, force):
    """Add the mean forces of the bars from u0 to u1, all (n, 3)."""
    mean = np.empty(3)
    for run in range(model.bar_runs.shape[0]):
        code, address = model.bar_runs[run, 2], model.addresses[model.bar_runs[run, 3]]
        for e in range(model.bar_runs[run, 0], model.bar_runs[run, 1]):
            a, b = model.bars[e, 0], model.bars[e, 1]
            x, change = _bar_step(model, e, u0, u1, mean)
            stress = mean_stress(code, address, x, change)[0]
            for c in range(3):
                force[b, c] += model.bar_stiffness[e] * stress * mean[c]
                force[a, c] -= model.bar_stiffness[e] * stress * mean[c]


@kernel
def discrete_gradient(x, dx, turn, points, plain, gradient):
    """Discrete gradient (4, 3) of a dihedral, for points with mean x and change dx, (4, 3).

    turn : change of the dihedral (rad).
    points, plain : (4, 3), outputs: the positions A x about their mean, and the gradient there.
    """
    deform = np.empty((4, 3))
    for c in range(3):
        middle, shift = 0.0, 0.0
        for v in range(4):
            middle += 0.25 * x[v, c]
            shift += 0.25 * dx[v, c]
        for v in range(4):
            points[v, c], deform[v, c] = x[v, c] - middle, dx[v, c] - shift
    # the rotation w x r closest to the difference of the positions
    w0, w1, w2 = turned_by(inertia_inverse(points), *moment_of(points, deform))
    square = 0.25 * (w0 * w0 + w1 * w1 + w2 * w2)
    stretch = math.sqrt(1.0 + square)
    for v in range(4):
        r0, r1, r2 = points[v, 0], points[v, 1], points[v, 2]
        deform[v, 0] -= w1 * r2 - w2 * r1
        deform[v, 1] -= w2 * r0 - w0 * r2
        deform[v, 2] -= w0 * r1 - w1 * r0
        along = 0.25 * (w0 * r0 + w1 * r1 + w2 * r2) / (1.0 + stretch)
        points[v, 0] = stretch * r0 - along * w0
        points[v, 1] = stretch * r1 - along * w1
        points[v, 2] = stretch * r2 - along * w2
    dihedral, flat = gradient_at(points), plain.reshape(12)
    for c in range(12):
        flat[c] = dihedral[1 + c]
    missed, size = turn, 0.0
    for v in range(4):
        along = w0 * plain[v, 0] + w1 * plain[v, 1] + w2 * plain[v, 2]
        along *= 0.25 / (stretch * (1.0 + stretch))
        gradient[v, 0] = plain[v, 0] / stretch + along * w0
        gradient[v, 1] = plain[v, 1] / stretch + along * w1
        gradient[v, 2] = plain[v, 2] / stretch + along * w2
        for c in range(3):
            missed -= gradient[v, c] * deform[v, c]
            size += deform[v, c] * deform[v, c]
    if abs(missed) > ANGLE_NOISE:
        for v in range(4):
            for c in range(3):
                gradient[v, c] += missed / size * deform[v, c]


@inner_scalar
def moment_of(r, d):
    """Sum of r x d over the points; both are (4, 3)."""
    t0, t1, t2 = 0.0, 0.0, 0.0
    for v in range(4):
        a, b, c = r[v, 0], r[v, 1], r[v, 2]
        t0 += b * d[v, 2] - c * d[v, 1]
        t1 += c * d[v, 0] - a * d[v, 2]
        t2 += a * d[v, 1] - b * d[v, 0]
    return t0, t1, t2


@inner_scalar
def inertia_inverse(r):
    """Inverse of the inertia of points r (4, 3) about their mean: xx, yy, zz, xy, xz, yz."""
    xx, yy, zz, xy, xz, yz = 0.0, 0.0, 0.0, 0.0, 0.0, 0.0
    for v in range(4):
        a, b, c = r[v, 0], r[v, 1], r[v, 2]
        xx += b * b + c * c
        yy += a * a + c * c
        zz += a * a + b * b
        xy -= a * b
        xz -= a * c
        yz -= b * c
    axx, ayy, azz = yy * zz - yz * yz, xx * zz - xz * xz, xx * yy - xy * xy
    axy, axz, ayz = xz * yz - xy * zz, xy * yz - xz * yy, xy * xz - xx * yz
    once = 1.0 / (xx * axx + xy * axy + xz * axz)
    return once * axx, once * ayy, once * azz, once * axy, once * axz, once * ayz


@inner_scalar
def turned_by(inverse, t0, t1, t2):
    """Rotation vector of points with this inverse inertia, due to the moment (t0, t1, t2)."""
    axx, ayy, azz, axy, axz, ayz = inverse
    return (
        axx * t0 + axy * t1 + axz * t2,
        axy * t0 + ayy * t1 + ayz * t2,
        axz * t0 + ayz * t1 + azz * t2,
    )


@inner_scalar
def put_motion(rest, hinges, e, u0, u1, x, dx):
    """Mean and difference (4, 3) of the positions of a hinge's points."""
    for v in range(4):
        node = hinges[e, v]
        for c in range(3):
            x[v, c] = rest[node, c] + 0.5 * (u0[node, c] + u1[node, c])
            dx[v, c] = u1[node, c] - u0[node, c]


@kernel
def add_hinge_forces(model, u0, u1, angle0, angle1, force):
    """Add the mean forces of the hinges; writes the dihedrals at u1 to angle1 (nh,)."""
    x, dx, points = np.empty((4, 3)), np.empty((4, 3)), np.empty((4, 3))
    plain, gradient = np.empty((4, 3)), np.empty((4, 3))
    for run in range(model.hinge_runs.shape[0]):
        code, address = model.hinge_runs[run, 2], model.addresses[model.hinge_runs[run, 3]]
        for e in range(model.hinge_runs[run, 0], model.hinge_runs[run, 1]):
            angle1[e] = hinge_dihedral(model, u1, e)[0]
            turn = angle1[e] - angle0[e]
            put_motion(model.rest, model.hinges, e, u0, u1, x, dx)
            discrete_gradient(x, dx, turn, points, plain, gradient)
            moment = _mean_moment(model, e, code, address, angle0[e], turn)[0]
            moment *= model.hinge_stiffness[e]
            for v in range(4):
                for c in range(3):
                    force[model.hinges[e, v], c] += moment * gradient[v, c]


@kernel
def add_bar_tangent(model, u0, u1, stress, slots, data):
    """Add the derivative of the bars' mean forces with respect to u1 to blocks (nnz, 3, 3).

    stress : (nb,) stresses of the bars, for the geometric part.
    """
    mean, end = np.empty(3), np.empty(3)
    for run in range(model.bar_runs.shape[0]):
        code, address = model.bar_runs[run, 2], model.addresses[model.bar_runs[run, 3]]
        for e in range(model.bar_runs[run, 0], model.bar_runs[run, 1]):
            a, b = model.bars[e, 0], model.bars[e, 1]
            x, change = _bar_step(model, e, u0, u1, mean)
            slope = mean_stress(code, address, x, change)[1] * model.bar_per_length2[e]
            for c in range(3):
                end[c] = model.bar_vector[e, c] + u1[b, c] - u1[a, c]
            for p in range(3):
                for q in range(3):
                    value = slope * mean[p] * end[q]
                    if p == q:
                        value += 0.5 * stress[e]
                    value *= model.bar_stiffness[e]
                    add_to_bar(data, slots, e, p, q, value)


@kernel
def add_hinge_tangent(model, u0, u1, angle0, floor, slots, data):
    """Add the derivative of the hinges' mean forces, with gradients to first order in the step.

    floor : least slope of built-in laws per unit stiffness.
    """
    x, dx, points = np.empty((4, 3)), np.empty((4, 3)), np.empty((4, 3))
    plain, gradient, end = np.empty((4, 3)), np.empty((4, 3)), np.empty((4, 3))
    block = np.empty((4, 3, 4, 3))
    for run in range(model.hinge_runs.shape[0]):
        code, address = model.hinge_runs[run, 2], model.addresses[model.hinge_runs[run, 3]]
        for e in range(model.hinge_runs[run, 0], model.hinge_runs[run, 1]):
            dihedral, k = hinge_dihedral(model, u1, e), model.hinge_stiffness[e]
            flat = end.reshape(12)
            for c in range(12):
                flat[c] = dihedral[1 + c]
            turn = dihedral[0] - angle0[e]
            put_motion(model.rest, model.hinges, e, u0, u1, x, dx)
            discrete_gradient(x, dx, turn, points, plain, gradient)
            moment, slope = _mean_moment(model, e, code, address, angle0[e], turn)
            if code >= 0:
                slope = max(slope, 0.5 * floor)
            block[:] = 0.0
            add_hessian(points, plain, 0.5 * k * moment, block)
            add_to_hinge(data, slots, e, block, k * slope, gradient, end)
