"""Input decks run by the programs that are there: OpenSees, and CalculiX for those of Abaqus."""

from __future__ import annotations

import os
import re
import shutil
import subprocess
import sys
from importlib.util import find_spec

import numpy as np
from scipy import sparse
from scipy.sparse.linalg import LinearOperator, eigsh, splu

HAS_OPENSEES = find_spec("opensees") is not None
HAS_CALCULIX = shutil.which("ccx") is not None


def by_opensees(deck):
    """Frequencies (Hz), and displacements of the vertices under all loads."""
    own = {"OPENBLAS_NUM_THREADS": "1", "OMP_NUM_THREADS": "1"}
    command = [sys.executable, "-m", "opensees", str(deck)]
    made = subprocess.run(command, env=os.environ | own, capture_output=True, text=True, check=True)
    rows = [line.split() for line in made.stdout.splitlines()]
    frequency = [float(row[1]) for row in rows if row and row[0] == "frequency"]
    moved = [list(map(float, row[2:])) for row in rows if row and row[0] == "displacement"]
    return np.array(frequency), np.array(moved)


def by_calculix(deck, count=5):
    """The same; statics are linear.

    Its flat thin shell of three nodes and six degrees of freedom, US3, stands for STRI3. Its own
    frequencies ignore the mass of that element: here they come of the matrices that it stores.
    """
    folder, text = deck.parent, for_calculix(deck.read_text())
    steps = text.index("*STEP\n")
    second = text.find("*STEP\n", steps + 1)
    frequencies = text[: second if second > 0 else None]
    _calculix(folder, "matrices", frequencies.replace("CY\n", "CY, SOLVER=MATRIXSTORAGE\n"))
    stiffness, mass = (_matrix(folder / f"matrices.{end}") for end in ("sti", "mas"))
    solved = splu(stiffness.tocsc())
    inverse = LinearOperator(stiffness.shape, solved.solve)
    found = eigsh(mass, count, M=stiffness, Minv=inverse, which="LM", return_eigenvectors=False)
    frequency = np.sort(1.0 / np.sqrt(found)) / (2.0 * np.pi)
    if second < 0:
        return frequency, None
    _calculix(folder, "statics", text[:steps] + text[second:])
    rows = [line.split() for line in (folder / "statics.dat").read_text().splitlines()]
    return frequency, np.array([list(map(float, r[1:4])) for r in rows if r and r[0].isdecimal()])


def for_calculix(text):
    """The deck with other words for the element, and without large displacements."""
    user = "*USER ELEMENT, TYPE=US3, NODES=3, INTEGRATION POINTS=3, MAXDOF=6\n"
    text = text.replace("*ELEMENT, TYPE=STRI3", user + "*ELEMENT, TYPE=US3", 1)
    text = text.replace("TYPE=STRI3", "TYPE=US3")
    section = r"*USER SECTION, \1, CONSTANTS=1"
    text = re.sub(r"\*SHELL SECTION, (ELSET=\w+, MATERIAL=\w+)", section, text)
    return text.replace("*STEP, NLGEOM, INC=1000", "*STEP").replace("*STATIC\n0.1, 1", "*STATIC")


def _calculix(folder, name, text):
    (folder / f"{name}.inp").write_text(text)
    made = subprocess.run(["ccx", name], cwd=folder, capture_output=True, text=True)
    assert "*ERROR" not in made.stdout, made.stdout[-2000:]


def _matrix(path):
    """A symmetric matrix of which one triangle is stored."""
    row, column, value = np.loadtxt(path).T
    row, column = row.astype(int) - 1, column.astype(int) - 1
    size = row.max() + 1
    upper = sparse.csc_array((value, (row, column)), (size, size))
    return upper + sparse.triu(upper, 1).T
