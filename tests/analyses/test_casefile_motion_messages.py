"""The one message that a bad case file gets: moving supports, actuation and the start."""

from __future__ import annotations

import pytest
from casefile_checks import check

from case_texts import changed, rows

# edits of the example, and how the message begins
BAD = """
supports[0].axes =; supports[0].axis = "xyz" | supports[0].displacement: missing; give it (m), or
    write axes instead of axis to hold
supports[0] = { nodes = [0, 1, 2], axis = "xyz", displacement = 0.1 } | supports[0].axis = "xyz":
    must be one of "x", "y" and "z"
supports[0].axes =; supports[0].displacement = 0.1 | supports[0].axis: give the axis of
    the displacement
supports[0].axes = "x"; supports[0].displacement = 0.1 | supports[0].axes: holds nodes at rest,
    and axis = "x", say, moves them; leave out displacement
supports[0].axes = "x"; supports[0].history = { kind = "step" } | supports[0].axes: holds nodes at
    rest, and axis = "x", say, moves them; leave out history
supports[0].axes =; supports[0].history = { kind = "step" } | supports[0].displacement:
    missing; give it (m), or write axes
supports[0] = { nodes = [0, 1, 2], axis = "x", displacement = nan } | supports[0].displacement =
    nan: must be a finite number
supports[0] = { nodes = [0, 1, 2], axis = "x", displacement = [0.1, 0.2] } |
    supports[0].displacement = [0.1, 0.2]: 2 values for 3 nodes; give one, or one for each
supports[0] = { nodes = "xmin", axis = "x", displacement = [0] } | supports[0].displacement =
    [0.0]: one displacement per node needs node numbers, but nodes
supports[0] = { nodes = [0, 1, 2], axis = "x", displacement = 1, history = { kind = "ramp",
    duration = 0 } } | supports[0].history.duration = 0: must be greater than 0
supports[1] = { nodes = [2, 3], axis = "y", displacement = 0 } | supports[1]: node 2 is held and
    imposed along y, a contradictory support; leave out one
supports[0].nodes = | supports[0].nodes: missing; give its value
supports[0].nodes =; supports[0].axes = | supports[0]: give nodes and axes or direction (held),
    nodes, axis and displacement
supports[1] = { base = "xy", history = { kind = "step" } } | supports[1].base = "xy": must be one
    of "x", "y" and "z"
supports[1] = { base = "x" } | supports[1].history: missing; give the motion of the base over time
supports[0].axes =; supports[0].base = "x"; supports[0].history = { kind = "step" } |
    supports[0].base: moves all nodes that supports hold along its axis; leave out nodes
supports[1] = { base = "x", displacement = [1], history = { kind = "step" } } |
    supports[1].displacement = [1]: must be a number
supports[0].axes = "yz"; supports[1] = { base = "x", history = { kind = "step" } } | supports[1]:
    the base moves along x, but no support holds a node along x; add one with
loads[0] = { creases = "mountains", angle = 90 } | loads[0].creases = "mountains": did you mean
    'mountain'? this pattern knows
loads[0] = { creases = [0, 4], angle = 90 } | loads[0].creases = [0, 4]: crease 4 is out of range;
    this structure has creases 0 to 3
loads[0] = { creases = [0], angle = 400 } | loads[0].angle = 400: must lie between 0 and 360
    degrees (flat: 180)
loads[0] = { creases = "all", angle = [90, 90] } | loads[0].angle = [90.0, 90.0]: 2 values for 4
    creases; give one, or one for each
loads[0] = { creases = [0], angle = 360 } | loads[0].angle = 360: this fold law, free of stress at
    rest, has an infinite moment there
loads[0] = { creases = [0] } | loads[0].angle: missing; give it (degrees), or fold_angle or
    fraction
loads[0] = { angle = 90 } | loads[0].creases: missing; give its value
loads[0].creases = [0]; loads[0].angle = 90 | loads[0].angle: creases that fold are a load of
    their own; leave out nodes and force
loads[0] = { creases = [0], gravity = [0, 0, -9.81] } | loads[0].gravity: acts on the whole
    structure; leave out creases, or write
loads[0] = { creases = [2], angle = 90 }; loads[1] = { creases = [1, 2], angle = 90 } |
    loads[1].creases: crease 2 is actuated by loads[0] already; leave it out of one
initial = {} | initial: give velocity or spin or both, or file (a result)
initial = { velocty = [0, 0, 1] } | initial.velocty: unknown key; did you mean 'velocity'? known
    keys: velocity, spin, file
initial.velocity = 1: must be three numbers (x, y, z)
initial = { spin = [0, inf, 0] } | initial.spin[1] = inf: must be a finite number
initial = { velocity = [0, 0.5, 0] } | initial: velocity = [0.0, 0.5, 0.0]: moves node 0 along y
    with 0.5 m/s, where a support
initial.file = 3: must be the path of a result
initial = { file = "a.nc", spin = [0, 0, 1] } | initial.file: holds the velocities too; leave out
    spin
initial = { file = "a.nc", at = 1.5 } | initial.at = 1.5: must be a whole number
initial = { velocity = [0, 0, 0], at = 3 } | initial.at: is the number of a sample of a result;
    give file too
"""


@pytest.mark.parametrize(("edits", "message"), rows(BAD))
def test_a_bad_file_gets_one_message(read, example, edits, message) -> None:
    check(read, changed(example, edits), message)
