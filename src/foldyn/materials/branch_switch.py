"""The compiled switch from a branch code of a law with memory to the formulas of that branch."""

from __future__ import annotations

from foldyn.jit.switches import by_code, switch
from foldyn.materials import eyring, latching, plastic, prony

MEMORY_LAWS = (prony.Prony, plastic.Plastic, eyring.Eyring)
_KINDS = (*MEMORY_LAWS, latching.Latching)  # latches are no law of creases
_BRANCHES = by_code({law.__name__: law.formulas for law in _KINDS})
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
