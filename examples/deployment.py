"""A flat sheet of paper that its creases fold into a Miura-ori."""

import numpy as np
from scipy.spatial.distance import pdist

import foldyn as fd

case_file = fd.read_case(fd.studies.find_case("gallery/deployment"))
case, motion = case_file.case(), case_file.run()

# distances between all vertices at the end, beside those of a Miura-ori of 60 degrees
goal = fd.patterns.miura(cells=(4, 4), a=0.025, b=0.025, panel_angle=60, dihedral=60)
end = (case.structure.nodes + motion.displacement[-1].values)[: len(goal.vertices)]  # m
error = np.abs(pdist(end) / pdist(goal.vertices) - 1.0).max()
print(f"shape off by {error:.1e}, energy error {motion.attrs['energy_error']:.1e}")

fd.plots.animate(case, motion, path="deployment.gif", frames=45, fps=12)
