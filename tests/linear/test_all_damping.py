"""Each kind of damping in each model: analyses agree on it, or refuse it by name."""

from collections.abc import Sequence
from contextlib import nullcontext
from functools import cache
from typing import Any

import numpy as np
import pytest
from scipy.linalg import eigvals

import foldyn as fd
from foldyn.attractors.grid import UNDRIVEN
from foldyn.errors import FoldynWarning, InputError
from foldyn.linear.linearized import linearize
from pairwise import beyond, in_pairs

PATTERN = fd.patterns.simple_fold(a=0.9, b=1.1, dihedral=100)
SHEET = fd.Sheet(1e9, 0.3, 0.02, 300.0)
HELD, PRELOAD = fd.Fix([2, 3, 4, 5]), fd.Force([0, 1], (0, 0, 20.0))
TINY = fd.Force([0, 1], (0, 0, 1e-4))
OMEGA = 6.0  # rad/s, about that of the first mode
RATIO = 0.05
KICK = 1e-4  # of the mode: tiny beside the preload, which must not decide how steps are solved
BETA = 2.0 * RATIO / OMEGA

Kind = tuple[Any, tuple[Any, ...], Any]  # damping, further supports, law of the crease
KINDS: dict[str, Kind] = {
    "drag": (fd.Rayleigh(2.0 * RATIO * OMEGA), (), "linear"),
    "stiffness at rest": (fd.Rayleigh(beta=BETA / 4e4), (), "linear"),  # of panels that have turned
    "stiffness at the start": (fd.Rayleigh(beta=BETA, state="initial"), (), "linear"),
    "modes at rest": (fd.ModalDamping([RATIO, 0.02]), (), "linear"),
    "modes at the start": (fd.ModalDamping(RATIO, state="initial"), (), "linear"),
    "creases": (fd.CreaseDamping(2.0), (), "linear"),
    "strain rates": (fd.StrainDamping(BETA), (), "linear"),
    "dashpot to the ground": ((), (fd.Dashpot(0.6, nodes=[0, 1], direction="z"),), "linear"),
    "dashpot along a line": ((), (fd.Dashpot(5.0, between=[(0, 4), (1, 5)]),), "linear"),
    "relaxing creases": ((), (), fd.Prony([0.1, 0.1], [0.05, 0.5])),
    "relaxing damped creases": (fd.CreaseDamping(1.0), (), fd.Prony([0.1], [0.5])),
}
MODELS = ("plate", "n5b8e", "herkal", "merlin2", "shell")
BESIDE: dict[str, dict[str, Any]] = {
    "n4b5": {"preset": "herkal", "scheme": "n4b5"},
    "rigid panels": {"preset": "plate", "rigid": "all"},
}
EXPLICIT = ("rk4", "central_difference", "dormand_prince")
IMPLICIT = ("newmark", "generalized_alpha", "energy_momentum")
STIFF = ("stiffness at the start", "strain rates")  # a thousand times the explicit steps
PAIRS = [
    row.values
    for row in in_pairs(KINDS, MODELS, EXPLICIT + IMPLICIT)
    if not row.marks and not (row.values[0] in STIFF and row.values[2] in EXPLICIT)
]
USUAL = ("rk4", "newmark", "energy_momentum")
TIMED = [row for row in PAIRS if row[2] in USUAL]
TIMED += beyond([row for row in PAIRS if row[2] not in USUAL])


def in_turn(models: Sequence[str], each: int, without: Sequence[Any] = ()) -> list[Any]:
    """All kinds with all models; what goes beyond some models of each kind is in the matrix."""
    few, others = [], []
    for i, kind in enumerate(KINDS):
        rows = [(kind, models[(i + j) % len(models)]) for j in range(len(models))]
        few += [row for row in rows[:each] if row not in without]
        others += [row for row in rows[each:] if row not in without]
    return few + beyond(others)


@cache
def sheet_of(law: Any, model: Any, pattern: fd.Pattern = PATTERN) -> Any:
    options: dict[str, Any] = {"crease_stiffness": 60.0, "fold_law": law}
    if model == "shell":
        return fd.shell(pattern, SHEET, divisions=2, **options)
    given = BESIDE.get(model, {"preset": model})
    soft = {"bend_law": "linear"} if given["preset"] in ("herkal", "merlin2") else {}
    return fd.discretize(pattern, SHEET, **given, **soft, **options)


