"""The terms and the law of CONTRIBUTING, added to a copy of the package as the page says."""

from __future__ import annotations

import os
import re
import subprocess
import sys
from pathlib import Path

import pytest

from package_copies import copied

ROOT = Path(__file__).resolve().parents[1]
PROBE = """
import numpy as np
import foldyn as fd
from foldyn import checks
{imports}
structure = fd.discretize(fd.patterns.miura(cells=(2, 1)), fd.Sheet(1e6, 0.25, 0.01, 1.0))
BELOW = (structure.nodes[9] - (0.0, 0.0, 0.3999)).tolist()
load = fd.Force([9], (0.0, 0.0, -0.05), fd.Ramp(0.05, smooth=True))
case = fd.Case(structure, [fd.Fix("xmin"), {support}], [load])
body = case.body
q = 0.2 * np.random.default_rng(1).standard_normal(body.size)
q[29] = -0.05  # of node 9, along z
energy = lambda q: body.energies(q).sum()
assert checks.gradient_error(energy, body.internal, at=q, size=1e-5) < 1e-6
assert checks.tangent_error(body.internal, body.tangent, at=q, size=1e-5) < 1e-6
assert np.abs(body.internal(q) - structure.body.internal(q)).max() > 1e-3  # it acts
path = fd.trace(case, load_factors=[1.0])
modes = fd.modes(case, 4)
assert modes.frequency.values.min() > 0.0
ends = []
implicit = "newmark", "generalized_alpha", "energy_momentum"
for method in ("rk4", "central_difference", "dormand_prince", *implicit):
    step = 5e-4 if method in implicit else None
    found = fd.simulate(case, 0.05, method=method, dt=step)
    ends.append(found.displacement.values[-1])
    strain = sum(found[name] for name in case.energy_groups)
    balance = found.kinetic + strain + found.dissipated - found.work
    off = np.ptp(balance.values) / float(found.work.max())
    assert off < (1e-9 if method == "energy_momentum" else 2e-2), (method, off)
    assert float(found[{group!r}].max()) > 0.0
apart = [np.abs(end - ends[0]).max() / np.abs(ends[0]).max() for end in ends]
assert max(apart) < 2e-2, apart
from foldyn.cases.supports import SUPPORT
assert SUPPORT("", {table}) == case.supports[1]
"""
LAW_PROBE = """
import numpy as np
import foldyn as fd
sheet = fd.Sheet(1e6, 0.25, 0.01, 1.0)
pattern = fd.patterns.simple_fold(dihedral=120)
bars = {"preset": "herkal", "bend_law": "linear"}  # of other models more would be compiled
plain, stiff = (
    fd.discretize(pattern, sheet, fold_law=law, **bars) for law in ("linear", "stiffening")
)
theta, rest = 2.6, float(stiff.fold_rest[0])
assert stiff.fold_law.moment(theta, rest) == (theta - rest) * (1.0 + (theta - rest) ** 2)

def case(law, rest):
    structure = fd.discretize(
        pattern, sheet, fold_law=law, crease_rest=rest, crease_stiffness=0.01, **bars
    )
    held = [fd.Fix([4, 5]), fd.Fix([0, 1], "z")]
    return fd.Case(structure, held, [fd.Force([0, 1], (-1e-3, 0.0, 0.0))])

from foldyn.materials.stiffening import Stiffening

def end(growth, rest=125.0, method="statics"):
    built = case(Stiffening(growth), rest)
    if method == "statics":
        return float(fd.trace(built, load_factors=[1.0]).displacement[-1].sel(node=0, axis="x"))
    found = fd.simulate(built, 0.1, method=method, dt=3e-4)
    return float(found.displacement[-1].sel(node=0, axis="x"))

for method in ("statics", "rk4"):
    one, other = end(2.0, method=method), end(0.0, method=method)
    assert abs(one - other) > 1e-3 * abs(other), method
values, analysis = {"growth": 2.0, "rest": 125.0}, {"kind": "statics", "load_factors": [1.0]}
build = lambda growth, rest: case(Stiffening(growth), rest)
found = fd.sensitivity(build, values, measures="displacement[0,x]", analysis=analysis)
for name, h in (("growth", 1e-3), ("rest", 1e-2)):
    ends = [end(**(values | {name: values[name] + k * h})) for k in (-1, 1)]
    difference = (ends[1] - ends[0]) / (2.0 * h)
    assert abs(found[f"gradient_{name}"].values[0] / difference - 1.0) < 1e-3, name
"""


