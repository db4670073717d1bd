"""MJCF, the XML of MuJoCo: panels as rigid bodies, creases as hinge joints with springs.

In the state of the case, the frames of all bodies are that of the world, so positions are those of
the case. Bodies form trees, breadth first from what supports hold, each with the joint of its
crease to its parent. A crease that closes a loop has a joint, too: its child is a copy of the panel
there, welded to that panel, and the two share the mass.

The angle of a joint is the turn of its crease from its rest angle, positive where it opens.
"""

from __future__ import annotations

from collections import Counter, defaultdict
from collections.abc import Iterator
from pathlib import Path
from typing import Any
from xml.etree.ElementTree import Element, SubElement, indent, tostring

import numpy as np
from numpy.typing import NDArray
from scipy.sparse import coo_array
from scipy.sparse.csgraph import breadth_first_order

from foldyn.cases import Case
from foldyn.cases.damping import CreaseDamping, Rayleigh, StrainDamping
from foldyn.cases.history import CONSTANT
from foldyn.cases.latches import Latch
from foldyn.cases.loads import Actuate, Gravity
from foldyn.cases.releases import refuse_releases
from foldyn.cases.selection import resolve_creases
from foldyn.cases.stops import SIDES, Stop
from foldyn.cases.supports import BaseMotion, Dashpot, Fix
from foldyn.errors import InputError, warn
from foldyn.exports.creased_shell import fold_slopes
from foldyn.patterns.topology import components
from foldyn.values import one_or_each
from foldyn.writing import write_text

Pin = tuple[int, int, int]
Joint = tuple[int | None, int, int]
WORLD = 0  # number of the body that does not move
LONGEST, PHASE = 1e-3, 0.1  # s, longest step; rad, phase of the fastest vibration in a step
STIFF = "0.9999 0.9999 1"  # impedance of constraints, the highest that MuJoCo takes
FAR = 2.0 * np.pi  # rad, which creases do not turn
ON_LINE = 1e-9  # width of points on a line, relative to its length
FULL = (0, 1, 2, 0, 0, 1), (0, 1, 2, 1, 2, 2)  # entries of a tensor in the order of MuJoCo
EXACT = Fix, Stop, Latch, Gravity, Actuate, CreaseDamping, StrainDamping


def write(result: Any, path: Path, case: Case) -> list[Path]:
    """Write a case as a model of MuJoCo, in SI units; `result` is not needed."""
    _check(case)
    root = _model(case)
    indent(root)
    write_text(tostring(root, "unicode") + "\n", path)
    return [path]


def _model(case: Case) -> Element:
    structure, pattern = case.structure, case.structure.pattern
    held = set(np.flatnonzero(case.fixed.all(axis=1)).tolist())
    panel, nodes, moments = _bodies(case, held)
    ends = panel[pattern.crease_faces].reshape(-1, 2)
    pins, at = list(_pins(nodes, ends.tolist(), held)), [[] for _ in nodes]
    for base, k, node in pins:
        at[k] += [structure.nodes[node]] * (base == WORLD)
    order = sorted(range(len(at)), key=lambda k: (k != WORLD, -len(at[k]), -moments[k, 3, 3]))
    joints, closing = _trees(ends, order)
    copies = Counter(k for _, _, k in closing)
    mass, center, tensor = _rigid(moments / [[[1 + copies[k]]] for k in range(len(at))])
    along = np.diff(pattern.vertices[pattern.creases], axis=1)[:, 0]
    length, stiffness = np.linalg.norm(along, axis=1), _stiffness(case)

    root = Element("mujoco", model=pattern.name or "foldyn")
    _add(root, "compiler", angle="radian")
    tags = "default", "asset", "worldbody", "equality", "tendon"
    default, asset, world, equality, tendon = (_add(root, tag) for tag in tags)
    apart, made = ends[:, 0] != ends[:, 1], {WORLD: world}
    free, stops = _stops(case, apart * length, tendon)
    hinges = _hinges(case, apart * stiffness, length, free, root)
    step = _step(tensor, ends, along / length[:, None], stiffness + stops)
    gravity = sum((vector for vector, _ in case.gravity_terms), np.zeros(3))
    _add(root, "option", timestep=step, integrator="implicitfast", gravity=gravity)
    _add(default, "geom", type="mesh", contype=0, conaffinity=0)
    _add(default, "equality", solref=(2.0 * step, 1.0), solimp=STIFF)
    name = {k: f"panel_{number}" for number, k in reversed([*enumerate(panel.tolist())])}
    name[WORLD], roots = "world", [k for crease, _, k in joints if crease is None]
    for crease, parent, k in joints + closing:
        own = f"{name[k]}_at_crease_{crease}" if k in made else name[k]
        body = _add(made[parent], "body", name=own)
        _add(body, "inertial", mass=mass[k], pos=center[k], fullinertia=tensor[k][FULL])
        if crease is None:
            points = [*at[k][:1], *at[k][1:][-1:]]
            line = {"pos": points[0], "axis": points[-1] - points[0]} if points else {}
            _add(body, "joint", type=("free", "ball", "hinge")[len(points)], **line)
        else:
            axis = along[crease] if parent == ends[crease, 0] else -along[crease]
            _add(body, "joint", axis=axis, **hinges[crease])
        if made.setdefault(k, body) is not body:
            _add(equality, "weld", body1=name[k], body2=own)
    for base, k, node in pins:
        if base != WORLD or k not in roots or not _on_line(np.array(at[k])):
            joined = {"body1": name[k], "body2": name[base]}
            _add(equality, "connect", **joined, anchor=structure.nodes[node])
    _draw(case, [made[k] for k in panel.tolist()], asset)
    return root


