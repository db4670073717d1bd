"""Small vibrations in air and water: the added mass in modes and responses."""

import warnings

import numpy as np
import pytest
from scipy.linalg import eigh

import foldyn as fd
from foldyn.errors import FoldynWarning, InputError
from foldyn.linear import UnitCell, bands
from foldyn.sweeps import MEASURES
from foldyn.sweeps.measure import asked

AIR = fd.Air(density=1.204)
HEAVY = fd.Sheet(206e9, 0.3, 0.238, density=7850.0)
WATER = 1000.0


@pytest.fixture(scope="module")
def sheet():
    """A light Miura sheet that is held at one end; its air weighs much."""
    return _thick(1e-4)


def cantilever(length, sheet, divisions=12, resolution=12, panels=1):
    """A plate of width 1, clamped at x = 0: in vacuum and in water."""
    x = np.linspace(0.0, length, panels + 1)
    points = [(s, 0.0) for s in x] + [(s, 1.0) for s in x]
    faces = [(i, i + 1, panels + 2 + i, panels + 1 + i) for i in range(panels)]
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", FoldynWarning)
        shell = fd.shell(
            fd.Pattern(points, faces), sheet, divisions=divisions, clamped=[(0, panels + 1)],
            crease_stiffness=1e13, mass="consistent",
        )  # fmt: skip
    dry = fd.Case(shell, [fd.Fix("xmin", along=True)])
    return dry, dry.altered(air=fd.Air(WATER, resolution=resolution))


def free_matrices(case, state=None):
    """Stiffness and whole mass (kg) of the free dofs, in full."""
    displacement = np.zeros_like(case.structure.nodes) if state is None else state.displacement
    free = case.free_dofs
    stiffness = case.body.tangent(displacement.ravel()).toarray()[np.ix_(free, free)]
    mass = np.kron(case.mass.toarray(), np.eye(3)) + case.added_mass(state).todense()
    return stiffness, mass[np.ix_(free, free)]


def test_modes_have_the_whole_mass_at_any_state(sheet):
    case = sheet.altered(loads=[fd.Force("xmax", (0.0, 0.0, 2e-3))])
    bent = fd.initial_state(fd.trace(case))
    for state in (None, bent):
        with warnings.catch_warnings():
            warnings.simplefilter("ignore", FoldynWarning)
            found = fd.modes(case, 4, state=state)
        stiffness, mass = free_matrices(case, state)
        values, shapes = eigh(stiffness, mass, subset_by_index=[0, 3])
        np.testing.assert_allclose(found.eigenvalue.values, values, rtol=1e-6)
        fluid = (
            mass - np.kron(case.mass.toarray(), np.eye(3))[np.ix_(case.free_dofs, case.free_dofs)]
        )
        share = np.einsum("ik,ij,jk->k", shapes, fluid, shapes)
        np.testing.assert_allclose(found.air_share.values, share, rtol=1e-4)
        assert (share > 0.03).all()


def test_the_share_of_the_air_lowers_the_frequency(sheet):
    """To first order f^2 falls by the share; further terms are its square."""
    found = fd.modes(sheet.altered(air=fd.Air(density=0.012)), 3)
    vacuum = fd.modes(sheet.altered(air=None), 3)
    assert "air_share" not in vacuum
    fall = 1.0 - (found.frequency.values / vacuum.frequency.values) ** 2
    np.testing.assert_allclose(fall, found.air_share.values, rtol=5e-3)


@pytest.mark.matrix
def test_frequencies_in_water_and_their_ratios_to_dry_ones_are_those_of_a_published_computation():
    """Square steel cantilever of 10 m, 0.238 m thick (rad/s).

    Plate of Fu and Price (1987, J. Sound Vib. 118, 495-513), values as the examples of
    FinEtoolsVibInFluids.jl quote them.
    """
    published = np.array([7.35, 20.2, 50.45, 70.41, 78.85])
    ratios = published / [12.45, 29.44, 75.05, 94.27, 106.79]
    sheet = fd.Sheet(206e9, 0.3, 0.0238, density=7850.0)  # lengths over 10
    dry, wet = (fd.modes(case, 5).frequency.values for case in cantilever(1.0, sheet, 16, 16))
    np.testing.assert_allclose(2.0 * np.pi * wet / 10.0, published, rtol=0.05)
    np.testing.assert_allclose(wet / dry, ratios, rtol=0.05)


