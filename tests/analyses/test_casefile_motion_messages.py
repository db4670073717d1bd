"""The one message that a bad case file gets: moving supports, actuation and the start."""

from __future__ import annotations

import pytest
from casefile_checks import check, edited

# what is replaced in the example, by what, and how the message begins
BAD = {
    "axis for axes": (
        [('axes = "xyz"', 'axis = "xyz"')],
        "supports[0].displacement: missing; give it (m), or write axes instead of axis to hold",
    ),
    "imposed axes": (
        [('axes = "xyz"', 'axis = "xyz"\ndisplacement = 0.1')],
        'supports[0].axis = "xyz": must be one of "x", "y" and "z"',
    ),
    "imposed without axis": (
        [('axes = "xyz"', "displacement = 0.1")],
        "supports[0].axis: give the axis of the displacement",
    ),
    "imposed on axes": (
        [('axes = "xyz"', 'axes = "x"\ndisplacement = 0.1')],
        'supports[0].axes: holds nodes at rest, and axis = "x", say, moves them; leave out displ',
    ),
    "held with a history": (
        [('axes = "xyz"', 'axes = "x"\nhistory = { kind = "step" }')],
        'supports[0].axes: holds nodes at rest, and axis = "x", say, moves them; leave out hist',
    ),
    "history of nothing": (
        [('axes = "xyz"', 'history = { kind = "step" }')],
        "supports[0].displacement: missing; give it (m)",
    ),
    "imposed nan": (
        [('axes = "xyz"', 'axis = "x"\ndisplacement = nan')],
        "supports[0].displacement = nan: must be a finite number",
    ),
    "imposed list": (
        [('axes = "xyz"', 'axis = "x"\ndisplacement = [0.1, 0.2]')],
        "supports[0].displacement = [0.1, 0.2]: 2 values for 3 nodes; give one, or one for each",
    ),
    "imposed list on a selection": (
        [
            ('nodes = [0, 1, 2]\naxes = "xyz"', 'nodes = "xmin"\naxis = "x"\ndisplacement = [0]'),
        ],
        "supports[0].displacement = [0.0]: one displacement per node needs node numbers, but",
    ),
    "imposed history": (
        [
            (
                'axes = "xyz"',
                'axis = "x"\ndisplacement = 1\nhistory = { kind = "ramp", duration = 0 }',
            )
        ],
        "supports[0].history.duration = 0: must be greater than 0",
    ),
    "held and imposed": (
        [("[[loads]]", '[[supports]]\nnodes = [2, 3]\naxis = "y"\ndisplacement = 0\n[[loads]]')],
        "supports[1]: node 2 is held and imposed along y, a contradictory support; leave out one",
    ),
    "support without nodes": (
        [("nodes = [0, 1, 2]\n", "")],
        "supports[0].nodes: missing; give its value",
    ),
    "empty support": (
        [('nodes = [0, 1, 2]\naxes = "xyz"', "")],
        "supports[0]: give nodes and axes or direction (held), nodes, axis and displacement",
    ),
    "base axis": (
        [("[[loads]]", '[[supports]]\nbase = "xy"\nhistory = { kind = "step" }\n[[loads]]')],
        'supports[1].base = "xy": must be one of "x", "y" and "z"',
    ),
    "base without history": (
        [("[[loads]]", '[[supports]]\nbase = "x"\n[[loads]]')],
        "supports[1].history: missing; give the motion of the base over time",
    ),
    "base with nodes": (
        [('axes = "xyz"', 'base = "x"\nhistory = { kind = "step" }')],
        "supports[0].base: moves all nodes that supports hold along its axis; leave out nodes",
    ),
    "base displacement": (
        [
            (
                "[[loads]]",
                '[[supports]]\nbase = "x"\ndisplacement = [1]\nhistory = { kind = "step" }\n'
                "[[loads]]",
            )
        ],
        "supports[1].displacement = [1]: must be a number",
    ),
    "base of nothing": (
        [('axes = "xyz"', 'axes = "yz"\n[[supports]]\nbase = "x"\nhistory = { kind = "step" }')],
        "supports[1]: the base moves along x, but no support holds a node along x; add one with",
    ),
    "creases in words": (
        [("nodes = [6, 7, 8]\nforce = [0.01, 0, 0]", 'creases = "mountains"\nangle = 90')],
        "loads[0].creases = \"mountains\": did you mean 'mountain'? this pattern knows",
    ),
    "crease number": (
        [("nodes = [6, 7, 8]\nforce = [0.01, 0, 0]", "creases = [0, 4]\nangle = 90")],
        "loads[0].creases = [0, 4]: crease 4 is out of range; this structure has creases 0 to 3",
    ),
    "angle": (
        [("nodes = [6, 7, 8]\nforce = [0.01, 0, 0]", "creases = [0]\nangle = 400")],
        "loads[0].angle = 400: must lie between 0 and 360 degrees (flat: 180)",
    ),
    "angles": (
        [("nodes = [6, 7, 8]\nforce = [0.01, 0, 0]", 'creases = "all"\nangle = [90, 90]')],
        "loads[0].angle = [90.0, 90.0]: 2 values for 4 creases; give one, or one for each",
    ),
    "closed crease": (
        [("nodes = [6, 7, 8]\nforce = [0.01, 0, 0]", "creases = [0]\nangle = 360")],
        "loads[0].angle = 360: this fold law, free of stress at rest, has an infinite moment there",
    ),
    "creases without angle": (
        [("nodes = [6, 7, 8]\nforce = [0.01, 0, 0]", "creases = [0]")],
        "loads[0].angle: missing; give it (degrees), or fold_angle or fraction",
    ),
    "angle without creases": (
        [("nodes = [6, 7, 8]\nforce = [0.01, 0, 0]", "angle = 90")],
        "loads[0].creases: missing; give its value",
    ),
    "creases with a force": (
        [("force = [0.01, 0, 0]", "force = [0.01, 0, 0]\ncreases = [0]\nangle = 90")],
        "loads[0].angle: creases that fold are a load of their own; leave out nodes and force",
    ),
    "creases with gravity": (
        [("nodes = [6, 7, 8]\nforce = [0.01, 0, 0]", "creases = [0]\ngravity = [0, 0, -9.81]")],
        "loads[0].gravity: acts on the whole structure; leave out creases, or write",
    ),
    "crease actuated twice": (
        [
            (
                "nodes = [6, 7, 8]\nforce = [0.01, 0, 0]",
                "creases = [2]\nangle = 90\n[[loads]]\ncreases = [1, 2]\nangle = 90",
            )
        ],
        "loads[1].creases: crease 2 is actuated by loads[0] already; leave it out of one",
    ),
    "empty start": (
        [("[analysis]", "[initial]\n[analysis]")],
        "initial: give velocity or spin or both, or file (a result)",
    ),
    "start key": (
        [("[analysis]", "[initial]\nvelocty = [0, 0, 1]\n[analysis]")],
        "initial.velocty: unknown key; did you mean 'velocity'? known keys: velocity, spin, file",
    ),
    "start velocity": (
        [("[analysis]", "[initial]\nvelocity = 1\n[analysis]")],
        "initial.velocity = 1: must be three numbers (x, y, z)",
    ),
    "start spin": (
        [("[analysis]", "[initial]\nspin = [0, inf, 0]\n[analysis]")],
        "initial.spin[1] = inf: must be a finite number",
    ),
    "start moves a support": (
        [("[analysis]", "[initial]\nvelocity = [0, 0.5, 0]\n[analysis]")],
        "initial: velocity = [0.0, 0.5, 0.0]: moves node 0 along y with 0.5 m/s, where a support",
    ),
    "start file": (
        [("[analysis]", "[initial]\nfile = 3\n[analysis]")],
        "initial.file = 3: must be the path of a result",
    ),
    "start file and velocity": (
        [("[analysis]", '[initial]\nfile = "a.nc"\nspin = [0, 0, 1]\n[analysis]')],
        "initial.file: holds the velocities too; leave out spin",
    ),
    "start sample": (
        [("[analysis]", '[initial]\nfile = "a.nc"\nat = 1.5\n[analysis]')],
        "initial.at = 1.5: must be a whole number",
    ),
    "start sample of nothing": (
        [("[analysis]", "[initial]\nvelocity = [0, 0, 0]\nat = 3\n[analysis]")],
        "initial.at: is the number of a sample of a result; give file too",
    ),
}


@pytest.mark.parametrize("name", BAD)
def test_a_bad_file_gets_one_message(read, example, name) -> None:
    edits, message = BAD[name]
    check(read, edited(example, edits), message)
