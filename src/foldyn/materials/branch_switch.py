"""The one compiled switch from the code of a branch of a law with memory to its formulas."""

from __future__ import annotations

from foldyn.jit.compiled import kernel
from foldyn.jit.switches import by_code, switch
from foldyn.materials import crease_damper, eyring, plastic, prony

MEMORY_LAWS = (prony.Prony, plastic.Plastic, eyring.Eyring)
_BRANCHES = by_code(
    {law.__name__: law.formulas for law in MEMORY_LAWS}
    | {"the damper of creases": (crease_damper.FORMULAS,)}
)
_ARGUMENTS = "p, before, after, dt, one, other"


update, mean_moment = (
    switch(
        __name__, name, f"code, {_ARGUMENTS}",
        {
            code: (f"{{0}}({_ARGUMENTS})", (formula,))
            for code, one in _BRANCHES.items() if (formula := getattr(one, name))
        },
        (", ".join(["nan"] * count), ()),
    )
    for name, count in (("update", 6), ("mean_moment", 3))
)  # fmt: skip


@kernel
def branch_table(code, p, after, dt, start, out):
    """`update` and mean moments along turns (m,) with times dt (m,) between them, to `out` (m, 9).

    start : (3,) turn and state before the first.
    """
    before, one, other = start[0], start[1], start[2]
    for i in range(after.size):
        found = update(code, p, before, after[i], dt[i], one, other)
        for c in range(6):
            out[i, c] = found[c]
        mean = mean_moment(code, p, before, after[i], dt[i], one, other)
        for c in range(3):
            out[i, 6 + c] = mean[c]
        before, one, other = after[i], found[0], found[1]
