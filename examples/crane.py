"""The crane from its crease pattern: folded flat, then opened by panels that bend."""

from pathlib import Path

import foldyn as fd

flat = fd.read_pattern(Path(__file__).parent / "patterns" / "crane.fold").rotated(45.0)
crane = fd.fold(flat, fraction=0.8, initial="folded", panels="subdivided")
print(crane)
fd.plots.draw_folding(crane, view=(50.0, -75.0)).savefig("crane.png", dpi=90)
fd.write_pattern(crane.pattern, "crane-opened.obj")
