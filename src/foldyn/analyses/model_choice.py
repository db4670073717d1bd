"""The model of a case file whose [model] leaves it open, decided here alone.

Superelements, which are close to a fine shell, for linear analyses of what they take; bars and
hinges for what moves far, and where superelements refuse the case or would take long.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from foldyn.analyses.keys import parts
from foldyn.analyses.sections import Choice, shared_keys
from foldyn.analyses.vibration import VibrationSchema
from foldyn.cases import Case
from foldyn.cases.models import BARS_AND_HINGES, SUPERELEMENTS
from foldyn.condensation import superelements
from foldyn.condensation.library import different
from foldyn.errors import InputError, quietly
from foldyn.patterns import Pattern

MOST_DIFFERENT = 20
"""Most different panels; each takes about a second to condense."""
MOST_PANELS = 400
"""Most panels times `VibrationSchema.solutions`; each takes about a tenth of a second."""
ANEW = "would be condensed anew for each design"


def choice_of(schema: Any, pattern: Pattern | None, before: Choice | None = None) -> Choice:
    """The model of checked sections.

    pattern : None if its table is wrong.
    before : what the choice fell on for other values of the file's keys.
    """
    if pattern is None or not (schema.model.open and isinstance(schema, VibrationSchema)):
        return Choice(schema.model.kind or BARS_AND_HINGES)
    if before is not None:
        return before
    why = _why_not(schema, pattern)
    return Choice(BARS_AND_HINGES if why else SUPERELEMENTS, why, open=True)


def bound(key: str) -> bool:
    """Whether a key of a case file belongs to bars and hinges."""
    table, *rest = parts(key)
    return table == "model" and not {*rest[:1]} <= shared_keys()


def _why_not(schema: VibrationSchema, pattern: Pattern) -> str:
    """Why superelements are not taken; "" if they are."""
    if schema.beyond_rest:
        return f"do not take {schema.beyond_rest}"
    if schema.design is not None:
        return ANEW
    varied = [one.key for one in schema.sweep.vary if bound(one.key)] if schema.sweep else []
    if varied:
        return f"do not have {varied[0]}, which [sweep] varies"
    each, what = schema.solutions
    if len(pattern.faces) * each > MOST_PANELS:
        most = f"{MOST_PANELS / each:.3g}"
        return f"would take long: {len(pattern.faces)} panels{what}, more than {most}"
    try:
        check_vertices(schema, len(pattern.vertices))
        shapes = different(pattern, schema.sheet)
        if shapes > MOST_DIFFERENT:
            return f"would take long: {shapes} different panels, more than {MOST_DIFFERENT}"
        with quietly():
            made = superelements(pattern, schema.sheet, **schema.model.options(SUPERELEMENTS))
            Case(
                made, schema.supports, schema.loads, schema.damping.made(), schema.masses,
                schema.contact, schema.air,
            )  # fmt: skip
    except InputError as error:
        return f"refuse the case ({error})"
    return ""


def check_vertices(schema: Any, count: int) -> None:
    """Refuse nodes between vertices: a case file must hold for every mesh of a shell."""
    places: dict[str, Any] = {
        f"{name}[{i}].{key}": np.ravel(given).tolist()
        for name in ("supports", "loads", "masses", "drive")
        for i, part in enumerate(getattr(schema, name, ()))
        for key in ("nodes", "between")
        if not isinstance(given := getattr(part, key, "") or "", str)
    }
    parts = {f"supports[{i}]": part for i, part in enumerate(schema.supports)}
    planes = schema.contact.planes if getattr(schema, "contact", None) else ()
    parts |= {f"contact.planes[{i}]": part for i, part in enumerate(planes)}
    for place, part in {**parts, "analysis": schema.analysis}.items():
        node = getattr(getattr(part, "until", None), "node", None)
        places |= {} if node is None else {f"{place}.until.node": (node,)}
    places["output.nodes"] = getattr(schema.output, "nodes", None)
    for place, nodes in places.items():
        if nodes is None or isinstance(nodes, str):
            continue
        beyond = [node for node in nodes if not 0 <= node < count]
        if beyond:
            raise InputError(
                f": {beyond[0]} is no vertex of the pattern, which has 0 to {count - 1}; a case "
                "file names nodes of a shell, or of superelements, by vertex",
                place,
            )
