"""Circle fit: modes from the Nyquist plot of the mobility."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from foldyn.errors import ComputationError, InputError
from foldyn.signals import records
from foldyn.signals.responses import convert_response
from foldyn.values import choice

_FEWEST = 5  # least points in a band: ten real numbers for six real unknowns
_LARGEST_ERROR = 1.0 / 3.0  # largest relative error of damping accepted; pure noise gives above 0.4
_SWEEPS = 200
_SETTLED = 1e-10


@dataclass(frozen=True)
class CircleFit:
    """A mode from a circle fit, with mobility i w A / (w0^2 - w^2 + 2 i z w0 w) + residual.

    Attributes
    ----------
    natural_frequency, damping_ratio : float
        The natural frequency w0 / (2 pi), Hz, and the damping ratio z.
    modal_constant : complex
        The constant A: the product of the mass-normalized amplitudes at the points of response and
        force (1/kg for a receptance in m/N); real for a mode in which all points move in phase.
    residual : complex
        What all other modes contribute to the mobility, taken as constant in the band.
    center, radius : complex, float
        The circle in the plane of the mobility; it begins and ends at `residual`.
    misfit : float
        Root mean square distance between the points and the fit, as a fraction of the radius.
    frequency_error, damping_error : float
        Standard errors of natural frequency (Hz) and damping ratio, from the scatter about the fit.
        They are valid for noise that is independent from line to line, and do not include errors
        due to other modes that vary in the band.
    points : int
        Number of points fitted.
    """

    natural_frequency: float
    damping_ratio: float
    modal_constant: complex
    residual: complex
    center: complex
    radius: float
    misfit: float
    frequency_error: float
    damping_error: float
    points: int

    def mobility(self, frequency: ArrayLike) -> NDArray[np.complex128]:
        """Mobility of the mode alone, without the residual, at frequencies (Hz) above 0."""
        f = np.asarray(frequency, dtype=np.float64)
        diameter = np.complex128(2.0 * (self.center - self.residual))
        return diameter / (1.0 + 1j * _detuning(f, self.natural_frequency, self.damping_ratio))


def circle_fit(
    frequency: ArrayLike,
    response: ArrayLike,
    *,
    band: tuple[float, float] | None = None,
    quantity: str = "receptance",
) -> CircleFit:
    """Fit one mode of a frequency response by a circle through its mobility.

    Parameters
    ----------
    frequency : array_like, shape (m,)
        Frequencies (Hz), increasing; the spacing may vary.
    response : array_like, shape (m,), complex
        Frequency response, for the time dependence exp(+i w t).
    band : (float, float) or None
        Lowest and highest frequency (Hz) of the band to fit, in which this mode dominates: two to
        three times the half-power width. None takes all frequencies.
    quantity : {"receptance", "mobility", "accelerance"}
        Quantity of the response.

    Returns
    -------
    CircleFit
        Natural frequency, damping ratio, modal constant, residual, and quality of the fit.

    Raises
    ------
    InputError
        Fewer than five points in the band, NaN in the band, or a curve that does not turn.
    ComputationError
        A fit that does not converge (no mode in the band, or more than one), or a damping ratio
        below three times its standard error (noise).

    Notes
    -----
    Y = D / (1 + i x) + B with x = (f / f0 - f0 / f) / (2 z) and D = A / (2 z w0) is a circle
    through B with the diameter D. Seen from the center, the point at x lies at the angle
    -2 atan(x) from the resonance (Kennelly and Pancu, Journal of the Aeronautical Sciences 14,
    1947; Ewins, Modal Testing, 2nd ed. 2000, chapter 4, circle fit). An algebraic circle fit and
    these angles give the start. Then all six parameters are fitted by least squares of the
    distances in the plane, the maximum likelihood estimate for noise of equal size at all points.
    The mobility is used because with viscous damping it is exactly a circle.

    Examples
    --------
    >>> import numpy as np
    >>> f = np.linspace(8.0, 11.0, 31)
    >>> w, w0 = 2 * np.pi * f, 2 * np.pi * 9.3
    >>> fit = circle_fit(f, 2.5 / (w0**2 - w**2 + 2j * 0.135 * w0 * w))
    >>> print(f"{fit.natural_frequency:.6f} {fit.damping_ratio:.6f} {fit.modal_constant.real:.6f}")
    9.300000 0.135000 2.500000
    """
    f, Y = _mobility(frequency, response, quantity)
    return _certain(_fit(*_in_band(f, Y, band)))


def circle_fits(
    frequency: ArrayLike,
    response: ArrayLike,
    *,
    bands: Sequence[tuple[float, float]],
    quantity: str = "receptance",
) -> tuple[CircleFit, ...]:
    """Fit several modes, one in each band; from each band, the other modes are subtracted.

    The circle fits are iterated until they converge: each mode is fitted to the response minus the
    last fits of the other modes. So close modes do not reduce accuracy, and the residuals are the
    contributions of modes outside the bands.

    Parameters
    ----------
    frequency, response, quantity
        As in `circle_fit`.
    bands : sequence of (float, float)
        A band (Hz) around each mode; they may overlap.

    Returns
    -------
    tuple of CircleFit
        One fit for each band, in the order of the bands.

    Raises
    ------
    InputError
        As in `circle_fit`; also if there are no bands.
    ComputationError
        As in `circle_fit`; also if the fits do not converge, because modes are too close for their
        bands.
    """
    if len(bands) == 0:
        raise InputError("bands: empty; give one band (Hz) for each mode")
    f, Y = _mobility(frequency, response, quantity)
    parts = [_in_band(f, Y, band) for band in bands]
    fits: dict[int, CircleFit] = {}
    before = np.full((len(parts), 2), np.inf)
    for _ in range(_SWEEPS):
        for k, (points, values) in enumerate(parts):
            others = [fit for j, fit in fits.items() if j != k]
            fits[k] = _fit(points, values - sum(fit.mobility(points) for fit in others))
        now = np.array([(fit.natural_frequency, fit.damping_ratio) for fit in fits.values()])
        if (np.abs(now - before) <= _SETTLED * now).all():
            return tuple(_certain(fit) for fit in fits.values())
        before = now
    raise ComputationError(
        f"circle fits: they still change after {_SWEEPS} sweeps (natural frequencies "
        f"{', '.join(f'{value:.6g}' for value in before[:, 0])} Hz); choose other bands, or fewer"
    )


def _mobility(
    frequency: ArrayLike, response: ArrayLike, quantity: str
) -> tuple[NDArray[np.float64], NDArray[np.complex128]]:
    """Frequencies above 0, and the mobility at them; NaN is allowed outside the bands."""
    choice("quantity", quantity, records.DERIVATIVES)
    f = records.checked_frequencies(frequency, fewest=_FEWEST)
    Y = np.asarray(response)
    if Y.shape != f.shape:
        raise InputError(f"response: shape {Y.shape} for {f.size} frequencies; fit one at a time")
    if not np.iscomplexobj(Y):
        raise InputError("response: real; a circle fit needs the complex response, not its modulus")
    Y = convert_response(f, Y, source=quantity, target="mobility")
    return f[f > 0.0], Y[f > 0.0]


def _in_band(
    f: NDArray[np.float64], Y: NDArray[np.complex128], band: tuple[float, float] | None
) -> tuple[NDArray[np.float64], NDArray[np.complex128]]:
    """Frequencies and mobility in a band, at least five points."""
    low, high = (0.0, np.inf) if band is None else band
    inside = (f >= low) & (f <= high)
    if inside.sum() < _FEWEST:
        raise InputError(
            f"band: {int(inside.sum())} points between {low:g} and {high:g} Hz; a circle fit needs "
            f"at least {_FEWEST}: widen the band, or refine the frequencies"
        )
    return f[inside], records.checked_curve("response", Y[inside], f[inside])


def _fit(f: NDArray[np.float64], Y: NDArray[np.complex128]) -> CircleFit:
    """Least-squares fit of one mode to a mobility."""
    from scipy.optimize import least_squares  # slow to import

    def solved(p: NDArray) -> tuple[NDArray, NDArray, NDArray, NDArray]:
        """Resonance curve, best diameter and residual, misfit, and basis of the projection."""
        curve = 1.0 / (1.0 + 1j * _detuning(f, *np.exp(p)))
        q, r = np.linalg.qr(np.column_stack([curve, np.ones(f.size)]))
        inner = np.conj(q.T) @ Y
        return curve, np.linalg.solve(r, inner), Y - q @ inner, q

    def misfit(p: NDArray) -> NDArray[np.float64]:
        return solved(p)[2].view(np.float64)

    def slope(p: NDArray) -> NDArray[np.float64]:
        # variable projection: the part of each parameter's effect that D and B cannot reproduce
        curve, linear, _, q = solved(p)
        f0, z = np.exp(p)
        x_slopes = [-(f / f0 + f0 / f) / (2.0 * z), -_detuning(f, f0, z)]
        effect = np.column_stack([-1j * linear[0] * curve**2 * x_slope for x_slope in x_slopes])
        left = -(effect - q @ (np.conj(q.T) @ effect))
        return np.stack([np.real(left), np.imag(left)], axis=1).reshape(-1, 2)

    start = np.log(_start(f, Y))
    solution = least_squares(misfit, start, slope, method="lm", xtol=1e-14, ftol=1e-14, gtol=1e-14)
    f0, z = (float(value) for value in np.exp(solution.x))
    if not (solution.success and np.isfinite([f0, z]).all() and f[0] < f0 < f[-1]):
        raise ComputationError(
            f"circle fit: no resonance found between {f[0]:.6g} and {f[-1]:.6g} Hz (ended at "
            f"{f0:.6g} Hz, damping ratio {z:.3g}); choose a band around a peak, with one mode in it"
        )
    _, (diameter, residual), left, _ = solved(solution.x)
    J = slope(solution.x)
    variance = np.sum(np.abs(left) ** 2) / (2 * f.size - 6)
    # by singular values, since a spike of one point makes the two columns parallel
    _, size, axes = np.linalg.svd(J, full_matrices=False)
    with np.errstate(divide="ignore", invalid="ignore"):
        errors = np.sqrt(variance * np.sum((axes / size[:, np.newaxis]) ** 2, axis=0))
    radius = 0.5 * abs(diameter)
    return CircleFit(
        natural_frequency=f0,
        damping_ratio=z,
        modal_constant=complex(diameter * 2.0 * z * 2.0 * np.pi * f0),
        residual=complex(residual),
        center=complex(residual + 0.5 * diameter),
        radius=float(radius),
        misfit=float(np.sqrt(np.mean(np.abs(left) ** 2)) / radius),
        frequency_error=float(f0 * errors[0]),
        damping_error=float(z * errors[1]),
        points=f.size,
    )


def _certain(fit: CircleFit) -> CircleFit:
    """The fit itself; raises an error if its points do not determine the damping."""
    if not fit.damping_error < _LARGEST_ERROR * fit.damping_ratio:
        raise ComputationError(
            f"circle fit: at {fit.natural_frequency:.6g} Hz the damping ratio is "
            f"{fit.damping_ratio:.3g} with a standard error of {fit.damping_error:.3g}: noise, or "
            "too few points on the circle; average more, refine the frequencies, or choose another "
            "band"
        )
    return fit


def _detuning(f: NDArray[np.float64], f0: float, z: float) -> NDArray[np.float64]:
    """Detuning x: 0 at the natural frequency, -1 and 1 at the mobility's half-power points."""
    return (f / f0 - f0 / f) / (2.0 * z)