def _draw(case: Case, places: list[Element], asset: Element) -> None:
    """Add the two sides of each panel to its body."""
    structure = case.structure
    thickness = structure.sheet.values("thickness", len(places))
    half = 0.5 * thickness[:, None] * structure.pattern.face_normals
    for panel, place in enumerate(places):
        own = structure.triangles[structure.triangle_panel == panel]
        corners, face = np.unique(own, return_inverse=True)
        sides = structure.nodes[corners] + np.multiply.outer([[1.0], [-1.0]], half[panel])
        face = face.reshape(-1, 3), face.reshape(-1, 3)[:, ::-1] + len(corners)
        _add(asset, "mesh", name=f"panel_{panel}", inertia="shell", vertex=sides, face=face)
        _add(place, "geom", mesh=f"panel_{panel}")


def _add(parent: Element, tag: str, **values: Any) -> Element:
    """Append an element; its attributes are texts, or numbers of any shape."""
    texts = {key: " ".join(map(str, np.ravel(value).tolist())) for key, value in values.items()}
    return SubElement(parent, tag, texts)


# ------------------------------------------------------------------ bodies
def _bodies(case: Case, held: set[int]) -> tuple[NDArray, list[set[int]], NDArray]:
    """Body (np,) of each panel; nodes of each body; its moments (nb, 4, 4).

    Panels that no crease separates are one body. Those held at nodes off a line are `WORLD`. The
    moments are integrals of x x' over the mass, x = (position, 1), in kg m2, kg m and kg.
    """
    structure, of = case.structure, case.structure.triangle_panel
    part = components(structure.pattern.weld_faces, len(structure.pattern.faces))
    groups = [set(structure.triangles[part[of] == k].flat) for k in range(part.max() + 1)]
    moves = [_on_line(structure.nodes[sorted(own & held)]) for own in groups]
    panel = np.where(moves, np.cumsum(moves), WORLD)[part]
    nodes = [set(structure.triangles[panel[of] == k].flat) for k in range(1 + sum(moves))]
    # over a triangle of mass m: m/12 (sum of x x' over its corners + s s'), s the sum of these x
    x = np.insert(structure.nodes[structure.triangles], 3, 1.0, axis=2)
    thickness = structure.sheet.values("thickness", len(part))
    across = np.insert(thickness[:, None] * structure.pattern.face_normals, 3, 0.0, axis=1)
    x = np.concatenate([x, x.sum(axis=1, keepdims=True), across[of][:, None]], axis=1)
    mass = structure.surface.areal_density[of] * structure.surface.triangle_area
    moments = np.zeros((len(nodes), 4, 4))
    np.add.at(moments, panel[of], np.einsum("t,tka,tkb->tab", mass / 12.0, x, x))
    for node in np.flatnonzero(case.point_masses).tolist():
        place = np.append(structure.nodes[node], 1.0)
        first = next(k for k, own in enumerate(nodes) if node in own)
        moments[first] += case.point_masses[node] * np.outer(place, place)
    return panel, nodes, moments


