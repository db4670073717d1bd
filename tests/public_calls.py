"""A small sound call of every public function and class, by name: what tests vary."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np

import foldyn as fd
from case_texts import FOLD_TEXT, changed

POINTS = [(0.0, 0.0), (1.0, 0.0), (1.0, 1.0), (0.0, 1.0), (2.0, 0.0), (2.0, 1.0)]
PANELS = [(0, 1, 2, 3), (1, 4, 5, 2)]

Calls = Mapping[str, tuple[Callable[..., Any], dict[str, Any]]]


@cache
def pattern() -> fd.Pattern:
    """Two squares, bent."""
    return fd.patterns.simple_fold(a=1.0, b=1.0, dihedral=120)


@cache
def sheet() -> fd.Sheet:
    return fd.Sheet(1e6, 0.25, 0.01, density=1000.0)


@cache
def cell() -> fd.UnitCell:
    """The sheet of which that is a pleat."""
    return fd.UnitCell(fd.Case(fd.discretize(pattern(), sheet(), preset="plate")))


@cache
def case() -> fd.Case:
    """One side held, the other pushed."""
    made = fd.discretize(pattern(), sheet(), preset="plate")
    return fd.Case(
        made, [fd.Fix([0, 1, 2, 3])], [fd.Force([4, 5], (0, 0, 1e-3))], fd.Rayleigh(alpha=1.0)
    )


@cache
def swung() -> fd.Case:
    """The same, swung by its load."""
    load = fd.Force([4, 5], (0, 0, 1e-3), fd.Harmonic(5.0))
    return fd.Case(case().structure, case().supports, [load], fd.Rayleigh(alpha=1.0))


def at_rest(k: float) -> fd.State:
    """A start."""
    return fd.State()


LIFT = fd.Quantity("m", "lift", function=lambda u, v, t: u[4, 2])


@cache
def shaken() -> fd.Case:
    """The same with linear bends, the other side pushed to and fro."""
    made = fd.discretize(pattern(), sheet(), bend_law="linear")
    push = fd.Force([4, 5], (0, 0, 1e-6), history=fd.Harmonic(2.0))
    return fd.Case(made, [fd.Fix([0, 1, 2, 3])], [push], fd.Rayleigh(alpha=1.0))


DATA: Calls = {
    "Sheet": (fd.Sheet, {
        "youngs_modulus": 1e6, "poissons_ratio": 0.25, "thickness": 0.5, "density": 1000.0,
        "length_scale_ratio": 2.0, "strength": 2e6, "panels": [fd.PanelSheet([0], thickness=0.25)],
    }),
    "PanelSheet": (fd.PanelSheet, {
        "panels": [0, 1], "youngs_modulus": 1e6, "poissons_ratio": 0.25, "thickness": 0.5,
        "density": 1000.0, "strength": 2e6,
    }),
    "Ply": (fd.Ply, {
        "thickness": 0.5, "youngs_modulus": 1e6, "poissons_ratio": 0.25, "shear_modulus": None,
        "angle": 30.0, "density": 1000.0, "strength": [1e6, 2e6, 3e6, 4e6, 5e6],
        "expansion": [0.5, 0.25],
    }),
    "Strip": (fd.Strip, {
        "width": 0.25, "thickness": 0.5, "youngs_modulus": 1e6, "poissons_ratio": 0.25,
    }),
    "Laminate": (fd.Laminate, {"layers": [(0.5, 1e9, 0.125), (0.25, 2e9, 0.25)]}),
    "Fix": (fd.Fix, {"nodes": [0, 1], "axes": "xy", "along": False, "until": 0.5}),
    "Impose": (fd.Impose, {
        "nodes": [0, 1], "axis": "x", "value": [0.5, 0.25], "along": False,
    }),
    "BaseMotion": (fd.BaseMotion, {"axis": "x", "value": 0.5, "history": fd.Ramp(1.0)}),
    "Spring": (fd.Spring, {
        "stiffness": 2.0, "between": [(0, 1)], "rest_length": 0.5,
    }),
    "Bar": (fd.Bar, {
        "between": [(0, 1)], "area": 0.5, "modulus": 2.0, "law": "ogden", "rest_length": 0.5,
        "bending": 0.25,
        "mass": 0.5, "until": 0.5,
    }),
    "Cable": (fd.Cable, {
        "nodes": [0, 1, (0.5, 0.25, 1.0)], "stiffness": 2.0, "pretension": 0.5, "change": 0.25,
        "friction": 0.5, "sliding_speed": 0.25,
        "until": 0.5,
    }),
    "Dashpot": (fd.Dashpot, {"coefficient": 2.0, "nodes": 0, "direction": (1.0, 0.0, 0.0)}),
    "Stop": (fd.Stop, {"creases": [0], "angle": 30.0, "stiffness": 2.0, "side": "below",
        "damping": 0.5}),
    "Latch": (fd.Latch, {
        "creases": [0], "angle": [30.0], "stiffness": 2.0, "release": 0.5, "until": 0.25,
    }),
    "Link": (fd.Link, {"nodes": [0, 1], "to": [2, 3, 4]}),
    "Force": (fd.Force, {"nodes": [0, 1], "vector": (1.0, 0.0, 0.5), "history": fd.Step(0.5)}),
    "Gravity": (fd.Gravity, {"acceleration": (0.0, 0.0, -9.5)}),
    "Actuate": (fd.Actuate, {"creases": [0], "angle": [90.0]}),
    "TotalForce": (fd.TotalForce, {"total": (1.0, 0.0, 0.5), "edges": [(0, 1)]}),
    "LineLoad": (fd.LineLoad, {"edges": [(0, 1)], "force_per_length": (1.0, 0.0, 0.5)}),
    "Pressure": (fd.Pressure, {"pressure": 2.0, "panels": [0, 1]}),
    "CreaseMoment": (fd.CreaseMoment, {"creases": [0], "moment": [0.5]}),
    "Temperature": (fd.Temperature, {
        "change": 0.125, "expansion": 0.5, "curvature": 0.25, "panels": [0], "layers": None,
        "history": None,
    }),
    "Rayleigh": (fd.Rayleigh, {"alpha": 0.5, "beta": 0.25, "state": "initial"}),
    "ModalDamping": (fd.ModalDamping, {"ratios": 0.5, "count": 3, "state": "initial"}),
    "StrainDamping": (fd.StrainDamping, {"beta": 1e-4}),
    "CreaseDamping": (fd.CreaseDamping, {"coefficient": 0.5, "creases": [0]}),
    "PointMass": (fd.PointMass, {"nodes": [0], "mass": 0.5}),
    "Contact": (fd.Contact, {
        "thickness": 0.5, "friction": 0.25, "stiffness": 2.0, "panels": False,
        "planes": [fd.Plane((0, 0, 0), (0, 0, 1))],
    }),
    "Plane": (fd.Plane, {
        "point": (0.0, 0.5, 0.0), "normal": (0.0, 0.0, 1.0), "friction": 0.5,
        "motion": (0.0, 0.5, 1.0), "history": fd.Ramp(1.0), "until": 0.5,
    }),
    "Air": (fd.Air, {
        "density": 998.0, "velocity": (0.5, 0.0, 0.0), "added_mass": "local", "drag": True,
        "drag_coefficient": 0.5, "resolution": 2, "history": fd.Ramp(1.0),
    }),
    "Constant": (fd.Constant, {}),
    "Pulse": (fd.Pulse, {"duration": 0.5}),
    "HalfSine": (fd.HalfSine, {"duration": 0.5}),
    "Ramp": (fd.Ramp, {"duration": 0.5, "smooth": True}),
    "Step": (fd.Step, {"time": 0.5}),
    "Harmonic": (fd.Harmonic, {"frequency": 0.5, "phase": 30.0}),
    "Chirp": (fd.Chirp, {
        "from_frequency": 0.5, "to_frequency": 2.0, "duration": 4.0, "phase": 30.0,
    }),
    "Table": (fd.Table, {"times": [0.0, 0.5, 1.0], "values": [0.0, 1.0, 0.5], "smooth": True}),
    "Function": (fd.Function, {"function": np.sin, "at": [0.5]}),
    "EnhancedLinear": (fd.EnhancedLinear, {
        "theta1": 45.0, "theta2": 315.0, "rest": "as_published",
    }),
    "PlateSuperlinear": (fd.PlateSuperlinear, {"onset": 0.5}),
    "SpectralDensity": (fd.SpectralDensity, {
        "frequency": [1.0, 20.0], "value": [0.5, 0.25], "unit": "g2/Hz",
    }),
    "Prony": (fd.Prony, {"ratios": [0.5, 0.25], "times": [1.0, 2.0], "law": "linear"}),
    "Plastic": (fd.Plastic, {
        "yield_moment": 0.5, "isotropic": 0.25, "kinematic": 0.125, "law": "linear",
    }),
    "Eyring": (fd.Eyring, {"barrier_moment": 0.5, "rate": 0.25, "law": "linear"}),
    "State": (fd.State, {"displacement": [[0.5, 0.0, 0.0]], "velocity": [[0.0, 0.5, 0.0]]}),
    "Quantity": (fd.Quantity, {"units": "m", "text": "", "dims": ("node",), "function": None}),
    "Pattern": (fd.Pattern, {
        "vertices": POINTS, "faces": PANELS, "assignments": {(1, 2): "V"}, "name": "two",
        "fold_angles": [0.5], "families": {"middle": [(1, 2)]}, "welds": [],
        "periods": [[(0, 4), (3, 5)]], "rim_families": {"rim": [(0, 1)]},
    }),
    "Screw": (fd.Screw, {
        "axis": (0.0, 0.5, 1.0), "angle": 30.0, "shift": 0.5, "point": (0.0, 0.5, 0.0),
    }),
    "UnitCell": (fd.UnitCell, {
        "case": fd.Case(fd.discretize(pattern(), sheet(), preset="plate")),
        "vectors": [(3.0**0.5, 0.0, 0.0)], "screw": None, "tolerance": 0.5**20,
    }),
    "Case": (fd.Case, {
        "structure": fd.discretize(pattern(), sheet(), preset="plate"),
        "supports": [fd.Fix([0, 1, 2, 3])],
        "loads": [fd.Force([4, 5], (0, 0, 1e-3))], "damping": fd.Rayleigh(alpha=1.0),
        "masses": [fd.PointMass([4], 0.5)], "contact": fd.Contact(thickness=0.01),
        "air": fd.Air(density=998.0),
    }),
    "thicken": (fd.thicken, {"pattern": pattern(), "thickness": 0.01, "offsets": 0.005}),
    "welded": (fd.welded, {
        "pattern": fd.Pattern(POINTS, PANELS), "facets": [(1, 2)], "join": False,
    }),
    "convex": (fd.convex, {"pattern": pattern()}),
    "discretize": (fd.discretize, {
        "pattern": pattern(), "sheet": sheet(), "scheme": "n5b8", "mass": "consistent",
        "bar_law": "ogden", "fold_law": "enhanced", "bend_law": "linear", "calibration": "plate",
        "crease_stiffness": 0.5, "crease_rest": 90.0, "centers": {0: (0.433, 0.5, 0.25)},
        "clamped": [], "rigid": None, "straight": [], "guided": {}, "membrane": "bars",
        "preset": "plate",
    }),
    "shell": (fd.shell, {
        "pattern": pattern(), "sheet": sheet(), "divisions": 4, "mass": "lumped",
        "fold_law": "enhanced", "crease_stiffness": 0.5, "crease_rest": 90.0,
        "clamped": [(0, 1)], "rigid": [0], "vertex_radius": 0.05,
    }),
    "superelements": (fd.superelements, {
        "pattern": pattern(), "sheet": sheet(), "level": 1, "divisions": 4, "mass": "consistent",
        "fold_law": "enhanced", "crease_stiffness": 0.5, "crease_rest": 90.0,
        "clamped": [(0, 1)], "rigid": [0], "vertex_radius": 0.05,
    }),
}  # fmt: skip

PATTERNS: Calls = {
    "simple_fold": (fd.patterns.simple_fold, {"a": 1.0, "b": 0.5, "dihedral": 60.0}),
    "miura": (fd.patterns.miura, {
        "cells": (2, 1), "a": 1.0, "b": 0.5, "panel_angle": 60.0, "dihedral": 60.0,
    }),
    "arc_miura": (fd.patterns.arc_miura, {
        "cells": (2, 4), "a": 1.0, "b": 1.0, "panel_angle": 60.0, "second_angle": 75.0,
        "dihedral": 90.0,
    }),
    "eggbox": (fd.patterns.eggbox, {
        "cells": (2, 1), "a": 1.0, "b": 1.0, "panel_angle": 75.0, "dihedral": 60.0,
    }),
    "kresling": (fd.patterns.kresling, {
        "sides": 6, "radius": 1.0, "height": 0.5, "twist": 30.0, "storeys": 2, "alternating": True,
    }),
    "waterbomb": (fd.patterns.waterbomb, {"cells": (4, 5), "a": 1.0, "b": 1.0, "dihedral": 120.0}),
    "yoshimura": (fd.patterns.yoshimura, {"cells": (6, 4), "a": 0.5, "b": 1.0, "dihedral": 160.0}),
    "curved_pleat": (fd.patterns.curved_pleat, {
        "pleats": 4, "segments": 9, "a": 0.5, "radius": 1.0, "arc": 90.0, "dihedral": 110.0,
    }),
    "miura_tube": (fd.patterns.miura_tube, {
        "cells": 3, "a": 1.0, "b": 1.0, "panel_angle": 60.0, "dihedral": 90.0,
    }),
    "zipper_tubes": (fd.patterns.zipper_tubes, {
        "cells": 3, "a": 1.0, "b": 1.0, "panel_angle": 60.0, "dihedral": 90.0,
    }),
    "resch": (fd.patterns.resch, {"cells": (3, 3), "a": 1.0, "dihedral": 120.0}),
    "square_twist": (fd.patterns.square_twist, {
        "a": 1.0, "b": 1.0, "panel_angle": 45.0, "dihedral": 100.0, "symmetric": False,
    }),
    "flasher": (fd.patterns.flasher, {"sides": 6, "a": 1.0, "rings": 2, "folded": False}),
}  # fmt: skip

CASE = changed(
    FOLD_TEXT,
    "pattern.dihedral = 120; sheet.density = 1e3; supports = [{ nodes = [0, 1, 2, 3] }]; "
    'model.preset = "plate"; analysis = { kind = "modes", count = 2 }',
)


def solved(folder: Path) -> Calls:
    """Calls of what computes, reads and writes; files are in a folder."""
    run = fd.simulate(case(), 0.02, method="rk4", dt=1e-3)
    path = fd.trace(case(), load_factors=[0.0, 0.5, 1.0])
    found = fd.modes(case(), count=2)
    light = fd.Case(fd.discretize(pattern(), sheet(), preset="herkal"), [fd.Fix([0, 1, 2, 3])])
    fd.save(run, folder / "run.nc")
    fd.write_pattern(pattern(), folder / "pattern.fold")
    (folder / "case.toml").write_text(CASE)
    reading = {
        "path": folder / "pattern.fold", "scale": 2.0, "unit": "m", "frame": 0, "facets": "hinge",
        "tolerance": 1e-6, "flat_foldable": False,
    }  # fmt: skip
    return {
        "simulate": (fd.simulate, {
            "case": case(), "duration": 0.02, "method": "rk4", "dt": 1e-3, "every_steps": 2,
            "interval": None, "initial": fd.State(), "force": False, "tolerance": None,
            "start": 0.0, "progress": None, "spectral_radius": None, "sample": None, "store": None,
            "checkpoint": 60.0, "resume": False, "device": "cpu",
        }),
        "simulate_many": (fd.simulate_many, {
            "cases": [light], "duration": 0.02, "dt": 1e-4, "every_steps": 100,
            "interval": None, "initial": None,
            "start": 0.0, "force": False, "threads": 1, "method": "central_difference",
            "device": "cpu",
        }),
        "trace": (fd.trace, {
            "case": case(), "method": "newton", "load_factors": [0.0, 1.0], "steps": None,
            "duration": 2.0, "constant": (), "initial": None, "first_step": None, "until": None,
            "adaptive_load": None, "inertia_relief": False,
            "settings": {"largest_turn": 5.0, "stability": True, "iterations": 20},
            "progress": None,
        }),
        "switch_branch": (fd.switch_branch, {  # refused: the path has no bifurcation
            "path": path, "at": 1, "direction": 1, "case": case(), "mode": 0,
            "method": "arc_length", "steps": 2, "until": None, "settings": None, "progress": None,
        }),
        "landscape": (fd.landscape, {"path": path, "case": case(), "settings": {}}),
        "modes": (fd.modes, {
            "case": case(), "count": 2, "state": None, "secant": 2.0, "load_factor": 1.0,
            "verify": True, "solver": "superlu", "check_model": True,
        }),
        "buckling": (fd.buckling, {
            "case": case(), "count": 2, "preload": [fd.Force([5], (0, 0, 1e-4))],
            "iterations": 1,
        }),
        "frf": (fd.frf, {
            "case": case(), "drive": fd.Force([4], (0, 0, 1.0)), "frequencies": [1.0, 2.0],
            "state": None, "method": "direct", "secant": None, "amplitude": 1.0,
            "load_factor": 1.0, "progress": None, "check_model": True,
        }),
        "random_response": (fd.random_response, {
            "case": case().altered(damping=fd.ModalDamping(0.02)),
            "base": {"z": fd.SpectralDensity([1.0, 50.0], [0.1, 0.1], "m2/s3")},
            "forces": [(fd.Force([4], (0, 0, 1.0)), fd.SpectralDensity([1, 9], [1, 2], "N2/Hz"))],
            "state": None, "count": 3, "load_factor": 1.0, "frequencies": [1.0, 2.0],
            "stresses": False, "reactions": True, "coherence": 0.0,
        }),
        "spectrum_response": (fd.spectrum_response, {
            "case": case().altered(damping=fd.ModalDamping(0.02)),
            "base": {"z": ([0.1, 50.0], [1.0, 2.0])}, "combine": "cqc", "count": 3, "state": None,
            "load_factor": 1.0, "stresses": False, "reactions": True,
        }),
        "stresses": (fd.stresses, {"result": path}),
        "margins": (fd.margins, {
            "result": path, "strength": 1e6, "crease_strength": {"all": 2.0},
            "factor_of_safety": 1.5, "sigmas": 3.0, "criterion": "tsai_wu",
        }),
        "imperfect": (fd.imperfect, {
            "pattern": pattern(), "amplitude": 1e-3, "shapes": None, "modes": 1,
            "correlation": 0.5, "seed": 1,
        }),
        "bands": (fd.bands, {
            "cell": cell(), "phases": [[0.5]], "count": 2, "state": fd.State(), "secant": 2.0,
            "group_velocity": True, "shape": True, "polarization": True, "load_factor": 1.0,
            "track": False, "check_model": True,
        }),
        "effective": (fd.effective, {
            "cell": cell(), "state": fd.State(), "secant": 2.0, "load_factor": 1.0,
            "check_model": True,
        }),
        "swept_sine": (fd.swept_sine, {
            "case": swung(), "measure": LIFT, "frequencies": [5.0, 6.0], "duration": 2.0,
            "sweep": "up", "settle": 1, "resolution": 0.25, "initial": None, "method": "rk4",
            "dt": None, "tolerance": None, "progress": None,
        }),
        "bifurcation_diagram": (fd.bifurcation_diagram, {
            "case": swung(), "measure": LIFT, "frequencies": [5.0, 6.0], "amplitudes": None,
            "sweep": "up", "settle": 1, "record": 4, "resolution": 0.25, "initial": None,
            "method": "rk4", "dt": None, "tolerance": None, "progress": None,
        }),
        "poincare_section": (fd.poincare_section, {
            "motion": run, "period": 0.001, "plane": None, "level": 0.5, "direction": "up",
            "phase": 30.0, "after": 0.0,
        }),
        "lyapunov_exponent": (fd.lyapunov_exponent, {
            "case": swung(), "duration": 1.0, "settle": 0.5, "interval": 0.5, "initial": None,
            "method": "rk4", "dt": None, "progress": None,
        }),
        "basins": (fd.basins, {
            "case": case(), "initial": at_rest, "grid": {"k": [0.0, 1.0]}, "duration": 0.5,
            "record": 4, "same": 0.5, "method": "rk4", "dt": None, "threads": 1, "device": "cpu",
            "folder": None, "progress": None,
        }),
        "fold": (fd.fold, {
            "pattern": fd.Pattern(POINTS, PANELS, {(1, 2): "V"}), "fraction": 0.5, "angles": None,
            "steps": 2, "initial": "auto", "panels": "whole", "progress": None,
        }),
        "critical_step": (fd.critical_step, {"case": case(), "method": "rk4", "state": None}),
        "initial_state": (fd.initial_state, {"result": run, "at": 1}),
        "mac": (fd.mac, {"a": found, "b": found, "mass": [1.0, 2.0], "nodes": [4, 5]}),
        "case_of": (fd.case_of, {"ds": run}),
        "latched": (fd.latched, {"result": run}),
        "attitude": (fd.attitude, {"result": run, "panel": 0}),
        "save": (fd.save, {"ds": run, "path": folder / "again.nc"}),
        "load": (fd.load, {"path": folder / "run.nc", "whole": True}),
        "export": (fd.export, {"result": run, "path": folder / "run.csv", "format": None}),
        "view": (fd.view, {"what": pattern(), "title": "t", "height": 500, "stresses": False}),
        "read_case": (fd.read_case, {
            "path": folder / "case.toml", "model": "bars_and_hinges", "divisions": None,
        }),
        "flat_foldable": (fd.flat_foldable, {"pattern": fd.patterns.miura(dihedral=180)}),
        "read_pattern": (fd.read_pattern, reading),
        "diagnose": (fd.diagnose, reading),
        "write_pattern": (fd.write_pattern, {
            "path": folder / "written.fold", "pattern": pattern(), "frames": (),
        }),
        "sweep": (fd.sweep, {
            "case": folder / "case.toml", "vary": {"sheet.thickness": [0.01, 0.02]},
            "measures": ["frequency"], "samples": None, "method": None, "seed": None, "ties": None,
            "processes": 1, "scheduler": None, "folder": None, "progress": None, "device": "cpu",
        }),
        "sensitivity": (fd.sensitivity, {
            "build": folder / "case.toml", "parameters": {"sheet.thickness": 0.01},
            "measures": "mass", "analysis": None, "sizes": {"sheet.thickness": 0.01},
            "along": None,
        }),
        "design": (fd.design, {  # refused: nothing to make small
            "build": folder / "case.toml", "bounds": {"sheet.thickness": (0.01, 0.02)},
            "minimize": None, "maximize": None, "subject_to": ["mass <= 1"], "analysis": None,
            "guess": {"sheet.thickness": 0.015}, "method": "slsqp", "searches": 1, "seed": 0,
            "tolerance": 1e-6, "slack": 1e-4, "max_evaluations": 2, "folder": None,
            "progress": None,
        }),
        "fit": (fd.fit, {  # refused: nothing to fit to
            "case": folder / "case.toml", "data": [], "parameters": [], "ties": None, "searches": 1,
            "seed": 0, "processes": 1, "confidence": 0.95, "folder": None, "progress": None,
        }),
        "fidelity": (fd.fidelity, {  # refused: such models are not known
            "case": case(), "count": 2, "reference": "shell", "divisions": [2, 3],
            "models": ["none"], "secant": 2.0, "vertex_radius": 1e-3, "progress": print,
        }),
        "periodic_motion": (fd.periodic_motion, {
            "case": shaken(), "frequency": 1.0, "harmonics": 1, "method": "harmonic_balance",
            "guess": None, "periods": 1, "modes": None, "steps": 8, "tolerance": 1e-6,
        }),
        "response_curve": (fd.response_curve, {
            "case": shaken(), "frequencies": (1.0, 1.02), "harmonics": 1, "measure": None,
            "amplitudes": None, "guess": None, "periods": 1, "modes": None, "branches": 0,
            "longest_step": 1.0, "most_points": 4, "steps": 8, "tolerance": 1e-6, "progress": None,
        }),
        "backbone": (fd.backbone, {
            "case": shaken(), "mode": 1, "amplitudes": (1e-6, 2e-6), "harmonics": 1,
            "damped": False, "state": None, "modes": None, "longest_step": 1.0, "most_points": 4,
            "tolerance": 1e-6, "progress": None,
        }),
    }  # fmt: skip
