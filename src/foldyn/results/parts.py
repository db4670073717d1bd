"""Parts of a result between which supports and planes are released, as the whole case has them."""

from __future__ import annotations

from collections.abc import Callable, Collection
from typing import Any

import numpy as np
import xarray as xr

from foldyn.results.dataset import AXIS
from foldyn.results.quantities import CONTACT, TENSION, energies_of, variable


def placed(
    case: Any, part: xr.Dataset, gone: Collection[str],
    factors: Callable[[float], Callable[[Any], float]], *without: str,
) -> xr.Dataset:  # fmt: skip
    """Samples of a part, without its facts; zero for what is released.

    Parameters
    ----------
    case : Case
        The whole case.
    part : xarray.Dataset
        Motion or path of the case without what is released.
    gone : collection of str
        Places of what is released.
    factors : callable
        Function of the time (s), or of the load factor: a function from a history to its factor.
    *without : str
        Variables to leave out.
    """
    along = str(part["displacement"].dims[0])
    own = part[[name for name in part if along in part[name].dims and name not in without]]
    dofs = 3 * part["support_node"].values + np.searchsorted(AXIS, part["support_axis"])
    own = own.drop_vars(["support_node", "support_axis"]).assign_coords(support=dofs)
    own = own.reindex(support=case.reaction_dofs, fill_value=0.0)
    planes = case.contact.planes if case.contact else ()
    if "plane" in own.dims:
        acting = [k for k in range(len(planes)) if f"contact.planes[{k}]" not in gone]
        own = own.assign_coords(plane=acting).reindex(plane=range(len(planes)), fill_value=0.0)
    sizes = {**own.sizes, "plane": len(planes)}
    for name, one in {**energies_of(case), **(CONTACT if case.contact else {})}.items():
        if name not in own and (planes or "plane" not in one.dims):
            zero = np.zeros([sizes[dim] for dim in (along, *one.dims)])
            own[name] = variable((along, *one.dims), zero, one.units, one.text)
    if case.lines is not None:  # results also have springs, but not if no bar or cable is left
        at = own["time" if along == "time" else "load_factor"].values.tolist()
        moved = zip(at, own["displacement"].values, strict=True)
        pulls = np.array([case.lines.at(factors(x)).pulls(u) for x, u in moved])
        pulls = pulls * [place not in gone for place in case.line_places]
        own = own.drop_vars("tension", errors="ignore")
        own["tension"] = variable((along, "line"), pulls, TENSION.units, TENSION.text)
    return own.drop_vars(["support", "plane"], errors="ignore")
