"""The shipped motions of the gallery: what they are, and what they keep."""

from __future__ import annotations

import re
from pathlib import Path

import numpy as np
import pytest

import foldyn as fd

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


def test_the_creases_of_the_deployment_are_those_of_a_miura():
    case = fd.read_case(fd.studies.find_case("gallery/deployment")).case()
    s = case.structure
    folded = fd.discretize(goal(), s.sheet)
    np.testing.assert_array_equal(s.pattern.creases, folded.pattern.creases)
    change = sum(change for change, _ in case.actuation_terms)
    np.testing.assert_allclose(s.fold_rest + change, folded.fold_rest, atol=1e-9)
    # flat to within its own thickness
    assert np.ptp(s.nodes[:, 2]) < 0.1 * s.sheet.thickness
    # tan(p/2) = cos(panel angle) tan(q/2) of the two families
    along = families(s)
    p, q = (np.abs(np.pi - folded.fold_rest[kind]) for kind in (~along, along))
    np.testing.assert_allclose(np.tan(p / 2), 0.5 * np.tan(q[0] / 2), rtol=1e-9)


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


def test_the_wrong_way_is_not_this_miura(tmp_path):
    """With mountains and valleys of one family exchanged the sheet folds into something else."""
    rows = goal().families["straight"]
    angles = [82.0 if goal().assignments[row] == "M" else -82.0 for row in rows]
    case_file = short_deployment(
        tmp_path,
        ("fold_angle = 81.7867893", f"fold_angle = {angles}"),
        ('creases = "straight"', f"creases = {rows.tolist()}"),
    )
    case = case_file.case()
    motion = fd.simulate(case, **case_file.analysis.arguments)
    final = (case.structure.nodes + motion.displacement[-1].to_numpy())[:81]
    assert np.abs(distances(final) / distances(goal().vertices) - 1.0).max() > 0.1


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
def test_free_flight_keeps_the_momenta(tumbling):
    case, motion, _ = tumbling
    s, t = case.structure, motion.time.to_numpy()
    mass, g = masses(s), np.array([0.0, 0.0, -9.81])
    x = s.nodes + motion.displacement.to_numpy()
    p = motion.velocity.to_numpy() * mass[:, None]  # this mass rule is diagonal
    linear = p.sum(axis=1) - mass.sum() * g * t[:, None]
    # observed: 8e-15
    np.testing.assert_allclose(linear, 0 * linear + linear[0], atol=1e-12 * np.abs(linear).max())
    np.testing.assert_allclose(linear[0], mass.sum() * np.array([0.4, 0.0, 2.0]), atol=1e-15)
    center = np.einsum("n,tnk->tk", mass / mass.sum(), x)
    parabola = center[0] + t[:, None] * [0.4, 0.0, 2.0] + 0.5 * g * t[:, None] ** 2
    np.testing.assert_allclose(center, parabola, atol=1e-13)
    angular = np.cross(x - center[:, None], p).sum(axis=1)
    # observed: 9e-15
    np.testing.assert_allclose(
        angular, 0 * angular + angular[0], atol=1e-12 * np.abs(angular).max()
    )


def test_free_flight_keeps_the_energy(tumbling):
    _, motion, _ = tumbling
    strain = motion.strain_bars + motion.strain_folds + motion.strain_bends
    energy = (motion.kinetic + strain - motion.work).to_numpy()
    assert np.abs(energy / energy[0] - 1.0).max() < 1e-6  # observed: 6e-8
    assert float(strain.max()) > 0.05 * energy[0]  # the folds take and give back a share of it
    assert float(np.abs(motion.dissipated).max()) == 0.0


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


def test_pictures_of_the_gallery_are_small(tumbling):
    _, _, folder = tumbling
    drawn = [DOCS / "images" / "deployment.gif", DOCS / "images" / "tumbling.gif"]
    for picture in (*drawn, folder / "tumbling.gif"):
        assert picture.stat().st_size < 400_000, picture
