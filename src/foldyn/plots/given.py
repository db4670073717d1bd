"""Arguments of figures: results alone or by label, and a case or an object that has one."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from functools import wraps
from inspect import signature
from typing import Any, Concatenate, ParamSpec, Protocol, TypeVar, overload

import xarray as xr

from foldyn.cases import Case
from foldyn.errors import InputError
from foldyn.structures import Structure
from foldyn.values import show

P = ParamSpec("P")
R = TypeVar("R", covariant=True)


def by_label(field: str, results: xr.Dataset | Mapping[str, xr.Dataset]) -> dict[str, xr.Dataset]:
    """Results by label; a single result has the label ""."""
    if isinstance(results, xr.Dataset):
        return {"": results}
    if not isinstance(results, Mapping) or not results:
        raise InputError(
            ": give a result, or a mapping of label to result, as {'specimen': result}", field
        )
    return {label: alone(f"{field}[{label!r}]", one) for label, one in results.items()}


def alone(field: str, result: Any) -> xr.Dataset:
    """Return a result; refuse anything else."""
    if not isinstance(result, xr.Dataset):
        raise InputError(f" = {show(result)}: give a result, as fd.load returns it", field)
    return result


class OfResult(Protocol[P, R]):
    """A figure of a result, whose case may be omitted."""

    @overload
    def __call__(
        self, case_or_structure: Case | Structure, result: xr.Dataset, /,
        *args: P.args, **kwargs: P.kwargs,
    ) -> R: ...  # fmt: skip

    @overload
    def __call__(self, result: xr.Dataset, /, *args: P.args, **kwargs: P.kwargs) -> R: ...


def case_from_result(
    draw: Callable[Concatenate[Case | Structure, xr.Dataset, P], R],
) -> OfResult[P, R]:
    """Make a figure take the case from its result if no case is given."""
    case, result, *others = signature(draw).parameters

    @wraps(draw)
    def drawn(*given: Any, **named: Any) -> Any:
        first = given[0] if given else named.get(result)
        if isinstance(first, xr.Dataset) and case not in named:
            named |= zip(others, given[1:], strict=False)  # positional arguments move up by one
            given = (first, first) if given else (first,)
        return draw(*given, **named)

    return drawn
