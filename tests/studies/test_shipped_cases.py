"""Shipped motions and paths: what they are, what they keep, and the physics that they show."""

from __future__ import annotations

import re
from pathlib import Path

import numpy as np
import pytest

import foldyn as fd
from foldyn.studies import shipped_cases

DOCS = Path(__file__).resolve().parents[2] / "docs"


def masses(structure) -> np.ndarray:
    """Mass (kg) that moves with each node."""
    return np.asarray(structure.mass.sum(axis=1)).ravel()


# ------------------------------------------------------------------------------- deployment


def goal() -> fd.Pattern:
    return fd.patterns.miura(cells=(4, 4), a=0.025, b=0.025, panel_angle=60, dihedral=60)


def families(structure) -> np.ndarray:
    """True for creases along x, False for those across."""
    x, y, _ = np.ptp(structure.nodes[structure.pattern.creases], axis=1).T
    return x > y


def distances(points: np.ndarray) -> np.ndarray:
    return np.linalg.norm(points[:, None] - points, axis=-1)[np.triu_indices(len(points), 1)]


def short_deployment(folder: Path, *changes: tuple[str, str]) -> fd.CaseFile:
    """The shipped case, but faster."""
    text = fd.studies.find_case("gallery/deployment").read_text("utf-8")
    assert text.count("duration = 1.0") == 2
    text = text.replace("duration = 1.0", "duration = 0.25")
    for old, new in (("duration = 1.4", "duration = 0.5"), *changes):
        assert text.count(old) == 1
        text = text.replace(old, new)
    (folder / "case.toml").write_text(text, "utf-8")
    return fd.read_case(folder / "case.toml")


@pytest.mark.matrix
@pytest.mark.parametrize("dihedral", ["179.9", "180"])
def test_a_flat_sheet_deploys_into_the_miura(dihedral, tmp_path):
    case_file = short_deployment(tmp_path, ("dihedral = 179.9", f"dihedral = {dihedral}"))
    case = case_file.case()
    motion = fd.simulate(case, **case_file.analysis.arguments)
    s, u = case.structure, motion.displacement.to_numpy()
    vertices = len(s.pattern.vertices)
    apart = distances((s.nodes + u[-1])[:vertices]) / distances(goal().vertices)
    assert np.abs(apart - 1.0).max() < 1e-3  # observed: 6e-5
    # On the way too it is nearly one: all creases of a family turn alike, and both together.
    along = families(s)
    halfway = int(np.argmin(np.abs(motion.time.to_numpy() - 0.15)))
    angles = np.abs(np.pi - s.dihedrals(u[halfway])[0])
    p, q = angles[~along], angles[along]
    assert 0.5 < q.mean() < 1.8
    assert np.tan(p.mean() / 2) / np.tan(q.mean() / 2) == pytest.approx(0.5, abs=0.02)
    assert max(np.ptp(p), np.ptp(q)) < 0.1
    # Nothing outside acts on it.
    mass = masses(s)
    center = np.einsum("n,tnk->tk", mass / mass.sum(), u)
    assert np.abs(center).max() < 1e-15
    assert motion.attrs["energy_error"] < 1e-6


# --------------------------------------------------------------------------------- tumbling


@pytest.fixture(scope="module")
def tumbling(tmp_path_factory):
    """The case, its motion and the folder of the picture, as the documentation makes them."""
    page = (DOCS / "gallery.md").read_text("utf-8")
    (block,) = re.findall(r"^```python\n(.*?)^```$", page, re.M | re.S)
    folder = tmp_path_factory.mktemp("tumbling")
    names: dict = {}
    with pytest.MonkeyPatch.context() as patch:
        patch.chdir(folder)
        exec(compile(block, "gallery.md", "exec"), names)
    return names["case_file"].case(), names["motion"], folder


@pytest.mark.matrix
def test_free_flight_keeps_the_energy(tumbling):
    _, motion, _ = tumbling
    strain = motion.strain_bars + motion.strain_folds + motion.strain_bends
    energy = (motion.kinetic + strain - motion.work).to_numpy()
    assert np.abs(energy / energy[0] - 1.0).max() < 1e-6  # observed: 6e-8
    assert float(strain.max()) > 0.05 * energy[0]  # the folds take and give back a share of it
    assert float(np.abs(motion.dissipated).max()) == 0.0


@pytest.mark.matrix
def test_the_sheet_turns_over(tumbling):
    """In its own axes the angular momentum goes from one end of the middle axis to the other."""
    case, motion, _ = tumbling
    s, mass = case.structure, masses(case.structure)
    x = s.nodes + motion.displacement.to_numpy()
    x -= np.einsum("n,tnk->tk", mass / mass.sum(), x)[:, None]
    p = motion.velocity.to_numpy() * mass[:, None]
    rest = x[0]
    inertia = np.einsum("n,nk,nl->kl", mass, rest, rest)
    moments, axes = np.linalg.eigh(np.trace(inertia) * np.eye(3) - inertia)
    assert moments[0] < 0.5 * moments[1] < 0.45 * moments[2]  # three distinct ones
    middle = []
    for points, momentum in zip(x, p, strict=True):
        u, _, vt = np.linalg.svd((mass[:, None] * rest).T @ points)  # the rotation that fits best
        turn = (u @ np.diag([1.0, 1.0, np.linalg.det(u @ vt)]) @ vt).T
        spin = np.cross(points, momentum).sum(axis=0)
        middle.append(axes[:, 1] @ turn.T @ spin / np.linalg.norm(spin))
    assert abs(middle[0]) > 0.99
    assert min(np.array(middle) / middle[0]) < -0.99