@cache
def made(kind: str, model: Any) -> fd.Case:
    damping, supports, law = KINDS[kind]
    return fd.Case(sheet_of(law, model), [HELD, *supports], [PRELOAD], damping)


def case_of(kind: str, model: str) -> fd.Case | None:
    """The case; None of what the model refuses by name."""
    if kind == "strain rates" and model in ("n5b8e", "shell"):
        with pytest.raises(InputError, match="StrainDamping"):
            made(kind, model)
        return None
    return made(kind, model)


@pytest.mark.filterwarnings("ignore:damping. .* resist")
@pytest.mark.parametrize(("kind", "model"), in_turn(MODELS, 2))
def test_frequency_responses_modes_and_periodic_motions(kind, model):
    case = case_of(kind, model)
    if case is None:
        return
    modes = fd.modes(case, 1, state="equilibrium")
    f, ratio = float(modes.frequency[0]), float(modes.damping_ratio[0])
    state = fd.State(modes.displacement.values)
    assert 0.02 < ratio < 0.2
    direct, modal, harmonic = (
        fd.frf(
            case, TINY, frequencies=[0.6 * f, f, 3.0 * f], state=state, method=method
        ).receptance.values
        for method in ("direct", "modal", "harmonic")
    )
    for at in range(3):
        size = np.abs(direct[at]).max()
        assert np.abs(modal[at] - direct[at]).max() < 1e-7 * size
        assert np.abs(harmonic[at] - direct[at]).max() < 1e-5 * size
    shape = modes["shape"].values[0]
    static = float(shape[[0, 1], 2].sum()) / 2.0 / (2.0 * np.pi * f) ** 2  # a load of 1 N
    node = int(np.abs(shape[:, 2]).argmax())
    assert abs(direct[1, node, 2] / (static * shape[node, 2])) == pytest.approx(
        0.5 / ratio, rel=0.03
    )
    driven = case.altered(loads=[PRELOAD, fd.Force([0, 1], TINY.vector, fd.Harmonic(f))])
    if kind not in CONSTANT:
        with pytest.raises(InputError, match=r"damping|memory"):
            fd.periodic_motion(driven, harmonics=2)
        return
    one = fd.periodic_motion(driven, harmonics=2, guess=state)
    expected = -1j * direct[1] * 2e-4
    assert np.abs(one.coefficient.values[1] - expected).max() < 1e-3 * np.abs(expected).max()


@pytest.mark.parametrize(
    "model", ["n5b8e", pytest.param("superelements", marks=pytest.mark.matrix)]
)
def test_few_modes_have_weak_dampers_and_tell_of_strong_ones(model):
    """Strong ones hold the creases, which no few modes of free creases do."""
    pattern = fd.patterns.miura(cells=(1, 1), a=1.0, b=1.0, panel_angle=60, dihedral=100)
    if model == "n5b8e":
        s = fd.discretize(pattern, SHEET, preset=model, crease_stiffness=60.0)
    else:
        s = fd.superelements(pattern, SHEET, level=1, crease_stiffness=60.0)
    push, frequencies = fd.Force([8], (0, 0, 1e-3)), [0.3, 3.0]
    for strength, told in (
        (2.0, nullcontext()),
        (400.0, pytest.warns(FoldynWarning, match="left")),
    ):
        case = fd.Case(s, [fd.Fix([0, 1, 3])], damping=fd.CreaseDamping(strength))
        exact = fd.frf(case, push, frequencies=frequencies, check_model=False).receptance.values
        options = {"method": "modal", "count": 6, "check_model": False}
        with told:
            few = fd.frf(case, push, frequencies=frequencies, **options).receptance.values
        wrong = np.abs(few[1] - exact[1]).max() / np.abs(exact[1]).max()
        assert wrong < 5e-3 if strength < 10.0 else wrong > 0.02


CONSTANT = (
    "drag", "stiffness at rest", "stiffness at the start", "modes at rest", "modes at the start",
    "dashpot to the ground",
)  # fmt: skip


