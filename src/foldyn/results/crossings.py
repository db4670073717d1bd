"""Panels that pass through each other at samples of a result: search, message and record.

Without contact nothing keeps panels apart. Pairs that already cross in the pattern at rest are left
out. Boards (thick panels) are left out too, as they lie off the pattern's panels.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
import xarray as xr
from numpy.typing import NDArray

from foldyn.cases import Case
from foldyn.mechanics.crossings import crossing_panels, pairs_text
from foldyn.results.columns import Column
from foldyn.results.quantities import CROSSINGS, variables


class Crossings(NamedTuple):
    """Crossings found in a result.

    Attributes
    ----------
    looked : (l,)
        Samples that were checked.
    crossed : (k,)
        Checked samples at which panels cross.
    panels, first : (p, 2), (p,)
        Pairs of panels that cross at any of these samples, and the first such sample of each pair,
        by which the pairs are sorted.
    """

    looked: NDArray[np.int64]
    crossed: NDArray[np.int64]
    panels: NDArray[np.int64]
    first: NDArray[np.int64]

    def recorded(self, result: xr.Dataset) -> xr.Dataset:
        """Add the crossings to the result."""
        counts = {"crossing_looks": len(self.looked), "crossing_samples": len(self.crossed)}
        if not len(self.crossed):
            return result.assign_attrs(counts)
        found = {"crossing_panels": self.panels, "crossing_first": self.first}
        return result.assign(variables(CROSSINGS, "crossing", found)).assign_attrs(counts)

    def text(self, when: str, samples: int) -> str:
        """Describe the crossings in words; empty if there are none.

        when : the first sample with a crossing, such as "t = 0.1 s".
        samples : number of samples of the result.
        """
        if not len(self.crossed):
            return ""
        all_looked = len(self.looked) == samples
        seen = f"{samples} samples" if all_looked else f"{len(self.looked)} samples looked at"
        return (
            f"panels pass through each other: {pairs_text(self.panels)}, first at {when}, and at "
            f"{len(self.crossed)} of the {seen}. Nothing keeps them apart: what follows is not "
            "what a real sheet does; give the case contact"
        )


def crossings_of(case: Case, displacement: NDArray | Column, stride: int = 1) -> Crossings:
    """Find panels that pass through each other.

    Parameters
    ----------
    case : Case
    displacement : ndarray or Column, shape (k, n, 3)
        Displacement of the nodes at each sample, m. Samples that are not finite are skipped.
    stride : int
        Check every `stride`-th sample, counted back from the last one. If panels cross, the samples
        between the first crossing and the checked sample before it are checked too.
    """
    structure, count = case.structure, len(displacement)
    panels = getattr(structure, "triangle_panel", np.zeros(0, int))  # net models have no triangles
    if not len(panels) or (structure.pattern is not None and structure.pattern.boards is not None):
        return _found({}, 1)
    many = int(panels.max()) + 1

    def keys(u: NDArray) -> NDArray[np.int64]:
        """Keys of the pairs that cross, first panel * many + second panel."""
        return crossing_panels(structure.nodes + u, structure.triangles, panels) @ [many, 1]

    at_rest = keys(np.zeros_like(structure.nodes))

    def seen(samples: range) -> dict[int, NDArray[np.int64]]:
        finite = [k for k in samples if np.isfinite(displacement[k]).all()]
        found = {k: keys(displacement[k]) for k in finite}
        return {k: np.setdiff1d(new, at_rest) if len(new) else new for k, new in found.items()}

    found = seen(range((count - 1) % stride, count, stride))
    earliest = next((k for k, pairs in found.items() if len(pairs)), 0)
    return _found(found | seen(range(max(0, earliest - stride + 1), earliest)), many)


def _found(seen: dict[int, NDArray[np.int64]], many: int) -> Crossings:
    """Collect crossings from the keys of the pairs that cross at each sample."""
    looked = sorted(seen)
    crossed = np.array([k for k in looked if len(seen[k])], np.int64)
    keys = np.concatenate([np.zeros(0, np.int64), *(seen[k] for k in crossed.tolist())])
    samples = np.repeat(crossed, [len(seen[k]) for k in crossed.tolist()])
    first = np.sort(np.unique(keys, return_index=True)[1])
    pairs = np.stack(np.divmod(keys[first], many), axis=1)
    return Crossings(np.array(looked, np.int64), crossed, pairs, samples[first])
