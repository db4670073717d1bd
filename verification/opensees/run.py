"""Run cases with OpenSees and store the results.

    python -m verification.opensees.run case1 case2 --divisions 16 --motion --dt 0.005

writes statics and frequencies, and with `--motion` the motion instead, to `--out`, by default the
folder of stored results.
"""

from __future__ import annotations

import argparse
import sys
from importlib.metadata import version
from itertools import product
from pathlib import Path
from typing import Any

from foldyn.analyses import CaseFile
from foldyn.errors import FoldynError
from foldyn.studies.herkal.runs import CASES, case_study
from verification.opensees import stored
from verification.opensees.model import PanelShells

DT = 0.005  # s
SAMPLES = 0.01  # s: interval of stored samples


def still(name: str, divisions: int) -> stored.Still:
    """Statics under the loads of a case, and its frequencies at rest."""
    case_file, shells = _shells(name, divisions)
    path, node = shells.path(), case_file.output.nodes
    return stored.Still(
        node=node,
        load_factor=path.at,
        displacement=path.displacement[:, node],
        frequency=shells.frequencies(),
        about=_about(name, shells) | {"iterations": path.iterations, "seconds": path.seconds},
    )


def motion(name: str, divisions: int, dt: float) -> stored.Moved:
    """Motion of a case over the duration in its file."""
    case_file, shells = _shells(name, divisions)
    duration, node = case_file.analysis.arguments["duration"], case_file.output.nodes
    found = shells.motion(duration, dt, every=max(1, round(SAMPLES / dt)))
    about = {"dt": dt, "iterations": found.iterations, "seconds": found.seconds}
    return stored.Moved(
        node=node,
        time=found.at,
        displacement=found.displacement[:, node],
        about=_about(name, shells) | about,
    )


def _shells(name: str, divisions: int) -> tuple[CaseFile, PanelShells]:
    case_file = case_study(name)
    return case_file, PanelShells(case_file.case(), divisions)


def _about(name: str, shells: PanelShells) -> dict[str, Any]:
    return {
        "case": name,
        "divisions": shells.divisions,
        "triangles": len(shells.mesh.triangles),
        "nodes": len(shells.mesh.points),
        "opensees": version("opensees"),
    }


def main(arguments: list[str] | None = None) -> int:
    """Run the command line."""
    parser = argparse.ArgumentParser(description="Run cases with OpenSees.")
    parser.add_argument("cases", nargs="+", choices=CASES)
    parser.add_argument("--divisions", type=int, nargs="+", default=[16])
    parser.add_argument("--motion", action="store_true", help="the motion, not statics")
    parser.add_argument("--dt", type=float, default=DT, help="time step of the motion, s")
    parser.add_argument("--out", type=Path, default=stored.RESULTS, help="folder of the results")
    chosen = parser.parse_args(arguments)
    chosen.out.mkdir(parents=True, exist_ok=True)
    try:
        for divisions, name in product(chosen.divisions, chosen.cases):
            if chosen.motion:
                path = stored.write_motion(motion(name, divisions, chosen.dt), chosen.out)
            else:
                path = stored.write_still(still(name, divisions), chosen.out)
            print(path.name, flush=True)
    except FoldynError as error:
        print(error, file=sys.stderr)
        return 1
    return 0


if __name__ == "__main__":
    sys.exit(main())
