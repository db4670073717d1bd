# Public names and where they live; loaded when they are first used (facade.py)

from foldyn.plots.animation import animate as animate, animate_modes as animate_modes
from foldyn.plots.attractors import (
    plot_amplitudes as plot_amplitudes,
    plot_basins as plot_basins,
    plot_bifurcation_diagram as plot_bifurcation_diagram,
    plot_lyapunov_exponent as plot_lyapunov_exponent,
    plot_poincare_section as plot_poincare_section,
)
from foldyn.plots.bands import (
    plot_bands as plot_bands,
    plot_effective as plot_effective,
    plot_iso_frequency as plot_iso_frequency,
)
from foldyn.plots.boards import draw_boards as draw_boards
from foldyn.plots.designs import (
    draw_sensitivity as draw_sensitivity,
    plot_convergence as plot_convergence,
)
from foldyn.plots.energies import (
    plot_energies as plot_energies,
    plot_path_energies as plot_path_energies,
)
from foldyn.plots.fidelity import plot_fidelity as plot_fidelity
from foldyn.plots.flight import plot_attitude as plot_attitude
from foldyn.plots.folding import animate_folding as animate_folding, draw_folding as draw_folding
from foldyn.plots.frf import plot_frf as plot_frf
from foldyn.plots.history import plot_history as plot_history
from foldyn.plots.landscape import (
    barriers as barriers,
    plot_landscape as plot_landscape,
    with_states as with_states,
)
from foldyn.plots.laws import plot_laws as plot_laws
from foldyn.plots.loads import plot_load_history as plot_load_history
from foldyn.plots.buckling import draw_buckling as draw_buckling
from foldyn.plots.modes import draw_modes as draw_modes, plot_mac as plot_mac
from foldyn.plots.nyquist import plot_nyquist as plot_nyquist
from foldyn.plots.path import (
    draw_shapes as draw_shapes,
    plot_load_displacement as plot_load_displacement,
    plot_reaction as plot_reaction,
)
from foldyn.plots.patterns import draw_patterns as draw_patterns
from foldyn.plots.readings import (
    chosen_points as chosen_points,
    energy_shares as energy_shares,
    moved_supports as moved_supports,
    total_reaction as total_reaction,
)
from foldyn.plots.response_curves import (
    plot_backbone as plot_backbone,
    plot_response_curve as plot_response_curve,
)
from foldyn.plots.space_time import (
    plot_space_time as plot_space_time,
    plot_transmission as plot_transmission,
    plot_wave_spectrum as plot_wave_spectrum,
)
from foldyn.plots.stresses import draw_stresses as draw_stresses
from foldyn.plots.structure import draw_structure as draw_structure
from foldyn.plots.sweeps import (
    plot_main_effects as plot_main_effects,
    plot_sobol_indices as plot_sobol_indices,
    plot_sweep_lines as plot_sweep_lines,
    plot_sweep_map as plot_sweep_map,
)
from foldyn.plots.tracks import (
    draw_overlay as draw_overlay,
    plot_steps as plot_steps,
    plot_tracks as plot_tracks,
)

ANIMATIONS: tuple[str, ...]
FIGURES: tuple[str, ...]
