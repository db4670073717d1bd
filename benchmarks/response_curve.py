"""A response curve of the paper specimen beside the same by stepped sines.

    OMP_NUM_THREADS=1 python benchmarks/response_curve.py

The sheet of 333 dofs on a base that moves; at least 200 points with stability in the span of six
modes and their derivatives, and two frequencies by simulated motions until transients are below
1e-3. Processor seconds of each, per point, and how far the amplitudes are apart. The simulated
motions take minutes.
"""

from __future__ import annotations

import time

import numpy as np

import foldyn as fd

SHAKEN = 1e-4  # m
FREQUENCIES = (6.0, 11.0)  # Hz
TIMED = (8.0, 8.05)
LEAST = 200  # points


def specimen(*motion: fd.BaseMotion) -> fd.Case:
    """The sheet of the published experiment, standing on its bottom row."""
    pattern = fd.patterns.miura(cells=(4, 3), a=0.025, b=0.025, panel_angle=60, dihedral=39.2)
    paper = fd.Sheet(1219e6, 0.2, 0.24e-3, density=667.0, length_scale_ratio=2.7)
    held = [fd.Fix(range(56, 63), "x"), fd.Fix([59], "y"), fd.Fix([57, 59, 61], "z")]
    s = fd.discretize(pattern, paper, preset="plate")
    return fd.Case(s, [*held, *motion], damping=fd.Rayleigh(alpha=4.0))


def seconds(call):
    """Result of a call, and its processor seconds."""
    began = time.process_time()
    return call(), time.process_time() - began


def main() -> None:
    """Run both and print the comparison."""
    base = fd.BaseMotion("x", value=SHAKEN, history=fd.Harmonic(TIMED[0]))
    case = specimen(base)
    fd.response_curve(
        case, (6.0, 6.01), harmonics=5, modes=6, longest_step=1.0, steps=32
    )  # compiles
    curve, own = seconds(
        lambda: fd.response_curve(
            case, FREQUENCIES, harmonics=5, modes=6, longest_step=0.025, steps=32
        )
    )
    points = curve.sizes["point"]
    print(f"curve: {points} points in {own:.1f} s, {own / points:.3f} s a point", flush=True)
    print(
        f"complete: {curve.attrs['complete']}, {curve.attrs['unknowns']} unknowns, largest", end=" "
    )
    print(f"truncation {curve.truncation.values.max():.1e}", end=", ")
    print(f"reduction {curve.reduction.values.max():.1e}", flush=True)
    if points < LEAST:
        print(f"fewer than {LEAST} points: take shorter steps")
    drive = fd.BaseMotion("x", value=SHAKEN)
    timed, other = seconds(
        lambda: fd.frf(specimen(), drive, frequencies=TIMED, method="stepped_sine")
    )
    each = other / len(TIMED)
    print(f"stepped sine: {each:.1f} s a frequency; {each / (own / points):.0f} times as long")
    moved = np.abs(timed.transmissibility.values[:, 3, 0]) * SHAKEN
    first = np.abs(curve.coefficient.values[:, 1, 3, 0])
    near = np.interp(TIMED, curve.frequency.values, first)
    print("amplitudes of the top apart by", np.abs(near / moved - 1.0).round(5))


if __name__ == "__main__":
    main()
