"""A sweep: the first frequencies of the paper specimen, and which parameter decides them."""

import foldyn as fd

case = fd.studies.find_case("herkal/specimen-modes")
soft = {
    "sheet.length_scale_ratio": "1:8:7:log",
    "pattern.dihedral": "25:60:7",
    "model.mass": ["circumcenter"],
}
uncertain = {
    "sheet.length_scale_ratio": "2:4",
    "sheet.youngs_modulus": "1.1e9:1.35e9",
    "sheet.thickness": "2.2e-4:2.6e-4",
    "sheet.density": "640:700",
    "model.mass": ["circumcenter"],
}

if __name__ == "__main__":  # its processes import this file
    grid = fd.sweep(case, soft, measures=["frequencies"])
    design = fd.sweep(case, uncertain, measures=["frequency[1]"], samples=64, method="saltelli")
    indices = fd.results.sobol_indices(design, "frequency_1")
    print(indices)

    plots = fd.plots
    plots.plot_sweep_map(grid, "frequencies", at={"mode": 2}).savefig("sweep-map.png", dpi=90)
    at = {"length_scale_ratio": 1.0}
    lines = plots.plot_sweep_lines(grid, "frequencies", x="dihedral", by="mode", at=at)
    lines.savefig("sweep-lines.png", dpi=90)
    plots.plot_main_effects(design, "frequency_1").savefig("sweep-effects.png", dpi=90)
    plots.plot_sobol_indices(indices).savefig("sweep-indices.png", dpi=90)
