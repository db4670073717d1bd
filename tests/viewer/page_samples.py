"""Small results of each kind, and the pages that show them."""

from __future__ import annotations

import io
import tomllib
from functools import cache
from pathlib import Path

import numpy as np
from PIL import Image

import foldyn as fd
from foldyn.analyses.reading import case_of_document
from foldyn.experiment.camera import Camera
from foldyn.report import write_report
from foldyn.viewer import Backdrop, projection, stage

KINDS = ("motion", "path", "modes", "response", "bands", "periodic")
ALL = (*KINDS, "film")
PAINTERS = ("webgl", "plain")
"""What a page may be asked for."""
BANDS = """[pattern]
kind = "miura"
[sheet]
youngs_modulus = 1e6
poissons_ratio = 0.25
thickness = 0.01
density = 1.0
[damping]
alpha = 0.1
[model]
preset = "plate"
[analysis]
kind = "bands"
count = 4
points = 13
zone = 6
attenuation = 10
vary = { "pattern.dihedral" = [60, 120] }
"""
PAGE = "document.querySelector('.foldyn').page"
SHEET = fd.Sheet(1e6, 0.25, 0.01, density=1.0)


def case(loaded=True, **options):
    pattern = fd.patterns.simple_fold(1.0, 1.0, dihedral=90)
    laws = {"fold_law": "linear", "bend_law": "linear"}
    structure = fd.discretize(pattern, SHEET, preset="herkal", **{**laws, **options})
    supports = [fd.Fix([4, 5]), fd.Fix([0, 1], axes="z")]
    push = fd.Force([0, 1], (-1e-3, 0.0, 0.0), history=fd.HalfSine(0.5))
    return fd.Case(structure, supports, [push] if loaded else [], fd.Rayleigh(alpha=0.1))


def bands_file():
    """A case file of bands."""
    return case_of_document(Path("bands.toml"), tomllib.loads(BANDS))


def in_a_well():
    """A triangle that snaps through, driven in one of its wells, where its period doubles."""
    pattern = fd.Pattern([[0, 0, 0], [1, 0, 0], [0.5, 0.8, 0.2]], [[0, 1, 2]])
    structure = fd.discretize(pattern, SHEET, scheme="n4b5", bar_law="linear", mass="panel")
    supports = [fd.Fix([0, 1]), fd.Fix([2], "xy")]
    (f,) = fd.modes(fd.Case(structure, supports), 1)["frequency"].values
    omega = 2.0 * np.pi * f
    force = 0.04 * structure.mass.toarray()[2, 2] * omega**2
    push = fd.Force([2], (0, 0, force), history=fd.Harmonic(f))
    return fd.Case(structure, supports, [push], fd.Rayleigh(alpha=0.15 * omega)), f


@cache
def results(kind):
    rules = ("circumcenter", "panel")
    if kind == "motion":
        return {
            rule: fd.simulate(case(mass=rule), 3.0, method="rk4", interval=0.01) for rule in rules
        }
    if kind == "path":
        return {"fold": fd.trace(case(), load_factors=[0.5, 1.0, 1.5, 2.0])}
    if kind == "bands":
        return {"sheet": bands_file().run()}
    if kind == "periodic":
        driven, f = in_a_well()
        return {
            "cell": fd.response_curve(driven, (1.2 * f, 0.8 * f), harmonics=5, longest_step=0.3)
        }
    if kind == "modes":
        return {rule: fd.modes(case(loaded=False, mass=rule), 4) for rule in rules}
    drive = [fd.Force([0, 1], (-1.0, 0.0, 0.0))]
    frequencies = [0.2 * k for k in range(1, 40)]
    return {"fold": fd.frf(case(loaded=False), drive, frequencies=frequencies)}


def page(kind, folder):
    shown = results("motion" if kind == "film" else kind)
    cases = {name: fd.case_of(result) for name, result in shown.items()}
    part = stage(shown, cases, f"A {kind}", [0], film() if kind == "film" else None)
    return write_report([part], folder / f"{kind}.html", title=f"A {kind}")


def camera():
    return Camera.looking_at(
        (0.7, 0.5, 0.3), 4.0, metres_per_pixel=5e-3, size=(640, 480), turned=(10, 30, 5)
    )


def film():
    """Two gray photographs, of the start and of 1 s, by `camera`."""
    pictures = {}
    for moment, shade in ((0.0, 90), (1.0, 160)):
        found = io.BytesIO()
        Image.new("RGB", (640, 480), (shade, shade, shade)).save(found, "PNG")
        pictures[moment] = found.getvalue()
    nodes = case().structure.nodes
    return Backdrop(pictures, (640, 480), projection(nodes, camera().project(nodes)))


def evaluate(tab, code):
    """What a script gives in a page, which it calls p."""
    return tab.evaluate(f"(() => {{ const p = {PAGE}; {code} }})()")