@pytest.mark.filterwarnings("ignore:damping. .* resist", "ignore:.* critical step")
@pytest.mark.parametrize(("kind", "model", "method"), TIMED)
def test_simulated_motions_decay_as_the_frequency_response_says(kind, model, method):
    """A kick that only the first mode gets: what the second period leaves of the speed."""
    case = case_of(kind, model)
    if case is None:
        return
    modes = fd.modes(case, 1, state="equilibrium")
    f, ratio = float(modes.frequency[0]), float(modes.damping_ratio[0])
    shape, period = modes["shape"].values[0], 1.0 / (f * np.sqrt(1.0 - ratio**2))
    start = fd.State(modes.displacement.values, KICK * shape)
    dt = period / 200.0 if method in IMPLICIT else None
    run = fd.simulate(case, 2.0 * period, method=method, dt=dt, interval=period, initial=start)
    mass = case.nodal_mass[:, None]
    first, last = ((shape * mass * run.velocity.values[k]).sum() for k in (1, 2))
    assert -np.log(last / first) / (2.0 * np.pi) == pytest.approx(ratio, rel=0.05)


@pytest.mark.filterwarnings("ignore:the pressure acts on panels with free edges")
@pytest.mark.parametrize("kind", ["stiffness at the start", "modes at the start"])
@pytest.mark.parametrize("load", [fd.Actuate("all", fold_angle=55.0), fd.Pressure(4.0)])
def test_damping_at_the_start_is_that_of_folds_and_pressure_there(load, kind):
    """A mode of unit mass dissipates 2 zeta omega v^2, with rest angles as they are turned."""
    pattern = fd.patterns.miura(cells=(1, 1), a=0.9, b=0.7, panel_angle=70, dihedral=110)
    s = fd.discretize(pattern, fd.Sheet(1e8, 0.3, 0.012, 250.0), preset="plate")
    case = fd.Case(s, [fd.Fix([0, 1, 4, 3])], [load], KINDS[kind][0])
    modes = fd.modes(case, 2, state="equilibrium")
    for k in range(2):
        start = fd.State(modes.displacement.values, 1e-3 * modes["shape"].values[k])
        dt = 1e-5 / float(modes.frequency[k])
        run = fd.simulate(case, 10 * dt, method="newmark", dt=dt, every_steps=10, initial=start)
        power = float(run.dissipated[-1]) / (10 * dt)
        rate = 4.0 * np.pi * float(modes.damping_ratio[k] * modes.frequency[k])
        assert power / 1e-6 == pytest.approx(rate, rel=2e-3)


