"""Pullback of forces: derivatives of the weighted forces of a model, term by term.

For weights w and the forces F of a term at a state, a term's pullback adds the derivatives of w . F
with respect to the displacements (the tangent times w), the velocities, and each of the term's own
arrays, such as stiffness, rest angles and rest positions. Solvers need nothing else for exact
gradients: the adjoint method never forms the derivative of F with respect to an array (Griewank and
Walther, Evaluating Derivatives, 2008, chapter 3).

The kernel of a term has the signature

    pullback(own, u, v, t, weight, product, rate)

with addresses of arrays (rows, 3), as in `mechanics.term`; it adds to `product`, to `rate`, and to
the arrays `Pulled.gradient` in its context.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from foldyn.errors import InputError
from foldyn.jit.compiled import Addressed, addressed, inner_scalar, kernel
from foldyn.jit.context import Context, run_at
from foldyn.mechanics.term import ADDRESS, NUMBER, in_rows

pullback = addressed(ADDRESS, ADDRESS, NUMBER, ADDRESS, ADDRESS, ADDRESS)


class Arrays(NamedTuple):
    """Arrays that the forces of a term depend on.

    numbers : float arrays that the forces depend on, by name.
    layout : arrays that must be equal in models that differ only in the numbers: nodes, runs,
    codes.
    """

    numbers: Mapping[str, NDArray]
    layout: Mapping[str, NDArray]


class Pulled(NamedTuple):
    """Pullback of a term, and the arrays to which it adds, named like `Arrays.numbers`."""

    context: Context
    kernel: Addressed
    gradient: Mapping[str, NDArray]


def arrays_of(model: Any, *but: str) -> Arrays:
    """Arrays of a named tuple and of nested named tuples, except for fields named in `but`."""
    numbers: dict[str, NDArray] = {}
    layout: dict[str, NDArray] = {}
    for name, value in model._asdict().items():
        if name in but:
            continue
        if hasattr(value, "_asdict"):
            inner = arrays_of(value, *but)
            numbers |= {f"{name}.{key}": array for key, array in inner.numbers.items()}
            layout |= {f"{name}.{key}": array for key, array in inner.layout.items()}
        elif np.asarray(value).dtype.kind == "f":
            numbers[name] = np.asarray(value)
        else:
            layout[name] = np.asarray(value)
    return Arrays(numbers, layout)


def zeros_for(model: Any, *but: str) -> Any:
    """`model` with zeros in place of its numbers, as in `arrays_of`, to which a pullback adds."""
    numbers = arrays_of(model, *but).numbers
    return model._replace(**{name: np.zeros_like(array) for name, array in numbers.items()})


class Pullbacks(NamedTuple):
    """The pullbacks of a model as compiled loops see them."""

    context: NDArray  # (k,) addresses
    kernel: NDArray  # (k,) addresses


class Pullback:
    """Pullback of a body's forces, on one thread.

    Parameters
    ----------
    body : Assembly

    Attributes
    ----------
    terms : Pullbacks
    gradient : dict of ndarray
        Keys are the position of the term and the name of the array, such as "0.bar_stiffness".

    Raises
    ------
    InputError
        A term cannot be differentiated, such as contact or laws with memory.
    """

    def __init__(self, body: Any) -> None:
        self._rows, self._size, self._pulled = body.rows, body.size, []
        self.gradient: dict[str, NDArray] = {}
        for place, term in enumerate(body.terms):
            pulled = term.pulled()
            if pulled is None:
                raise InputError(not_differentiated(term))
            self._pulled.append(pulled)
            self.gradient |= {f"{place}.{name}": out for name, out in pulled.gradient.items()}
        self.terms = Pullbacks(
            np.array([pulled.context.address for pulled in self._pulled], np.int64),
            np.array([pulled.kernel.at(pulled.context) for pulled in self._pulled], np.int64),
        )

    def clear(self) -> None:
        """Set the gradients to zero."""
        for out in self.gradient.values():
            out[...] = 0.0

    def at(self, q: NDArray, weight: NDArray) -> NDArray:
        """Add the gradients of weight . F at q to `gradient`; returns K weight (m,)."""
        u, w = in_rows(q, self._rows), in_rows(weight, self._rows)
        still, product, rate = np.zeros((3, self._rows, 3))
        pull_all(self.terms, u, still, 0.0, w, product, rate)
        return product.ravel()[: self._size]


def arrays_of_body(body: Any) -> Arrays:
    """Arrays of all terms of a body, named as in `Pullback.gradient`."""
    numbers: dict[str, NDArray] = {}
    layout: dict[str, NDArray] = {}
    for place, term in enumerate(body.terms):
        found = term.arrays()
        if found is None:
            raise InputError(not_differentiated(term))
        numbers |= {f"{place}.{name}": array for name, array in found.numbers.items()}
        layout |= {f"{place}.{name}": array for name, array in found.layout.items()}
        layout[f"{place}"] = np.array(type(term).__name__)
    return Arrays(numbers, layout)


def not_differentiated(term: Any) -> str:
    """Message for a term without pullback."""
    return (
        f"there are no gradients through {term.undifferentiated or type(term).__name__}; leave it "
        "out of the case, or vary it by fd.sweep"
    )


def refuse_lacking(what: str, lacks: Mapping[str, bool]) -> None:
    """Refuse features without gradients, such as the modes of a case with contact."""
    for lack, here in lacks.items():
        if here:
            raise InputError(
                f"there are no gradients of {what} with {lack}; leave that out, or vary the "
                "parameters by fd.sweep"
            )


@inner_scalar
def pulled_back(terms, u, v, t, weight, product, rate):
    """Add d(weight . F)/du to `product` and d(weight . F)/dv to `rate`, both at u, v and t."""
    for k in range(terms.context.size):
        run_at(terms.kernel[k], (terms.context[k], u, v, t, weight, product, rate))


@kernel
def pull_all(terms, u, v, t, weight, product, rate):
    """`pulled_back` for calls from Python."""
    pulled_back(terms, u, v, t, weight, product, rate)
