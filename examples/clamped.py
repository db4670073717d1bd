"""The lowest modes of a Miura sheet built in at one end, as bars and hinges and as a shell."""

import foldyn as fd

pattern = fd.patterns.miura(cells=(2, 1))
sheet = fd.Sheet(youngs_modulus=1e6, poissons_ratio=0.3, thickness=0.01, density=100.0)
root, tip = [0, 1, 2], 14
edges = [(0, 1), (1, 2)]  # clamped: they cannot turn
models = {
    "reduced": fd.discretize(pattern, sheet, clamped=edges),
    "shell": fd.shell(pattern, sheet, divisions=8, clamped=edges),
}
frequencies = {}
for name, structure in models.items():
    case = fd.Case(structure, [fd.Fix(root)])
    modes = fd.modes(case, count=3)
    frequencies[name] = modes.frequency.values  # Hz
    print(f"{name:8s}", *(f"{f:.4f}" for f in frequencies[name]), "Hz")
    upward = (modes["shape"].sel(node=tip, axis="y") > 0.0) * 2.0 - 1.0  # alike in both pictures
    modes["shape"] = modes["shape"] * upward
    figure = fd.plots.draw_modes(case, modes, which=[1, 2], title=name)
    figure.savefig(f"clamped-{name}.png", dpi=70)
