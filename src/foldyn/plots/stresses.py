"""A sheet whose panels or creases are colored by their stresses, moments or margins."""

from __future__ import annotations

import numpy as np
import xarray as xr
from matplotlib import colormaps
from matplotlib.cm import ScalarMappable
from matplotlib.colors import Normalize
from matplotlib.figure import Figure
from numpy.typing import NDArray

from foldyn.errors import InputError
from foldyn.plots.designs import draw_colored
from foldyn.plots.scene import Sheet3D, View
from foldyn.results import case_of
from foldyn.strength.dataset import largest_of_panels
from foldyn.values import choice, of_kind, whole

QUANTITIES = {
    "von_mises": ("panel", "largest von Mises stress (Pa)"),
    "crease_moment": ("crease", "moment of the crease (N)"),
    "panel_margin": ("panel", "least margin of safety"),
    "crease_margin": ("crease", "least margin of safety"),
}
"""What can be drawn: parts that are colored, and the label of the color bar."""
RISING, MARGINS = "YlOrRd", "RdYlGn"
MOST = 3.0  # margins above this have the color of this one


def draw_stresses(
    found: xr.Dataset,
    quantity: str | None = None,
    *,
    state: int | None = None,
    view: tuple[float, float] = (28.0, -60.0),
    title: str = "",
) -> Figure:
    """Color the panels or creases of a sheet by stresses, moments or margins.

    Parameters
    ----------
    found : xarray.Dataset
        A result of `foldyn.stresses`, of `foldyn.margins`, or of `foldyn.random_response` or
        `foldyn.spectrum_response` with stresses.
    quantity : {"von_mises", "crease_moment", "panel_margin", "crease_margin"}, optional
        By default the first of these that the result has. Of stresses, the largest of a panel.
    state : int, optional
        Index of the state along the result; by default the one with the largest value.
    view : tuple of float
        Elevation above the xy plane and azimuth around z (degrees).
    title : str

    Returns
    -------
    matplotlib.figure.Figure

    Raises
    ------
    InputError
        A result without such a quantity; a state that it does not have.
    """
    of_kind("found", found, xr.Dataset)
    names = map(str, found.data_vars)
    named = {name.removesuffix("_rms").removesuffix("_peak"): name for name in names}
    known = [name for name in QUANTITIES if name in named]
    if not known:
        raise InputError(": has no stresses; give a result of fd.stresses or fd.margins", "found")
    chosen = known[0] if quantity is None else choice("quantity", quantity, known)
    on, label = QUANTITIES[chosen]
    name, sheet = named[chosen], Sheet3D.of(case_of(found))
    label = f"root mean square: {label}" if name.endswith("_rms") else label
    if chosen.endswith("margin"):
        shown, scale, colors = found[name].values, Normalize(-1.0, MOST), MARGINS
    else:
        shown = _of_parts(found, name, on, state)
        scale, colors = Normalize(0.0, float(shown.max(initial=0.0)) or 1.0), RISING
    colored = ScalarMappable(scale, colormaps[colors])
    return draw_colored(sheet, on, shown, colored, label, View(*view), title)


def _of_parts(found: xr.Dataset, name: str, on: str, state: int | None) -> NDArray[np.float64]:
    """Largest magnitude of each panel or crease, in one state."""
    size = np.abs(found[name].values)
    size = np.moveaxis(largest_of_panels(found, size) if on == "panel" else size, -1, 0)
    if size.ndim == 1:
        return size
    count = int(size.shape[-1])
    own = int(size.max(axis=0).argmax()) if state is None else whole("state", state, least=0)
    if own >= count:
        raise InputError(f" = {own}: there are states 0 to {count - 1}", "state")
    return size[:, own]
