"""Contact as an argument: what is checked, cases in writing, case files."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
import xarray as xr

import foldyn as fd
from case_texts import FOLD_TEXT, LIFTED_TEXT
from foldyn.analyses.provenance import inputs
from foldyn.cases.document import from_document, to_document
from foldyn.errors import InputError
from foldyn.tables import read

SHEET = fd.Sheet(1e6, 0.25, 0.01, density=1.0)
FOLD = fd.discretize(fd.patterns.simple_fold(a=1.0, b=1.0, dihedral=60), SHEET, preset="plate")
PLANE = fd.Plane((0, 0, -0.1), (0, 0, 2), friction=0.4, motion=(0, 0, 0.2), history=fd.Ramp(1.0))


@pytest.mark.parametrize(
    ("make", "message"),
    [
        (lambda: fd.Contact(thickness=0.0), "thickness = 0"),
        (lambda: fd.Contact(friction=-0.1), "friction = -0.1"),
        (lambda: fd.Contact(stiffness=0.0), "stiffness = 0"),
        (lambda: fd.Contact(panels=False), "panels: without planes nothing touches"),
        (lambda: fd.Contact(planes=[1]), r"planes\[0\] = 1: must be a Plane"),
        (lambda: fd.Contact(planes=PLANE), "must be a list of Plane"),
        (lambda: fd.Plane((0, 0), (0, 0, 1)), "point = "),
        (lambda: fd.Plane((0, 0, 0), (0, 0, 0)), "normal = "),
        (lambda: fd.Plane((0, 0, 0), (0, 0, 1), friction=-1), "friction = -1"),
        (lambda: fd.Plane((0, 0, 0), (0, 0, 1), history=fd.Ramp(1)), "history needs the motion"),
        (lambda: fd.Case(FOLD, contact=True), "contact = true: must be a Contact"),
    ],
)
def test_what_cannot_be_used_is_refused(make, message):
    with pytest.raises(InputError, match=message):
        make()


def test_a_case_in_writing_keeps_its_contact():
    above = {"point": (0, 0, 9), "normal": (0, 0, -1)}
    planes = [PLANE, fd.Plane(**above), fd.Plane(**above, motion=(0, 0, -1))]
    contact = fd.Contact(thickness=0.02, friction=0.1, stiffness=5.0, planes=planes)
    for given in (contact, None):
        document = to_document(fd.Case(FOLD, contact=given))
        assert document.obstacles == () and ("contact" in document.sections) == bool(given)
        assert from_document(document.sections, document.arrays).contact == given


@pytest.mark.parametrize(
    ("table", "message"),
    [
        ({"thicknes": 1.0}, r"\.thicknes: unknown key; did you mean 'thickness'"),
        ({"thickness": -1.0}, r"\.thickness = -1"),
        ({"planes": {}}, r"\.planes = .*: must be a list of tables"),
        ({"planes": [{"point": [0, 0, 0]}]}, r"\.planes\[0\]\.normal: missing"),
        ({"planes": [{"point": [0, 0, 0], "normal": "z"}]}, r"\.planes\[0\]\.normal = "),
        (1, " = 1: must be a table"),
    ],
)
def test_tables_name_what_is_wrong(table, message):
    with pytest.raises(InputError, match=message):
        read(fd.Contact, "", table)


CONTACT = f"""{FOLD_TEXT}[contact]
friction = 0.2
[[contact.planes]]
point = [0, 0, -0.1]
normal = [0, 0, 1]
friction = 0.45
"""


def test_a_case_file_has_contact(read):
    text = f"""{CONTACT}motion = [0, 0, 0.2]
history = {{ kind = "ramp", duration = 1.0 }}
[analysis]
kind = "dynamics"
method = "rk4"
duration = 0.1
"""
    contact = read(text).case().contact
    assert contact.friction == 0.2 and contact.planes[0].motion == (0.0, 0.0, 0.2)
    with pytest.raises(InputError, match=r"contact\.friction = -1"):
        read(text.replace("friction = 0.2", "friction = -1"))


SHELL = '[model]\nkind = "shell"\ndivisions = 2\n'


@pytest.mark.matrix
@pytest.mark.parametrize("model", ["", SHELL], ids=["bars and hinges", "shell"])
def test_in_a_path_the_load_factor_moves_planes(read, model):
    found = read(model + LIFTED_TEXT).run()
    lifted = found.displacement.sel(node=[4, 5], axis="z").values
    assert np.abs(lifted[0]).max() < 1e-9 and lifted[-1].min() > 0.014 - 0.005
    assert float(found.contact[-1]) > 0.0
    timed = LIFTED_TEXT.replace("0.02]", '0.02]\nhistory = { kind = "ramp", duration = 1.0 }')
    with pytest.raises(InputError, match=r"contact\.planes\[0\]\.history = .* a path has no time"):
        read(model + timed)


def test_what_may_touch_follows_the_sheet():
    parts = [fd.PanelSheet(panels=[1], thickness=0.02)]
    s = fd.discretize(FOLD.pattern, replace(SHEET, panels=parts), preset="plate")
    held = np.zeros(len(s.nodes), bool)
    made = fd.Contact().sheets(s, held)
    np.testing.assert_allclose(made.thickness, [0.01, 0.02])
    assert made.stiffness == pytest.approx(0.03 * 1e6 * 0.01)
    assert fd.Contact(thickness=0.05).sheets(s, held).thickness.tolist() == [0.05, 0.05]


def test_the_page_says_what_touches_and_where_it_began(read):
    case_file = read(f"""{CONTACT}[initial]
velocity = [0, 0, -1.5]
[analysis]
kind = "dynamics"
duration = 1.0
""")
    rows = dict(inputs(case_file, case_file.case(), {"mixed_voronoi": xr.Dataset()}))
    assert rows["contact"] == (
        "between panels; friction 0.2. Plane: point [0, 0, -0.1] m; normal [0, 0, 1]; friction 0.45"
    )
    assert rows["initial state"] == "velocity [0, 0, -1.5] m/s"
