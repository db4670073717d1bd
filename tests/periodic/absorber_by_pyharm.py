"""Make absorber_by_pyharm.csv: motions of the oscillator with an absorber by pyHarm.

pyHarm (SAFRAN, Apache-2.0) is a program of its own for harmonic balance; `pip install pyHarm-os`.
No test needs it. Results are of version 1.2.2: angular frequencies, rad/s, then the coefficients of
x and y for 1, cos, cos 2, ..., sin, sin 2, ..., m.
"""

from pathlib import Path

import numpy as np
from absorber import CUBIC, DASHPOT, FORCE, MASS, STIFFNESS

HARMONICS, SAMPLES, KEPT = 7, 256, 20
ENDS = 0.9, 1.3  # rad/s


def chain(own, between):
    """Matrix of a part between the ground and x, and one between x and y."""
    return np.array([[own + between, -between], [-between, between]])


def computed():
    """Rows (p, 1 + 2 (2 harmonics + 1)) of converged points."""
    from pyHarm.Maestro import Maestro

    inputs = {
        "system": {"type": "Base", "nh": HARMONICS, "nti": SAMPLES},
        "substructures": {
            "chain": {
                "ndofs": 1, "nnodes": 2,
                "matrix": {
                    "M": np.diag(MASS), "K": chain(*STIFFNESS), "C": chain(*DASHPOT),
                    "G": np.zeros((2, 2)),
                },
            }
        },
        "connectors": {
            "ground": {
                "type": "CubicSpring", "connect": {"chain": [0]}, "dirs": [0], "k": CUBIC[0],
            },
            "between": {
                "type": "CubicSpring", "connect": {"chain": [0], "INTERNAL": [1]}, "dirs": [0],
                "k": CUBIC[1],
            },
            "drive": {"type": "SinusForcing", "connect": {"chain": [0]}, "dirs": [0], "amp": FORCE},
        },
        "analysis": {
            "frf": {
                "study": "frf", "puls_inf": ENDS[0], "puls_sup": ENDS[1], "ds0": 0.02,
                "ds_max": 0.1, "verbose": False,
                "solver_options": {"root": {"method": "hybr", "options": {"xtol": 1e-12}}},
            }
        },
    }  # fmt: skip
    run = Maestro(inputs)
    run.operate()
    order = run.system.expl_dofs
    order = order[order["sub"] == "chain"].sort_values(["node_num", "cs", "harm"]).index
    points = [point.x for point in run.nls["frf"].SolList if point.flag_accepted]
    return np.array([[x[-1], *x[order]] for x in points])


if __name__ == "__main__":
    rows = computed()
    chosen = rows[np.linspace(0, len(rows) - 1, KEPT).round().astype(int)]
    np.savetxt(Path(__file__).with_suffix(".csv"), chosen, "%.12g", ",")