TRANSIENTS: dict[str, dict[str, Any]] = {
    "impulse": {}, "burst_random": {"averages": 2}, "stepped_sine": {"settled": 1e-3, "cycles": 2},
}  # fmt: skip
METHODS = tuple(TRANSIENTS)
MOVED = ("plate", "shell", "n5b8e", "herkal", *BESIDE)
IN_TIME = [(kind, MOVED[i % len(MOVED)], METHODS[(i + i // 3) % 3]) for i, kind in enumerate(KINDS)]


@pytest.mark.matrix
@pytest.mark.filterwarnings("ignore:damping. .* resist", "ignore:.* of the motion is left")
@pytest.mark.parametrize(
    ("kind", "model", "method"),
    [*IN_TIME[::3], *beyond([row for i, row in enumerate(IN_TIME) if i % 3], 4)],
)
def test_frequency_responses_from_motions_are_the_direct_ones(kind, model, method):
    """Steps of 1/60 of a period let the resonance be 9e-4 lower.

    Damped creases beside dofs without mass have errors of the first order: 3.8 % here, 0.9 % with
    a quarter of the step.
    """
    case = case_of(kind, model)
    if case is None:
        return
    modes = fd.modes(case, 1, state="equilibrium")
    f, ratio = float(modes.frequency[0]), float(modes.damping_ratio[0])
    state, at = fd.State(modes.displacement.values), [0.6 * f, f]
    options = TRANSIENTS[method] | {"integrator": "newmark", "dt": 1.0 / (60.0 * f)}
    if method != "stepped_sine":
        options["duration"] = 9.0 / (2.0 * np.pi * f * ratio)
    found = fd.frf(
        case, TINY, frequencies=at, state=state, method=method, **options
    ).receptance.values
    direct = fd.frf(case, TINY, frequencies=at, state=state).receptance.values
    wrong = np.abs(found - direct).max(axis=(1, 2)) / np.abs(direct).max(axis=(1, 2))
    assert wrong[0] < 0.02 and wrong[1] < 1.5e-3 / ratio + (
        0.04 if kind.endswith("creases") else 0.01
    )


@pytest.mark.matrix
@pytest.mark.filterwarnings("ignore:damping. .* resist")
@pytest.mark.parametrize("kind", [kind for kind in KINDS if "start" in kind or "relax" in kind])
def test_steady_motions_of_diagrams_are_the_direct_responses(kind):
    """Of kinds that depend on where the motion begins; the others are those of any motion."""
    case = made(kind, "plate")
    modes = fd.modes(case, 1, state="equilibrium")
    f, ratio = float(modes.frequency[0]), float(modes.damping_ratio[0])
    state = fd.State(modes.displacement.values)
    driven = case.altered(loads=[PRELOAD, fd.Force([0, 1], TINY.vector, fd.Harmonic(f))])
    height = fd.Quantity("m", "height", function=lambda u, v, t: u[0, 2])
    periods = round(6.0 / (2.0 * np.pi * ratio))
    found = fd.bifurcation_diagram(
        driven, height, frequencies=[f], sweep="up", settle=periods, record=4, initial=state,
        method="newmark", dt=1.0 / (60.0 * f),
    )  # fmt: skip
    direct = (
        abs(fd.frf(case, TINY, frequencies=[f], state=state).receptance.values[0, 0, 2])
        * TINY.vector[2]
    )
    assert float(found.amplitude[0, 0]) == pytest.approx(2.0 * direct, rel=0.03)


@pytest.mark.filterwarnings("ignore:damping. .* resist", "ignore:the energy balance of the motion")
@pytest.mark.parametrize("kind", KINDS)
@pytest.mark.parametrize(
    ("measure", "analysis"),
    [
        ("damping_ratio[1]", {"kind": "modes", "count": 1, "state": fd.State()}),
        (
            "response[0,z,1]",
            {"kind": "frf", "drive": [TINY], "frequencies": [0.9, 1.2], "state": "equilibrium"},
        ),
        (
            "displacement_at[0,z,0.05]",
            {"kind": "dynamics", "method": "newmark", "duration": 0.05, "dt": 0.01},
        ),
    ],
)
def test_gradients_have_the_damping_or_refuse_it(kind, measure, analysis):
    """By the thickness of the sheet, beside central differences."""
    damping, supports, law = KINDS[kind]

    def case_at(thickness: float) -> fd.Case:
        sheet = fd.Sheet(1e9, 0.3, thickness, 300.0)
        s = fd.discretize(PATTERN, sheet, crease_stiffness=60.0, fold_law=law, preset="plate")
        return fd.Case(s, [HELD, *supports], [PRELOAD], damping)

    def gradient(thickness: float) -> tuple[float, float]:
        found = fd.sensitivity(
            case_at, {"thickness": thickness}, measures=measure, analysis=analysis
        )
        return float(found.value[0]), float(found.gradient_thickness[0])

    moves = analysis["kind"] == "dynamics"
    rayleigh = ("drag", "stiffness at rest", "stiffness at the start")
    if kind.endswith("creases") or not (moves or kind in rayleigh):
        with pytest.raises(InputError, match=r"alpha and beta|creases that yield, creep"):
            gradient(0.02)
        return
    below, (_, slope), above = gradient(0.02 - 2e-6), gradient(0.02), gradient(0.02 + 2e-6)
    assert slope == pytest.approx((above[0] - below[0]) / 4e-6, rel=1e-4)


# ------------------------------------------------------------------ long motions
ALONE = {"stiffness at rest": fd.Rayleigh(beta=BETA), "modes at rest": fd.ModalDamping(RATIO)}
SWUNG = PATTERN.vertices[0] - PATTERN.vertices[2]
AWAY = (SWUNG / np.linalg.norm(SWUNG)).tolist()  # from the crease
SWING = in_turn(("plate", "n5b8e", "merlin2"), 1, without=[("strain rates", "n5b8e")])


def swing(kind: str, model: str, **changes: Any) -> fd.Case:
    """One panel is held, the other swings about the crease: one dof, which any damper meets."""
    damping, supports, law = KINDS[kind]
    s = sheet_of(law, model)
    inside = range(6, len(s.nodes))
    moved = [v for v in inside if s.nodes[v, 0] < s.nodes[2, 0]]
    held = [2, 3, 4, 5, *(v for v in inside if v not in moved)]
    along = [fd.Fix([0, 1], "y"), fd.Fix([0, 1], direction=AWAY), fd.Link([0, 1], axes="z")]
    riding = [fd.Link(moved, to=(0, 1, 2))] * bool(moved)
    given = {"damping": ALONE.get(kind, damping)} | changes
    return fd.Case(s, [fd.Fix(held), *along, *riding, *supports], **given)


def decay(case: fd.Case) -> tuple[float, float, fd.State]:
    """Rate (1/s) and period (s) of its free vibrations, and a small one where it begins."""
    mode = fd.modes(case, 1)
    ratio, omega = float(mode.damping_ratio[0]), 2.0 * np.pi * float(mode.frequency[0])
    period = 2.0 * np.pi / (omega * np.sqrt(1.0 - ratio**2))
    return ratio * omega, period, fd.State(None, 1e-3 * mode["shape"].values[0])


def short(case: fd.Case, period: float) -> float:
    """A step of 1/120 of the period, or what the inertia of edge angles allows."""
    return min(period / 120.0, 0.5 * fd.critical_step(case))


@pytest.mark.parametrize(("kind", "model"), SWING)
def test_exponents_are_the_rates_at_which_vibrations_decay(kind, model):
    case = swing(kind, model)
    rate, period, _ = decay(case)
    options = {"settle": period, "interval": 0.5 * period, "dt": short(case, period)}
    assert 0.15 < rate < 1.2
    found = fd.lyapunov_exponent(case, 3.0 * period, **options)
    assert float(found.exponent) == pytest.approx(-rate, rel=0.02)


@pytest.mark.parametrize(("kind", "model"), SWING)
def test_motions_of_basins_settle_at_that_rate(kind, model):
    """What three periods leave of the speed; the states after that repeat to the size of all."""
    case = swing(kind, model)
    rate, period, start = decay(case)
    found = fd.basins(
        case, lambda kick: fd.State(None, kick * start.velocity), grid={"kick": [1.0]},
        duration=3.0 * period,
        record=4, same=0.9, method="rk4", dt=short(case, period),
    )  # fmt: skip
    left = float((found.velocity[0, 0].values * start.velocity).sum() / (start.velocity**2).sum())
    assert -np.log(left) / (3.0 * period) == pytest.approx(rate, rel=0.05)
    dt = float(found.attrs["dt"])
    steps = round((found.attrs["duration"] + 3 * UNDRIVEN * 3.0 * period) / dt)  # to the last state
    whole = fd.simulate(case, steps * dt, method="rk4", dt=dt, every_steps=steps, initial=start)
    off = found.displacement[0, 3].values - whole.displacement[-1].values  # goes on from the end
    assert np.abs(off).max() < 1e-5 * np.abs(start.velocity).max() * period


@pytest.mark.matrix
@pytest.mark.filterwarnings("ignore:the energy balance of the motion")
def test_damped_creases_of_plates_are_of_first_order_but_by_energy_momentum():
    case = swing("creases", "plate")
    _, period, start = decay(case)

    def end(method: str, steps: int) -> float:
        run = fd.simulate(
            case, 2 * period, method=method, dt=period / steps, every_steps=2 * steps, initial=start
        )
        return float(run.displacement[-1, 0, 2])

    exact = end("energy_momentum", 400)
    for method, least, most in (("newmark", 1.0, 1.5), ("energy_momentum", 1.9, 2.7)):
        wrong = [abs(end(method, steps) - exact) for steps in (50, 200)]
        assert least < 0.5 * np.log2(wrong[0] / wrong[1]) < most


def test_the_drag_of_a_wind_damps_as_it_blows():
    """Pressure 1/2 rho Cd (U - r w)^2 on a panel: c = rho Cd U b a^3 / 3 about its side."""
    normal = np.cross(SWUNG, (0.0, 1.0, 0.0)) / np.linalg.norm(SWUNG)
    air = fd.Air(1.2, normal.tolist(), added_mass=False, drag_coefficient=2.0)
    still = swing("creases", "plate", damping=())
    mode = fd.modes(still, 1)
    turn = np.linalg.norm(mode["shape"].values[0, 0]) / 0.9  # rad, of a modal mass of 1 kg m2
    rate = 0.5 * turn**2 * 1.2 * 2.0 * 1.1 * 0.9**3 / 3.0
    period, case = 1.0 / float(mode.frequency[0]), still.altered(air=air)
    found = fd.lyapunov_exponent(
        case, 30.0 * period, settle=30.0 * period, interval=0.5 * period, dt=period / 60.0
    )
    assert float(found.exponent) == pytest.approx(-rate, rel=0.05)
    for refused in (fd.modes, lambda one: fd.frf(one, TINY, frequencies=[1.0])):
        with pytest.raises(InputError, match=r"air\.velocity = .*: .* would leave wind out"):
            refused(case)


# ------------------------------------------------------------------ waves
DRUM = fd.patterns.kresling(sides=6, radius=1.0, height=0.9)
SIDE = fd.Pattern(DRUM.vertices[[0, 1, 6, 7]], [(0, 1, 3), (0, 3, 2)])
STRONG = {"dashpot to the ground": 600.0, "dashpot along a line": 5e3}


def drum(kind: str, model: str, sides: int) -> fd.Case:
    """A storey of a Kresling tower that stands on its lower ring, or one side of six."""
    damping, _, law = KINDS[kind]
    low = [*range(6 if sides == 6 else 2)]
    top = [v + len(low) for v in low]
    supports: list[Any] = [fd.Fix(low)]
    if kind == "dashpot to the ground":
        supports.append(fd.Dashpot(STRONG[kind], nodes=top, direction="z"))
    if kind == "dashpot along a line":
        supports.append(fd.Dashpot(STRONG[kind], between=[*zip(low, top, strict=True)]))
    return fd.Case(sheet_of(law, model, DRUM if sides == 6 else SIDE), supports, (), damping)


REPEATED = [
    (kind, model) for kind in KINDS for model in ("plate", "n5b8e", "herkal", "shell")
    if not (kind == "strain rates" and model in ("n5b8e", "shell"))
]  # fmt: skip


@pytest.mark.parametrize(("kind", "model"), REPEATED)
def test_damped_waves_of_a_side_are_the_poles_of_the_ring(kind, model):
    """Each wave whose phase closes is a free vibration of the whole."""
    cell = fd.UnitCell(drum(kind, model, 1), screw=fd.Screw("z", 60.0, 0.0))
    phases = [[0.0], [np.pi / 3.0], [np.pi]]
    if "modes" in kind or "relaxing" in kind:
        for waves in (fd.bands, fd.linear.damped_bands):
            with pytest.raises(InputError, match=r"damping: modes of|fold_law = .*has memory"):
                waves(cell, phases, count=2)
        return
    found = fd.linear.damped_bands(cell, phases, count=2)
    rates, whole = found.rate.values.ravel(), linearize(drum(kind, model, 6))
    k, c, m = (part.toarray() for part in (whole.stiffness, whole.damping, whole.mass))
    one, none = np.eye(len(k)), np.zeros_like(k)
    poles = eigvals(np.block([[none, one], [-k, -c]]), np.block([[one, none], [none, m]]))
    off = np.abs(rates[:, None] - poles[np.isfinite(poles)]).min(axis=1)
    assert (off < 1e-7 * np.abs(rates)).all()
    assert found.damping_ratio.values.max() > 2e-6


# ------------------------------------------------------------------ what is no damping
def test_creases_that_yield_are_refused_by_all_that_would_leave_it_out():
    """They take energy from motions and paths alone."""
    case = fd.Case(sheet_of(fd.Plastic(10.0), "plate"), [HELD], [PRELOAD])
    driven = case.altered(loads=[PRELOAD, fd.Force([0, 1], TINY.vector, fd.Harmonic(1.0))])
    cell = fd.UnitCell(fd.Case(sheet_of(fd.Plastic(10.0), "plate", SIDE)),
                       screw=fd.Screw("z", 60.0, 0.0))  # fmt: skip
    modes = {"kind": "modes", "count": 1, "state": fd.State()}
    for asked in (
        lambda: fd.periodic_motion(driven, harmonics=2),
        lambda: fd.lyapunov_exponent(case, 1.0),
        lambda: fd.basins(case, lambda x: fd.State(), grid={"x": [0.0]}, duration=1.0),
        lambda: fd.linear.damped_bands(cell, [[0.0]], count=1),
        lambda: fd.sensitivity(case, ["fold_stiffness"], measures="frequency[1]", analysis=modes),
    ):
        with pytest.raises(InputError, match=r"yield|memory"):
            asked()


def test_basins_refuse_friction():
    case = made("drag", "plate").altered(contact=fd.Contact(thickness=0.02, friction=0.3))
    with pytest.raises(InputError, match=r"contact\.friction: .* friction springs"):
        fd.basins(case, lambda x: fd.State(), grid={"x": [0.0]}, duration=1.0)
