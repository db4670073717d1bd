"""Air as an argument: its drag coefficient, its place in case files, and what is refused."""

import pytest

import foldyn as fd
from foldyn.cases.document import from_document, to_document
from foldyn.errors import InputError


def plate(a=1.0, b=1.0):
    pattern = fd.Pattern([(0, 0), (a, 0), (a, b), (0, b)], [(0, 1, 2, 3)])
    return fd.discretize(pattern, fd.Sheet(1e6, 0.25, 0.01, density=1000.0), preset="plate")


@pytest.mark.parametrize(
    ("ratio", "published"), [(1.0, 1.18), (5.0, 1.2), (10.0, 1.3), (20.0, 1.5)]
)
def test_drag_of_rectangles_is_that_of_whites_table(ratio, published):
    """White (2011), Fluid Mechanics, table 7.3, plates normal to the flow."""
    for structure in (plate(ratio), plate(0.1, 0.1 * ratio)):
        assert fd.Air().coefficient(structure) == pytest.approx(published, rel=1e-12)
    assert fd.Air(drag_coefficient=0.5).coefficient(plate(ratio)) == 0.5


def test_air_is_written_and_read():
    air = fd.Air(density=998.0, velocity=(1, 0, 2), added_mass="local", resolution=6)
    document = to_document(fd.Case(plate(), air=air))
    assert not document.obstacles
    assert from_document(document.sections, document.arrays).air == air


@pytest.mark.parametrize(
    ("given", "told"),
    [
        ({"density": -1.0}, "density = -1.0: must be greater than 0"),
        ({"density": 0}, "density = 0: must be greater than 0"),
        ({"velocity": (1, 2)}, "velocity .*: must be three numbers"),
        ({"drag_coefficient": -0.1}, "drag_coefficient = -0.1: must be at least 0"),
        ({"resolution": 3}, "resolution = 3: must be even"),
        ({"resolution": 0}, "resolution = 0: must be a whole number, at least 2"),
        ({"added_mass": "far"}, 'added_mass = "far": must be true, false or "local"'),
        ({"added_mass": False, "drag": False}, "drag: without added mass and drag nothing acts"),
    ],
)
def test_wrong_arguments_are_refused(given, told):
    with pytest.raises(InputError, match=told):
        fd.Air(**given)