def _on_line(x: Any) -> bool:
    """Whether points (k, 3) are on one line."""
    return len(x) < 3 or bool(np.linalg.matrix_rank(x - x[0], rtol=ON_LINE) < 2)


def _rigid(moments: NDArray) -> tuple[NDArray, NDArray, NDArray]:
    """Mass (nb,), center (nb, 3) and inertia about it (nb, 3, 3) of bodies."""
    mass = np.maximum(moments[:, 3:, 3:], np.finfo(float).tiny)
    center = moments[:, :3, 3:] / mass
    second = moments[:, :3, :3] - mass * center * center.swapaxes(1, 2)
    tensor = np.trace(second, axis1=1, axis2=2)[:, None, None] * np.eye(3) - second
    return mass.ravel(), center[:, :, 0], tensor


# ------------------------------------------------------------------ what joins them
def _pins(nodes: list[set[int]], ends: list[list[int]], held: set[int]) -> Iterator[Pin]:
    """Two bodies and a node that they share, unless creases at the node join them.

    The first is `WORLD` where the node is held, the second the one that is held at most nodes.
    """
    sides = [(k, node) for k, own in enumerate(nodes) for node in sorted(own)]
    place = {side: number for number, side in enumerate(sides)}
    linked = [(place[a, node], place[b, node]) for a, b in ends for node in nodes[a] & nodes[b]]
    around = defaultdict(list)
    for (k, node), fan in zip(sides, components(linked, len(sides)).tolist(), strict=True):
        around[node, fan].append(k)
    base = dict.fromkeys(held, WORLD)
    for (node, _), fan in around.items():
        if base.setdefault(node, fan[0]) not in fan:
            yield base[node], max(fan, key=lambda k: len(nodes[k] & held)), node


def _trees(ends: NDArray, order: list[int]) -> tuple[list[Joint], list[Joint]]:
    """Joints (crease, parent, child), parents first, and those that close loops.

    The roots, first of all that are connected, are children of `WORLD` without a crease.
    """
    part, roots = components(ends, len(order)).tolist(), {}
    for k in order:
        roots.setdefault(part[k], k)
    links = np.concatenate([ends, [(WORLD, k) for k in roots.values()]])
    graph = coo_array((np.ones(len(links)), links.T), (len(order), len(order)))
    found, before = breadth_first_order(graph.tocsr(), WORLD, directed=False)
    crease = {frozenset(two): number for number, two in enumerate(ends.tolist())}
    tree = [(before[k], k) for k in found[1:].tolist()]
    joints = [(crease.get(frozenset(two)), *two) for two in tree]
    closing = set(range(len(ends))) - {number for number, _, _ in joints}
    loops = [(number, *sorted(ends[number].tolist())) for number in sorted(closing)]
    return joints, [(number, a, b) for number, a, b in loops if a != b]


def _stiffness(case: Case) -> NDArray:
    """Stiffness (nc,) of the creases alone, N m/rad, without that of their panels."""
    folds, slopes = case.structure.body.sheet.fold_hinges(), fold_slopes(case.structure)
    alone = folds.stiffness / (1.0 - folds.softness * folds.stiffness)
    return np.bincount(folds.fold, alone, len(slopes)) * slopes


def _step(tensor: NDArray, ends: NDArray, axis: NDArray, stiffness: NDArray) -> float:
    """Time step (s), by w^2 <= max over bodies of the sum of 2 k e' I^-1 e over their creases."""
    light = np.concatenate([np.zeros((1, 3, 3)), np.linalg.inv(tensor[1:])])
    square = 2.0 * stiffness[:, None] * np.einsum("ca,csab,cb->cs", axis, light[ends], axis)
    fastest = np.bincount(ends.ravel(), square.ravel()).max(initial=1.0) ** 0.5
    return float(min(LONGEST, PHASE / fastest))


