"""From a pattern and a sheet to a structure of bars and hinges."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any, Literal

import numpy as np
from numpy.typing import ArrayLike, NDArray

from foldyn.errors import InputError, warn
from foldyn.materials import BarLaw, HingeLaw
from foldyn.materials.plate_superlinear import plate_onset
from foldyn.patterns import Pattern
from foldyn.patterns.pattern import Patterned, pattern_of
from foldyn.ram_limit import check_memory
from foldyn.structures import held_edges
from foldyn.structures.beyond_range import doubt_locking, doubt_range, doubt_units
from foldyn.structures.calibration import (
    Folds,
    PerCrease,
    bar_areas,
    bend_stiffness,
    check_sheet,
    fold_rest,
    fold_stiffness,
)
from foldyn.structures.edge_angles import edge_plates, spoke_stiffness
from foldyn.structures.fold_law import FoldLaws
from foldyn.structures.membranes import membranes
from foldyn.structures.mesh import hinge_angles, n4b5, n5b8
from foldyn.structures.plate import panel_plates, weld_stiffness
from foldyn.structures.presets import resolved
from foldyn.structures.rigid_plates import check_welds, checked_panels, rigid_panels
from foldyn.structures.sheet import Sheet
from foldyn.structures.structure import Structure
from foldyn.values import of_kind, vector

PER_NODE = 12_000.0
"""Bytes per node with its tangent: measured 5000 with single, 10,400 with coupled bars."""


def discretize(
    pattern: Pattern | Patterned,
    sheet: Sheet,
    *,
    scheme: Literal["n5b8", "n4b5", "n5b8e"] | None = None,
    mass: str | None = None,
    bar_law: str | BarLaw | None = None,
    fold_law: FoldLaws | None = None,
    bend_law: str | HingeLaw | None = None,
    calibration: Literal["standard", "merlin2", "plate"] | None = None,
    crease_stiffness: Folds = None,
    crease_rest: PerCrease = None,
    centers: Mapping[int, ArrayLike] | None = None,
    clamped: str | Sequence[Sequence[int]] = (),
    rigid: str | Sequence[int] | None = None,
    straight: str | Sequence[Sequence[int]] = (),
    guided: Mapping[str, str | Sequence[Sequence[int]]] | Sequence[held_edges.Guided] = (),
    membrane: Literal["bars", "panel"] | None = None,
    preset: Literal["n5b8e", "plate", "herkal", "merlin2"] | None = None,
) -> Structure:
    """Discretize a pattern as bars and hinges.

    The preset supplies the model options, from `scheme` to `calibration`, that are not given.

    Parameters
    ----------
    pattern : Pattern or Folding
        Or any object with a `pattern` attribute.
    sheet : Sheet
    scheme : {"n5b8", "n4b5", "n5b8e"}
        A center node and spokes in each panel of more than three corners, or cuts along the
        shortest diagonals. "n5b8e" is "n5b8" whose panels bend as condensed plates that also give
        way at their edges (see `foldyn.structures.edge_angles`); it takes calibration = "plate",
        linear bends and implicit methods of motion.
    mass : str
        Mass rule, such as "consistent"; see the page on mass rules.
    bar_law : {"ogden", "linear"} or BarLaw
        Law of bars.
    fold_law : {"linear", "superlinear", "enhanced"} or HingeLaw, sequence or mapping, optional
        Law of all creases, of each in the order of `pattern.creases`, or by name, as
        `crease_stiffness`. Creases that are not named have the law of the name "others", which is
        by default that of the preset.
    bend_law : {"linear", "superlinear", "enhanced", "plate_superlinear"} or HingeLaw
        Law of hinges inside panels.
    calibration : {"standard", "merlin2", "plate"}
        "merlin2" assigns bend stiffnesses and bar areas in MERLIN2's order (see
        `foldyn.structures.calibration`); "plate" makes panels bend and twist like thin plates, for
        small vibrations (see `foldyn.structures.plate`).
    crease_stiffness : float, Strip, sequence or mapping, optional
        Stiffness per length (N m/rad per m), or a strip with a width, of all creases, of each in
        the order of
        `pattern.creases`, or by name ("mountain", "valley", "flat", or a family of the pattern),
        for example {"mountain": 0.1, "valley": 0.2}. Creases that are not named keep the calibrated
        stiffness. With "plate" the adjacent panels remain compliant to the crease's moment.
    crease_rest : float, sequence or mapping, optional
        Rest dihedral (degrees, between 0 and 360), given in the same ways, instead of the pattern's
        own.
    centers : mapping, optional
        Center points (3,) by panel number, in place of computed points (N5B8).
    clamped : sequence of (vertex, vertex), or str
        Boundary edges along which panels keep the direction of their rest tangent in space; their
        nodes still need supports. A selection ("xmin") means the boundary edges with both ends in
        it. See `foldyn.structures.held_edges`, and `edge_angles` for "n5b8e".
    rigid : "all" or sequence of int, optional
        Panels that cannot bend at all: three of their corners determine the positions of all their
        nodes. They must be flat. Their bars still stretch.
    straight : sequence of (vertex, vertex), or str
        Boundary edges that stay straight, such as along a support or a stiff rim, given like
        `clamped`; other boundary edges may bow between their ends. For "n5b8e", and in the plane of
        panels for membrane = "panel".
    guided : mapping of {"x", "y", "z"}, optional
        Boundary edges held along one axis along their length and free otherwise, by axis, for
        example {"z": "zmax"} for a rim on a smooth plate, which bows in its plane. A rim glued to a
        stiff plate is `straight`. See `foldyn.structures.held_edges`.
    membrane : {"bars", "panel"}
        In-plane stiffness of panels: independent bars, which are exact in uniform strain at best;
        or bars coupled so that the corners have the panel's membrane stiffness, which is accurate
        for large and for supported sheets (see `foldyn.structures.membranes`). "panel" needs
        `bar_law` "linear"; another bar law, without a given membrane, implies "bars".
    preset : {"n5b8e", "plate", "herkal", "merlin2"}, optional
        Model that supplies options that are not given. The default is "n5b8e"; "plate", the fast
        one, if another scheme, the calibration "plate", another bend law or superlinear folds are
        given; and "herkal", the model of the paper, if another calibration is given, or
        `bend_law="superlinear"` without a calibration.

    Returns
    -------
    Structure

    Raises
    ------
    InputError
        An argument out of range, a panel that cannot be cut, a crease closed at rest.

    Warns
    -----
    UnitsWarning
        The sheet's values are probably not in SI units: a thickness of more than a fifth of an
        edge, or a wave speed that no material has.
    ModelRangeWarning
        The model is inaccurate for such a pattern.

    Examples
    --------
    >>> import foldyn as fd
    >>> pattern = fd.patterns.simple_fold(a=1.0, b=1.0, dihedral=60)
    >>> sheet = fd.Sheet(youngs_modulus=1e6, poissons_ratio=0.25, thickness=0.01)
    >>> fd.discretize(pattern, sheet).fold_stiffness.round(4).tolist()
    [0.0639]
    """
    pattern, sheet = checked_kinds(pattern, sheet)
    edges = held_edges.boundary_edges(clamped, pattern, "clamped")
    options = resolved(
        preset, scheme=scheme, mass=mass, bar_law=bar_law, fold_law=fold_law, bend_law=bend_law,
        calibration=calibration, crease_stiffness=crease_stiffness, crease_rest=crease_rest,
        clamped=edges, rigid=checked_panels(rigid, len(pattern.faces)),
        straight=held_edges.boundary_edges(straight, pattern, "straight"),
        guided=held_edges.guided_edges(guided, pattern), membrane=membrane,
    )  # fmt: skip
    check_welds(options.rigid, pattern)
    if len(pattern.welds) and options.scheme != "n5b8e":
        warn(
            f"pattern: its welds ({len(pattern.welds)}) become hinges, which model the bending of "
            'the sheet only roughly: take preset = "n5b8e", superelements, or a shell',
            "facets.md#models-and-accuracy",
        )
    nodes = len(pattern.vertices) + len(pattern.faces)
    check_memory("pattern", f"a structure of {nodes} nodes", PER_NODE * nodes, "take fewer panels")
    check_sheet(sheet, pattern)
    if any(own.orthotropic for own in sheet.kinds(len(pattern.faces))[0]):
        raise InputError(
            "sheet: youngs_modulus: bars and hinges are calibrated for isotropic sheets; take "
            'fd.superelements or fd.shell (in a case file, [model] kind = "superelements" or '
            '"shell")'
        )
    points = _given_centers({} if centers is None else centers, pattern, options.scheme)
    mesh = n4b5(pattern) if options.scheme == "n4b5" else n5b8(pattern, points)
    merlin2 = options.calibration == "merlin2"
    coupling = options.membrane == "panel"
    inner_area, edge_area = bar_areas(mesh, pattern, sheet, merlin2, alike=coupling)
    area = np.concatenate([inner_area, [edge_area[a, b] for a, b in pattern.lines.tolist()]])

    folds = fold_stiffness(options.crease_stiffness, pattern, sheet)
    doubt_range(pattern, sheet, options, folds)
    welds, onset = weld_stiffness(pattern, sheet), np.zeros(0)
    bends = np.concatenate([bend_stiffness(mesh, pattern, sheet, merlin2), welds])
    plates, softness = None, np.zeros(len(folds))
    x, hinges = mesh.nodes, np.concatenate([mesh.bends, mesh.welds])
    clamps, clamped_triangle = held_edges.clamp_rows(edges, mesh.triangles)
    clamped_panel = mesh.triangle_panel[clamped_triangle]
    modulus = sheet.values("bending_modulus", len(pattern.faces))[clamped_panel]
    turning = held_edges.clamp_stiffness(x, clamps, modulus)
    stiff = rigid_panels(options.rigid, len(pattern.faces))
    if options.scheme == "n5b8e":
        springs = dict(zip(edges, turning.tolist(), strict=True))
        held = held_edges.straight_in_bending(options.straight, options.guided, pattern, sheet)
        plates = edge_plates(mesh, pattern, sheet, held, stiff, springs)
        stiffness = spoke_stiffness(plates, len(mesh.folds), len(bends) + len(edges))
        bends, turning = np.split(stiffness, [len(bends)])
    elif options.calibration == "plate":
        plated = panel_plates(mesh, pattern, sheet, options.rigid)
        folds, softness, large = plated.folds(folds), plated.creases, bends
        bends = np.concatenate([plated.bends, welds])
        onset = plate_onset(bends, large)

    coupled, gives = (), np.zeros((0, 2), np.int64)
    if coupling:
        held = [*held_edges.straight_in_plane(options.straight, options.guided, pattern), *edges]
        coupled, gives = membranes(
            mesh, pattern, sheet, held, stiff, options.scheme == "n5b8e",
            held_edges.directions(options.guided, pattern),
        )  # fmt: skip
    structure = Structure(
        nodes=x,
        bars=np.concatenate([mesh.inner, pattern.lines]),
        bar_area=area,
        sheet=sheet,
        options=options,
        pattern=pattern,
        folds=mesh.folds,
        fold_stiffness=folds,
        panel_softness=softness,
        fold_rest=fold_rest(options.crease_rest, hinge_angles(x, mesh.folds), pattern),
        bends=hinges,
        bend_stiffness=bends,
        bend_rest=hinge_angles(x, hinges),
        bend_onset=onset,
        triangles=mesh.triangles,
        triangle_panel=mesh.triangle_panel,
        centers=mesh.centers,
        clamps=clamps,
        clamp_stiffness=turning,
        edge_plates=plates,
        membranes=coupled,
        edge_gives=gives,
    )
    _ = structure.plates  # refuses rigid panels that are not flat
    doubt_locking(structure)
    return structure.marked()


def checked_kinds(pattern: Any, sheet: Any) -> tuple[Pattern, Sheet]:
    """Pattern and sheet; accepts objects with a pattern, refuses anything else, doubts units."""
    pattern, sheet = pattern_of(pattern), of_kind("sheet", sheet, Sheet)
    doubt_units(pattern, sheet)
    return pattern, sheet


def _given_centers(
    centers: Mapping[int, ArrayLike], pattern: Pattern, scheme: str
) -> dict[int, NDArray]:
    """Given center points by panel index; each panel must have a center node."""
    points = {}
    for panel, point in of_kind("centers", centers, Mapping).items():
        known = isinstance(panel, int | np.integer) and 0 <= panel < len(pattern.faces)
        if not known or len(pattern.faces[panel]) < 4 or scheme == "n4b5":
            raise InputError(
                f"centers: panel {panel!r} has no center node; only N5B8 panels of more than "
                f"three corners have one ({len(pattern.faces)} panels, scheme {scheme})"
            )
        points[int(panel)] = np.array(vector(f"centers: panel {panel}", point))
    return points