def _start(f: NDArray[np.float64], Y: NDArray[np.complex128]) -> tuple[float, float]:
    """Natural frequency and damping ratio from the angles on the algebraic circle."""
    scale = np.abs(Y - Y.mean()).max()
    if not scale > 0.0:
        raise InputError("response: constant in the band; there is no circle to fit")
    w = (Y - Y.mean()) / scale
    # |w|^2 = 2 Re(conj(c) w) + const
    columns = np.column_stack([2.0 * w.real, 2.0 * w.imag, np.ones(w.size)])
    (re, im, _), *_ = np.linalg.lstsq(columns, np.abs(w) ** 2, rcond=None)
    center = complex(re, im)
    # the ends of the band lie near the residual, the resonance lies opposite on the circle
    top = int(np.argmax(np.abs(w - 0.5 * (w[0] + w[-1]))))
    angle = np.angle((w[top] - center) / (w - center))
    # tan(angle / 2) = f / (2 z f0) - f0 / (2 z f), with less weight where tan amplifies noise
    weight = np.cos(0.5 * angle) ** 2
    sides = np.column_stack([f, -1.0 / f]) * weight[:, np.newaxis]
    (a, b), *_ = np.linalg.lstsq(sides, np.tan(0.5 * angle) * weight, rcond=None)
    if a > 0.0 and b > 0.0:
        return float(np.sqrt(b / a)), float(0.5 / np.sqrt(a * b))
    return float(f[top]), float((f[-1] - f[0]) / (4.0 * f[top]))