@pytest.mark.matrix
def test_slender_plates_in_water_have_the_ratios_of_strip_theory():
    """Ratios of wet to dry frequency tend to those of a strip as the plate gets longer.

    Bending (1 + pi rho b/(4 m))^-1/2, torsion (1 + 3 pi rho b/(32 m))^-1/2, m the mass per area
    (Chu 1963, as in Lindholm, Kana, Chu and Abramson 1965, J. Ship Res. 9, 11-22). The error of an
    end falls like the width over the length.
    """
    sheet = fd.Sheet(206e9, 0.3, 0.02, density=7850.0)
    bending, torsion = [], []
    for length in (4, 8):
        dry, wet = (fd.modes(case, 5) for case in cantilever(length, sheet, 4, 12, length))
        ratio = wet.frequency.values[:, None] / dry.frequency.values
        twist = [_turns(each) for each in (dry, wet)]
        bending.append(ratio[0, 0])
        torsion.append(ratio[twist[1], twist[0]])
    loaded = WATER / (7850.0 * 0.02)
    limits = [2.0 * each[1] - each[0] for each in (bending, torsion)]
    theory = (1.0 + np.pi / 4 * loaded) ** -0.5, (1.0 + 3 * np.pi / 32 * loaded) ** -0.5
    np.testing.assert_allclose(limits, theory, rtol=0.015)


def _turns(found):
    """The first mode in which the corners of the free end move against each other."""
    shape = found["shape"].sel(axis="z").values
    nodes = fd.case_of(found).structure.nodes
    corners = [
        int(np.abs(nodes - [nodes[:, 0].max(), y, 0.0]).sum(axis=1).argmin()) for y in (0, 1)
    ]
    return int(np.flatnonzero(shape[:, corners[0]] * shape[:, corners[1]] < 0.0)[0])


def test_responses_have_the_whole_mass(sheet):
    case = sheet.altered(damping=fd.Rayleigh(alpha=0.5))
    first = float(fd.modes(case, 1).frequency[0])
    frequencies = [0.6 * first, 1.1 * first, 3.0 * first]
    push = fd.Force("xmax", (0.0, 0.0, 1e-4))
    stiffness, mass = free_matrices(case)
    own = np.kron(case.mass.toarray(), np.eye(3))[np.ix_(case.free_dofs, case.free_dofs)]
    load = np.zeros(case.structure.nodes.shape)
    load[case.structure.nodes[:, 0] > case.structure.nodes[:, 0].max() - 1e-9, 2] = 1e-4
    for method in ("direct", "modal", "harmonic"):
        found = fd.frf(case, push, frequencies=frequencies, method=method)
        for k, f in enumerate(frequencies):
            omega = 2 * np.pi * f
            matrix = stiffness - omega**2 * mass + 0.5j * omega * own  # alpha drags the sheet alone
            x = np.linalg.solve(matrix, load.ravel()[case.free_dofs]) / float(found.drive_force)
            mine = found.receptance.values[k].ravel()[case.free_dofs]
            np.testing.assert_allclose(mine, x, rtol=0, atol=1e-7 * np.abs(x).max())


@pytest.mark.matrix
def test_a_simulated_impulse_has_the_same_response(sheet):
    """Small motions, whose added mass is that of the state."""
    case = sheet.altered(damping=fd.Rayleigh(alpha=6.0), air=fd.Air(drag=False, resolution=2))
    push, frequencies = fd.Force("xmax", (0.0, 0.0, 1e-6)), np.arange(0.5, 3.0, 0.5)
    direct = fd.frf(case, push, frequencies=frequencies).receptance.values
    found = fd.frf(case, push, frequencies=frequencies, method="impulse").receptance.values
    np.testing.assert_allclose(found, direct, rtol=0, atol=3e-3 * np.abs(direct).max())


def test_a_base_moves_the_sheet_against_the_air(sheet):
    """Relative to the base: (K - w^2 M + i w alpha M_s) x = (w^2 M - i w alpha M_s) r."""
    case = sheet.altered(damping=fd.Rayleigh(alpha=0.5))
    omega = 2 * np.pi * 0.8 * float(fd.modes(case, 1).frequency[0])
    found = fd.frf(case, fd.BaseMotion("z"), frequencies=[omega / (2 * np.pi)])
    free = case.free_dofs
    own = np.kron(case.mass.toarray(), np.eye(3))[free]
    whole = own + case.added_mass().todense()[free]
    along = np.tile([0.0, 0.0, 1.0], len(case.structure.nodes))
    stiffness, mass = free_matrices(case)
    matrix = stiffness - omega**2 * mass + 0.5j * omega * own[:, free]
    x = along.astype(complex)
    x[free] += np.linalg.solve(matrix, (omega**2 * whole - 0.5j * omega * own) @ along)
    mine = found.transmissibility.values[0].ravel()
    np.testing.assert_allclose(mine, x, rtol=0, atol=1e-7 * np.abs(x).max())


def test_modal_damping_has_its_ratios_in_air(sheet):
    for state in ("rest", "initial"):
        damped = sheet.altered(damping=fd.ModalDamping([0.02, 0.03], state=state))
        ratios = fd.modes(damped, 2).damping_ratio.values
        np.testing.assert_allclose(ratios, [0.02, 0.03], rtol=1e-9)