def blocks(title: str) -> list[str]:
    """The Python blocks below a heading of CONTRIBUTING."""
    text = (ROOT / "CONTRIBUTING.md").read_text("utf-8").split(f"### {title}\n")[1]
    return re.findall(r"```python\n(.*?)```", re.split(r"\n##", text)[0], re.S)


@pytest.fixture
def copy(tmp_path):
    """A copy of the package with the kernels that are compiled already."""
    return copied(tmp_path, kernels=True)


def register(package: Path, module: str, name: str) -> None:
    """Put a support into its registry."""
    path = package / "cases/supports.py"
    text = path.read_text("utf-8")
    text = text.replace(
        "\n\n\n@dataclass", f"\nfrom foldyn.cases.{module} import {name}\n\n\n@dataclass", 1
    )
    path.write_text(text.replace("Dashpot | Link\n", f"Dashpot | Link | {name}\n"), "utf-8")


def run(package: Path, probe: str = PROBE, **names: str) -> None:
    command = [sys.executable, "-W", "ignore", "-c", probe.format(**names) if names else probe]
    environment = {**os.environ, "PYTHONPATH": str(package.parent)}
    environment.pop("NUMBA_CACHE_DIR", None)
    done = subprocess.run(command, env=environment, capture_output=True, text=True)
    assert done.returncode == 0, done.stderr


@pytest.mark.matrix
def test_springs_with_a_cubic_force(copy):
    kernels, support, _ = blocks("A term")
    (copy / "mechanics/cubic_springs.py").write_text(kernels, "utf-8")
    (copy / "cases/cubic_springs.py").write_text(support, "utf-8")
    register(copy, "cubic_springs", "CubicSpring")
    run(
        copy, imports="from foldyn.cases.cubic_springs import CubicSpring", group="strain_cubic",
        support="CubicSpring(300.0, [(3, 9), (7, 14)])",
        table="{'cubic': 300.0, 'between': [[3, 9], [7, 14]]}",
    )  # fmt: skip


@pytest.mark.matrix
def test_a_sphere(copy):
    (copy / "cases/spheres.py").write_text(blocks("A term")[2], "utf-8")
    register(copy, "spheres", "Sphere")
    stub = copy / "__init__.pyi"
    text = stub.read_text("utf-8")
    line = next(line for line in text.splitlines() if line.startswith("from foldyn.cases import"))
    stub.write_text(
        text.replace(line, f"from foldyn.cases.spheres import Sphere as Sphere\n{line}")
    )
    run(
        copy, imports="", group="strain_spheres", support="fd.Sphere(BELOW, 0.4, 20.0)",
        table="{'center': BELOW, 'radius': 0.4, 'sphere': 20.0}",
    )  # fmt: skip


@pytest.mark.matrix
def test_a_hinge_law(copy):
    """It has moments, motions and gradients; only the line in the registry names it."""
    (copy / "materials/stiffening.py").write_text(blocks("A law")[0], "utf-8")
    path = copy / "materials/switch.py"
    text = path.read_text("utf-8")
    text = text.replace("ogden, plate_superlinear,", "ogden, plate_superlinear, stiffening,", 1)
    last = "plate_superlinear.PlateSuperlinear,"
    path.write_text(text.replace(last, f"{last} stiffening.Stiffening,", 1), "utf-8")
    run(copy, LAW_PROBE)
