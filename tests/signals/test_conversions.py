"""Receptance, mobility, accelerance and transmissibility of a known oscillator."""

from __future__ import annotations

from functools import partial

import numpy as np
import pytest
from known_poles import Mode, receptance

from foldyn.errors import InputError
from foldyn.signals import base_transmissibility, convert_response, transmissibility

F = np.linspace(0.0, 20.0, 81)
W = 2 * np.pi * F
H = receptance(F, Mode(9.3, 0.135, 2.0))
KINDS = ("receptance", "mobility", "accelerance")


def test_derivatives():
    np.testing.assert_allclose(
        convert_response(F, H, source="receptance", target="mobility"), 1j * W * H
    )
    np.testing.assert_allclose(
        convert_response(F, H, source="receptance", target="accelerance"), -(W**2) * H
    )
    # the imaginary part of a receptance is negative, the real part of a mobility positive
    assert (H.imag[1:] < 0).all()
    assert (convert_response(F, H, source="receptance", target="mobility").real[1:] > 0).all()


@pytest.mark.parametrize("source", KINDS)
@pytest.mark.parametrize("target", KINDS)
def test_there_and_back(source, target):
    channels = np.stack([H, 2 * H], axis=1)
    there = convert_response(F[1:], channels[1:], source=source, target=target)
    back = convert_response(F[1:], there, source=target, target=source)
    np.testing.assert_allclose(back, channels[1:], rtol=1e-13)


def test_dividing_at_0_hz_gives_nan():
    back = convert_response(F, 1j * W * H, source="mobility", target="receptance")
    assert np.isnan(back[0])
    np.testing.assert_allclose(back[1:], H[1:], rtol=1e-13)
    assert convert_response(F, H, source="mobility", target="accelerance")[0] == 0


def test_base_transmissibility_of_an_oscillator():
    """Textbook: |T|^2 = (1 + (2 z r)^2) / ((1 - r^2)^2 + (2 z r)^2); 1 at r = sqrt 2."""
    r, z = F / 9.3, 0.135
    relative = -receptance(F, Mode(9.3, z, 1.0))  # z'' + ... = -y''
    T = base_transmissibility(F, relative)
    square = (1 + (2 * z * r) ** 2) / ((1 - r**2) ** 2 + (2 * z * r) ** 2)
    np.testing.assert_allclose(np.abs(T) ** 2, square, rtol=1e-12)
    assert T[0] == 1
    crossing = np.array([9.3 * np.sqrt(2)])
    at = base_transmissibility(crossing, -receptance(crossing, Mode(9.3, z, 1.0)))
    assert np.abs(at[0]) == pytest.approx(1.0, rel=1e-13)


def test_transmissibility_is_the_same_of_all_quantities():
    here, there = H, receptance(F, Mode(9.3, 0.135, -0.5), Mode(16.7, 0.09, 1.0))
    T = transmissibility(np.stack([there, here], axis=1), here)
    np.testing.assert_allclose(T[:, 1], 1.0, rtol=1e-14)
    speeds = 1j * W[1:] * there[1:], 1j * W[1:] * here[1:]
    np.testing.assert_allclose(transmissibility(*speeds), T[1:, 0])
    assert np.isnan(transmissibility([1.0], [0.0])[0])


@pytest.mark.parametrize(
    ("function", "arguments", "words"),
    [
        (
            partial(convert_response, source="receptance", target="inertance"),
            (F, H),
            'target = "inertance"',
        ),
        (
            partial(convert_response, source="flexibility", target="mobility"),
            (F, H),
            'source = "flexibility"',
        ),
        (
            partial(convert_response, source="mobility", target="receptance"),
            (F, H[:-1]),
            "response: shape",
        ),
        (
            partial(convert_response, source="mobility", target="receptance"),
            (F[::-1], H),
            "frequency: must increase",
        ),
        (
            partial(convert_response, source="mobility", target="receptance"),
            (-F[::-1], H),
            "from 0 Hz",
        ),
        (transmissibility, (H, H[:-1]), "reference: shape"),
        (base_transmissibility, (F, H[:-1]), "response: shape"),
    ],
)
def test_bad_input(function, arguments, words):
    with pytest.raises(InputError, match=words):
        function(*arguments)