@pytest.mark.matrix
def test_large_sheets_keep_the_mass_as_rows(monkeypatch):
    """The same modes and responses, and as many of them proven, as with a matrix."""
    pattern = fd.patterns.miura(cells=(2, 2), a=0.1, b=0.1, panel_angle=60, dihedral=60)
    made = fd.discretize(pattern, fd.Sheet(1.2e9, 0.2, 1e-4, density=700.0), preset="plate")
    tied = [fd.Fix("xmin"), fd.Link("xmax", "xyz")]
    held = fd.Case(made, tied, damping=fd.Rayleigh(1.0), air=fd.Air(resolution=2))
    push, loose = fd.Force("xmax", (1e-3, 0.0, 1e-3)), held.altered(supports=())

    def few_modes(drive):
        with pytest.warns(FoldynWarning, match="modes that are left out .* at 9 Hz"):
            return fd.frf(held, drive, frequencies=[1.0, 9.0], method="modal", count=12)

    def computed():
        return (
            fd.modes(held, 5), fd.modes(loose, 9),
            *(few_modes(drive) for drive in (push, fd.BaseMotion("z"))),
        )  # fmt: skip

    full = computed()
    monkeypatch.setattr("foldyn.cases.added_mass.MOST_COUPLED", 1)
    for one, other in zip(full, computed(), strict=True):
        for name in set(one) & {"frequency", "air_share", "receptance", "transmissibility"}:
            a, b = one[name].values, other[name].values
            np.testing.assert_allclose(b, a, rtol=0, atol=1e-8 * np.abs(a).max())
        assert one.attrs.get("complete") == other.attrs.get("complete")
    with pytest.raises(InputError, match=r"method: the fluid couples too many dofs"):
        fd.frf(held, push, frequencies=[1.0])
    with pytest.raises(InputError, match="which modal damping takes"):
        fd.modes(held.altered(damping=fd.ModalDamping(0.02, 2)), 2)


def test_drag_changes_nothing_at_rest(sheet):
    found = fd.modes(sheet.altered(air=fd.Air(drag=False)), 2)
    np.testing.assert_array_equal(found.frequency, fd.modes(sheet, 2).frequency)


def _thick(thickness):
    pattern = fd.patterns.miura(cells=(1, 1), a=0.1, b=0.1, panel_angle=60, dihedral=90)
    made = fd.discretize(pattern, fd.Sheet(1.2e9, 0.2, thickness, density=700.0), preset="plate")
    return fd.Case(made, [fd.Fix("xmin")], air=AIR)


def test_what_does_not_take_air_refuses_it(sheet):
    with pytest.raises(InputError, match="air: an infinite sheet of cells would leave it out"):
        bands(UnitCell(sheet.altered(supports=())), [(0.5, 0.0)])
    with pytest.raises(InputError, match="air"):
        fd.backbone(sheet)
    with pytest.raises(InputError, match=r"modes.* air"):
        fd.sensitivity(
            _thick,
            {"thickness": 1e-4},
            measures="frequency[1]",
            analysis={"kind": "modes", "count": 1},
        )
    windy = sheet.altered(air=fd.Air(velocity=(0, 0, 3)), loads=[fd.Force("xmax", (0, 0, 1e-3))])
    for call, name in ((fd.modes, "small vibrations"), (fd.trace, "statics")):
        with pytest.raises(InputError, match=f"air.velocity = .*: {name} would leave wind out"):
            call(windy)


@pytest.mark.matrix
def test_a_case_file_has_air(tmp_path, sheet):
    text = """
[pattern]
kind = "miura"
cells = [1, 1]
a = 0.1
b = 0.1
panel_angle = 60
dihedral = 90
[sheet]
youngs_modulus = 1.2e9
poissons_ratio = 0.2
thickness = 1e-4
density = 700.0
[model]
preset = "plate"
[[supports]]
nodes = "xmin"
[air]
[analysis]
kind = "modes"
count = 2
"""
    (tmp_path / "air.toml").write_text(text)
    file = fd.read_case(tmp_path / "air.toml")
    found = file.run()
    np.testing.assert_allclose(found.air_share, fd.modes(sheet, 2).air_share, rtol=1e-9)
    fd.save(found, tmp_path / "air.nc")
    assert fd.case_of(fd.load(tmp_path / "air.nc")).air == AIR
    share = asked("air_share[1]", MEASURES).of(found, file.case(), {})
    assert float(share) == float(found.air_share[0])
    (tmp_path / "air.toml").write_text(text.replace("[air]", "[air]\ndensity = -1"))
    with pytest.raises(InputError, match=r"air.density = -1: must be greater than 0 kg/m3"):
        fd.read_case(tmp_path / "air.toml")
