# Public names and where they live; loaded when they are first used (facade.py)

from foldyn import (
    checks as checks,
    errors as errors,
    experiment as experiment,
    formats as formats,
    linear as linear,
    materials as materials,
    patterns as patterns,
    plots as plots,
    results as results,
    signals as signals,
    statics as statics,
    studies as studies,
)
from foldyn.analyses import read_case as read_case
from foldyn.attractors import (
    basins as basins,
    bifurcation_diagram as bifurcation_diagram,
    lyapunov_exponent as lyapunov_exponent,
    poincare_section as poincare_section,
    swept_sine as swept_sine,
)
from foldyn.cases import (
    Actuate as Actuate,
    Air as Air,
    Bar as Bar,
    BaseMotion as BaseMotion,
    Cable as Cable,
    Case as Case,
    Chirp as Chirp,
    Constant as Constant,
    Contact as Contact,
    CreaseDamping as CreaseDamping,
    CreaseMoment as CreaseMoment,
    Dashpot as Dashpot,
    Fix as Fix,
    Force as Force,
    Function as Function,
    Gravity as Gravity,
    HalfSine as HalfSine,
    Harmonic as Harmonic,
    Impose as Impose,
    Latch as Latch,
    LineLoad as LineLoad,
    Link as Link,
    ModalDamping as ModalDamping,
    Plane as Plane,
    PointMass as PointMass,
    Pressure as Pressure,
    Pulse as Pulse,
    Ramp as Ramp,
    Rayleigh as Rayleigh,
    Spring as Spring,
    Stop as Stop,
    State as State,
    StrainDamping as StrainDamping,
    Step as Step,
    Table as Table,
    Temperature as Temperature,
    TotalForce as TotalForce,
)
from foldyn.designs import design as design
from foldyn.dynamics import (
    critical_step as critical_step,
    initial_state as initial_state,
    simulate as simulate,
    simulate_many as simulate_many,
)
from foldyn.experiment import fit as fit
from foldyn.exports import export as export
from foldyn.formats import (
    diagnose as diagnose,
    read_pattern as read_pattern,
    write_pattern as write_pattern,
)
from foldyn.live import View as View, view as view
from foldyn.gradients import sensitivity as sensitivity
from foldyn.linear import (
    Fidelity as Fidelity,
    SpectralDensity as SpectralDensity,
    UnitCell as UnitCell,
    bands as bands,
    buckling as buckling,
    effective as effective,
    fidelity as fidelity,
    frf as frf,
    mac as mac,
    margins as margins,
    modes as modes,
    random_response as random_response,
    spectrum_response as spectrum_response,
    stresses as stresses,
)
from foldyn.materials import (
    BarLaw as BarLaw,
    CustomBarLaw as CustomBarLaw,
    CustomHingeLaw as CustomHingeLaw,
    EnhancedLinear as EnhancedLinear,
    Eyring as Eyring,
    HingeLaw as HingeLaw,
    Plastic as Plastic,
    PlateSuperlinear as PlateSuperlinear,
    Prony as Prony,
)
from foldyn.patterns import (
    Pattern as Pattern,
    Screw as Screw,
    convex as convex,
    flat_foldable as flat_foldable,
    imperfect as imperfect,
    thicken as thicken,
    welded as welded,
)
from foldyn.periodic import (
    backbone as backbone,
    periodic_motion as periodic_motion,
    response_curve as response_curve,
)
from foldyn.results import (
    Quantity as Quantity,
    attitude as attitude,
    case_of as case_of,
    latched as latched,
    load as load,
    save as save,
)
from foldyn.condensation import (
    Superelements as Superelements,
    SuperelementsOptions as SuperelementsOptions,
    superelements as superelements,
)
from foldyn.shells import Shell as Shell, ShellOptions as ShellOptions, shell as shell
from foldyn.statics import (
    Folding as Folding,
    fold as fold,
    landscape as landscape,
    switch_branch as switch_branch,
    trace as trace,
)
from foldyn.structures import (
    Laminate as Laminate,
    ModelOptions as ModelOptions,
    PanelSheet as PanelSheet,
    Ply as Ply,
    Sheet as Sheet,
    Strip as Strip,
    Structure as Structure,
    discretize as discretize,
)

from foldyn.sweeps import Measure as Measure, sweep as sweep

__version__: str
