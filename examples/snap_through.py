"""A Kresling tower of paper pressed through its snap to a second stable state."""

import foldyn as fd

case_file = fd.read_case(fd.studies.find_case("gallery/kresling"))
case, path = case_file.case(), case_file.run()  # arc length, through limit points
landscape = fd.landscape(path)
print(landscape)

plots = fd.plots
plots.plot_load_displacement(path, [6], direction="-z").savefig("kresling-curve.png", dpi=90)
plots.draw_shapes(case, path, points=3).savefig("kresling-shapes.png", dpi=80)
plots.plot_landscape(landscape).savefig("kresling-landscape.png", dpi=90)