def _stops(case: Case, length: NDArray, tendon: Element) -> tuple[NDArray, NDArray]:
    """Add end stops, as springs that are slack before their angles; a length of 0 is no joint.

    Returns the turns (nc, 2), rad, between which creases are free, and the stops' stiffness (nc,).
    """
    structure, now = case.structure, case.structure.pattern.dihedrals
    free, stiffness = np.tile([-FAR, FAR], (len(now), 1)), np.zeros(len(now))
    for place, part in enumerate(case.supports):
        if not isinstance(part, Stop | Latch):
            continue
        creases = resolve_creases(structure, part.creases, f"supports[{place}].creases")
        angles = np.radians(one_or_each("angle", part.angle, len(creases), "creases"))
        for k, angle in zip(creases.tolist(), angles.tolist(), strict=True):
            if length[k] == 0.0:
                continue
            above = SIDES.get(str(getattr(part, "side", None)), float(angle - now[k])) > 0.0
            turn, spring = angle - structure.fold_rest[k], part.stiffness * length[k]
            slack = (-FAR, turn) if above else (turn, FAR)
            fixed = _add(tendon, "fixed", springlength=slack, stiffness=spring)
            _add(fixed, "joint", joint=f"crease_{k}", coef=1.0)
            free[k] = max(free[k, 0], slack[0]), min(free[k, 1], slack[1])
            stiffness[k] += spring
    return free, stiffness


def _hinges(
    case: Case, stiffness: NDArray, length: NDArray, free: NDArray, root: Element
) -> list[dict[str, Any]]:
    """Attributes of the joints of creases, except their axes; add actuators to the root.

    A stiffness of 0 is no joint.
    """
    structure, pattern, actuator = case.structure, case.structure.pattern, _add(root, "actuator")
    damping = case.crease_damping * length + case.strain_damping * stiffness
    turns = sum((turns for turns, _ in case.actuation_terms), np.zeros(len(length)))
    turns, hinges = np.where(stiffness > 0.0, turns, 0.0), []
    for k, turn in enumerate(turns.tolist()):
        name, start = f"crease_{k}", pattern.vertices[pattern.creases[k, 0]]
        ref = pattern.dihedrals[k] - structure.fold_rest[k]
        own = {"name": name, "pos": start, "ref": ref, "damping": damping[k]}
        if np.ptp(free[k]) < 2.0 * FAR:
            own |= {"range": free[k], "limited": "false"}
        if turn != 0.0:
            servo = {"kp": stiffness[k], "ctrlrange": (-abs(turn), abs(turn))}
            _add(actuator, "position", name=name, joint=name, **servo)
        else:
            own["stiffness"] = stiffness[k]
        hinges.append(own)
    if turns.any():
        _add(_add(root, "keyframe"), "key", name="actuated", ctrl=turns[turns != 0.0])
    return hinges


# ------------------------------------------------------------------ what is refused
def _check(case: Case) -> None:
    """Refuse what would move differently; warn of what is left out."""
    refuse_releases(case, "a model of MuJoCo")
    structure = case.structure
    if structure.linear or structure.pattern is None:
        raise InputError(
            ": must have panels that can turn far; make it with fd.discretize", "structure"
        )
    some = np.flatnonzero(case.fixed.any(axis=1) & ~case.fixed.all(axis=1))
    wrong = {
        f"supports[{k}]": f"MuJoCo has no joint for this {type(part).__name__}; leave it out"
        for k, part in enumerate(case.supports)
        if not isinstance(part, (*EXACT, BaseMotion, Dashpot)) or getattr(part, "direction", None)
    } | {
        "supports": some.size and f"hold node {some[0]} along some axes; hold all, or none",
        "pattern": structure.pattern.boards and "has thick panels; give the thin pattern",
        "clamped": structure.options.clamped and "hold three corners of these panels instead",
    }
    for field, text in wrong.items():
        if text:
            raise InputError(f": {text}", field)
    parts = *case.supports, *case.loads, *case.dampings
    left = {type(p).__name__ for p in parts if not isinstance(p, EXACT) and p != Rayleigh()}
    left |= {name for name in ("contact", "air") if getattr(case, name)}
    left |= {"the hold of Latch"} if case.latches else set()
    left |= {"the damping of Stop"} if case.damped_stops else set()
    if any(history.code != CONSTANT for _, history in case.gravity_terms):
        left.add("the history of Gravity")
    if left:
        warn(
            f"the model of MuJoCo leaves out {', '.join(sorted(left))}; add what you need there",
            "exports.md#mujoco",
        )