@pytest.mark.matrix
def test_pictures_of_the_gallery_are_small(tumbling):
    _, _, folder = tumbling
    drawn = [DOCS / "images" / "deployment.gif", DOCS / "images" / "tumbling.gif"]
    for picture in (*drawn, folder / "tumbling.gif"):
        assert picture.stat().st_size < 400_000, picture


PATHS = {
    "gallery/deployment-static",
    "gallery/kresling",
    "gallery/kresling-displacement",
    "gallery/miura-bending",
    "gallery/miura-popthrough",
    "herkal/case1-static",
    "herkal/case2-static",
    "herkal/case3-static",
    "herkal/case4-static",
    "herkal/specimen",
    "herkal/specimen-weight",
}


@pytest.fixture(scope="module")
def traced():
    """Function that gives a shipped case and its path, computed once."""
    found: dict = {}

    def trace(name):
        if name not in found:
            case_file = fd.read_case(shipped_cases()[name])
            found[name] = case_file.case(), case_file.run()
        return found[name]

    return trace


@pytest.mark.matrix
def test_all_paths_are_known():
    kinds = {name: fd.read_case(path).analysis.kind for name, path in shipped_cases().items()}
    assert {name for name, kind in kinds.items() if kind == "statics"} == PATHS


@pytest.mark.parametrize("name", sorted(PATHS))
def test_all_paths_are_complete_and_fit_on_a_page(traced, name):
    case, path = traced(name)
    assert path.attrs["status"] == "complete"
    assert path.attrs["rerunnable"] == 1
    assert path.sizes["step"] <= 100
    assert len(fd.case_of(path).structure.nodes) == len(case.structure.nodes)


@pytest.mark.parametrize("number", [1, 2, 3, 4])
def test_the_case_studies_are_those_of_the_motions(number):
    """Same structure but for the mass, same supports, and the load without its pulse."""
    slow = fd.read_case(shipped_cases()[f"herkal/case{number}-static"]).case()
    fast = fd.read_case(shipped_cases()[f"herkal/case{number}"]).case()
    for name in ("nodes", "bars", "bar_area", "folds", "fold_stiffness", "bend_stiffness"):
        np.testing.assert_array_equal(
            getattr(slow.structure, name), getattr(fast.structure, name), err_msg=name
        )
    assert slow.structure.fold_law == fast.structure.fold_law
    assert slow.supports == fast.supports
    assert [(load.nodes, load.vector) for load in slow.loads] == [
        (load.nodes, load.vector) for load in fast.loads
    ]


def test_the_specimen_is_that_of_the_design(traced):
    """Section 7: geometry, stiffness, stroke."""
    case, path = traced("herkal/specimen")
    s = case.structure
    assert np.ptp(s.nodes[:, 0]) == pytest.approx(0.10048, abs=1e-8)
    assert s.fold_stiffness.max() == pytest.approx(0.4739e-3, rel=1e-3)  # N m/rad, 25 mm long
    rest = np.degrees(s.fold_rest)
    assert sorted({round(float(angle), 1) for angle in np.minimum(rest, 360 - rest)}) == [
        39.2,
        70.9,
    ]
    top = path.displacement.sel(node=range(7), axis="x").values
    np.testing.assert_allclose(top[-1], 0.056, rtol=1e-12)
    np.testing.assert_allclose(np.diff(top[:, 0]), 0.002, rtol=1e-9)
    force = fd.plots.total_reaction(path, range(7), direction="x")
    assert force[-1] == pytest.approx(0.438, abs=5e-4)  # tests/statics/test_specimen.py


def test_the_specimen_carries_its_weight(traced):
    case, path = traced("herkal/specimen-weight")
    _, light = traced("herkal/specimen")
    weight = 9.81 * float(case.structure.mass.sum())
    assert weight == pytest.approx(0.041, abs=0.004)
    top, bottom = (fd.plots.total_reaction(path, range(k, k + 7), direction="x") for k in (0, 56))
    np.testing.assert_allclose(top + bottom, -weight, rtol=1e-9)
    relief = fd.plots.total_reaction(light, range(7), direction="x") - top
    np.testing.assert_allclose(relief, 0.5 * weight, rtol=0.1)  # half of it hangs from the top


def heights():
    """Heights of the Kresling tower in which all edges have their lengths; see the case file."""
    h, R, p = 0.06, 0.04, np.radians(30)
    return h, np.sqrt(h**2 - 2 * R**2 * (np.cos(p) + np.cos(p + np.radians(60))))


def test_the_tower_has_the_second_state_of_its_geometry(traced):
    first, second = heights()
    for name in ("gallery/kresling", "gallery/kresling-displacement"):
        case, path = traced(name)
        states = fd.landscape(path, case).states
        assert [state.stable for state in states] == [True, False, True]
        assert states[2].stroke == pytest.approx(first - second, abs=3e-5)  # folds pull it back
        assert states[2].energy < 0.01 * states[1].energy
        # twisted by 90 degrees instead of 30
        x = (case.structure.nodes + states[2].displacement)[[0, 6]]
        turned = np.degrees(np.arctan2(*x[1, 1::-1]) - np.arctan2(*x[0, 1::-1]))
        assert turned == pytest.approx(90.0, abs=0.2)


def test_force_and_displacement_control_meet_on_one_curve(traced):
    _, loaded = traced("gallery/kresling")
    _, moved = traced("gallery/kresling-displacement")
    force = fd.plots.total_reaction(moved, range(6, 12), direction="-z")
    down = -moved.displacement.sel(node=6, axis="z").values
    limits = loaded.isel(step=loaded.point.values == "limit")
    assert limits.sizes["step"] == 2
    found = np.interp(-limits.displacement.sel(node=6, axis="z").values, down, force)
    np.testing.assert_allclose(6 * limits.load_factor.values, found, rtol=1e-2)  # 1 mm apart
    assert set(moved.negative_eigenvalues.values) == {0}
    first, second = np.flatnonzero(loaded.point.values == "limit").tolist()
    assert set(loaded.negative_eigenvalues.values[first + 1 : second]) == {1}


@pytest.mark.matrix
def test_the_popped_vertex_stays(traced):
    case, path = traced("gallery/miura-popthrough")
    assert (path.point.values == "limit").sum() == 2
    down = -path.displacement.sel(node=24, axis="z").values
    assert (np.diff(down) < 0.0).any()  # it turns back in displacement, too
    states = fd.landscape(path, case).states
    assert [state.stable for state in states] == [True, False, True]
    popped = states[2]
    assert popped.displacement[24, 2] == pytest.approx(-0.0144, abs=1e-4)
    height = case.structure.nodes[24, 2]
    assert height + popped.displacement[24, 2] < -0.3 * height  # from a peak to a pit
    # let go in that state, without any load, it is in equilibrium
    supports = case.supports
    free = fd.Case(case.structure, supports, [fd.Force([24], (0, 0, -1.0))])
    again = fd.trace(free, load_factors=[0.0], initial=fd.State(popped.displacement))
    np.testing.assert_allclose(again.displacement[0], popped.displacement, atol=1e-6)


def test_the_sheet_bends_to_a_saddle(traced):
    """Curvatures of opposite signs, with the ratio of the plane's Poisson's ratio.

    The plane's: from the lengths s and l of half a cell along x and y (section 3 of the design),
    nu = -(dl/l)/(ds/s) = -1.76; of a large rigid sheet the curvatures have the same ratio (Schenk
    and Guest 2013, Wei et al. 2013).
    """
    case, path = traced("gallery/miura-bending")

    def lengths(dihedral):
        cell = fd.patterns.miura(cells=(1, 1), panel_angle=60, dihedral=dihedral).vertices
        return np.array([cell[3, 0] - cell[0, 0], cell[2, 1] - cell[0, 1]])

    ds, dl = np.log(lengths(100.01) / lengths(99.99))
    assert -dl / ds == pytest.approx(-1.76, abs=0.005)
    valleys = [9 * i + j for i in range(0, 9, 2) for j in range(0, 9, 2)]
    for step in (1, 5, 10):
        x, y, z = (case.structure.nodes + path.displacement.values[step])[valleys].T
        x, y = x - x.mean(), y - y.mean()
        terms = np.stack([np.ones_like(x), x, y, x * x / 2, x * y, y * y / 2], axis=1)
        along, twist, across = np.linalg.lstsq(terms, z, rcond=None)[0][3:]
        assert along > 0.0 > across
        assert across / along == pytest.approx(-dl / ds, rel=0.11)
        assert abs(twist) < 1e-9 * along  # by symmetry


def test_the_sheet_folds_itself_into_the_miura(traced):
    case, path = traced("gallery/deployment-static")
    final = (case.structure.nodes + path.displacement.values[-1])[: len(goal().vertices)]
    np.testing.assert_allclose(distances(final), distances(goal().vertices), rtol=1e-8)
    assert np.ptp(case.structure.nodes[:, 2]) < 0.1 * case.structure.sheet.thickness  # flat at rest
    energy = sum(path[f"strain_{part}"].values for part in ("bars", "bends", "folds"))
    assert energy[-1] < 1e-15 * energy.max()
    # nothing outside acts on it
    assert path.sizes["support"] == 0
