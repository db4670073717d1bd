"""Columns of a CSV file with their units, such as times and values of a table."""

from __future__ import annotations

import csv
import os
import re
from collections.abc import Collection, Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from fractions import Fraction
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from foldyn.errors import InputError, within
from foldyn.input_files import path_of, read_text
from foldyn.values import parsed, shortened, show, suggest

UNITS: Mapping[str, Mapping[str, Fraction]] = {
    "time": {
        "s": Fraction(1),
        "ms": Fraction(1, 10**3),
        "us": Fraction(1, 10**6),
        "min": Fraction(60),
    },
    "number without unit": {"-": Fraction(1), "1": Fraction(1), "%": Fraction(1, 100)},
    "force": {"N": Fraction(1), "mN": Fraction(1, 10**3), "kN": Fraction(10**3)},
    "length": {"m": Fraction(1), "cm": Fraction(1, 100), "mm": Fraction(1, 10**3)},
    "acceleration": {"m/s2": Fraction(1), "mm/s2": Fraction(1, 10**3)},
    "frequency": {"Hz": Fraction(1), "kHz": Fraction(10**3)},
    "receptance": {"m/N": Fraction(1), "mm/N": Fraction(1, 10**3)},
    "mobility": {"m/(N s)": Fraction(1), "mm/(N s)": Fraction(1, 10**3)},
    "accelerance": {"m/(N s2)": Fraction(1), "mm/(N s2)": Fraction(1, 10**3)},
}
"""Units by quantity; the value of each unit in the SI unit."""

_NUMBER = "number without unit"
_SPELLINGS = {
    **{"µs": "us", "μs": "us", "m/s^2": "m/s2", "m/s²": "m/s2", "mm/s^2": "mm/s2"},
    **{"m/s/N": "m/(N s)", "m/s2/N": "m/(N s2)", "m/s^2/N": "m/(N s2)", "m/s²/N": "m/(N s2)"},
}
_DELIMITERS = {"\t": "tab", ";": "semicolon", ",": "comma"}  # in order of precedence
MOST = 64
"""Size of a file (MiB)."""
_MANY = 10  # names listed in a message
_HEADER = 'begin with a line that names the columns, as in "time [s],force [N]"'


@dataclass(frozen=True)
class _Column:
    """A column: its place in a line, its heading as written, and the heading's name and unit."""

    place: int
    heading: str
    name: str
    unit: str | None

    @property
    def shown(self) -> str:
        """The heading, shortened for messages."""
        return shortened(self.heading)


def read_columns(
    path: str | os.PathLike[str], time: str | None, value: str | None, unit: str
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Times (s) and values (in `unit`) of a CSV file; see `Table.from_csv`."""
    for name, given in (("time", time), ("value", value)):
        if given is not None and not isinstance(given, str):
            raise InputError(
                f"{name} = {show(given)}: must be the heading of a column, or its name"
            )
    wanted = _SPELLINGS.get(unit, unit) if isinstance(unit, str) else ""
    if _quantity(wanted) in (None, "time"):
        known = ", ".join(one for what, units in UNITS.items() if what != "time" for one in units)
        raise InputError(f"unit = {show(unit)}: is not known; choose one of {known}")
    with _opened(path_of(path)) as (columns, lines):
        chosen = _find("time", time, columns, 0), _find("value", value, columns, 1)
        if chosen[0] == chosen[1]:
            raise InputError(f'time and value: are both the column "{chosen[0].shown}"; name two')
        ratios = _ratio(chosen[0], "s"), _ratio(chosen[1], wanted)
        rows = [
            [_number(number, cells, item, r) for item, r in zip(chosen, ratios, strict=True)]
            for number, cells in lines
        ]
        if len(rows) < 2:
            raise InputError(f"too few lines of numbers ({len(rows)}); a table needs at least two")
        times, values = np.array(rows, dtype=np.float64).T
        back = np.flatnonzero(np.diff(times) <= 0.0)
        if back.size:
            i = int(back[0]) + 1
            raise InputError(
                f"line {lines[i][0]}: the time {times[i]:.9g} s does not come after the time "
                f"before it ({times[i - 1]:.9g} s); times must increase"
            )
        return times, values


@contextmanager
def _opened(file: Path) -> Iterator[tuple[list[_Column], list[tuple[int, list[str]]]]]:
    """Columns and lines of a file, as from `_lines`; messages name the file."""
    text = read_text(file, "a CSV file in UTF-8", MOST, "take fewer lines or columns")
    with within("", file):
        yield _lines(text)


def read_numbers(
    path: str | os.PathLike[str], wanted: Mapping[str, tuple[str, str]], gaps: Collection[str] = ()
) -> dict[str, NDArray[np.float64]]:
    """Numbers from several columns of a CSV file, of any quantities; lines may have any order.

    Parameters
    ----------
    path : path
        A file in the format of `Table.from_csv`.
    wanted : mapping of str to (str, str)
        For each field: the heading of its column, with or without the unit, and the unit to convert
        to. Messages and the result use the names of the fields.
    gaps : collection of str
        Fields whose cells may be empty.

    Returns
    -------
    dict of str to ndarray, shape (lines,)
        NaN where a cell is empty.

    Raises
    ------
    InputError
        As in `Table.from_csv`, except for the order of the lines.
    """
    with _opened(path_of(path)) as (columns, rows):
        chosen = [_find(field, heading, columns, 0) for field, (heading, _) in wanted.items()]
        units = [unit for _, unit in wanted.values()]
        ratios = [_ratio(item, unit) for item, unit in zip(chosen, units, strict=True)]
        empty = [field in gaps for field in wanted]
        values = np.array([[_number(n, row, c, r, gap)
                            for c, r, gap in zip(chosen, ratios, empty, strict=True)]
                           for n, row in rows])  # fmt: skip
        if not len(values):
            raise InputError("holds no lines of numbers below the names of the columns")
    return dict(zip(wanted, values.T, strict=True))


def read_headings(path: str | os.PathLike[str]) -> list[tuple[str, str | None]]:
    """Names and units of the columns of a CSV file; None where a column has no unit."""
    with _opened(path_of(path)) as (columns, _):
        return [(column.name, column.unit) for column in columns]


def some(names: Sequence[str]) -> str:
    """Names for a message; only the first names if there are many."""
    if len(names) <= _MANY:
        return ", ".join(names)
    return f"{', '.join(names[: _MANY - 2])}, ... ({len(names)} in all)"


def _lines(text: str) -> tuple[list[_Column], list[tuple[int, list[str]]]]:
    """Columns of a table, and its lines below the header: number in the file, and cells."""
    lines = [
        (number, line)
        for number, line in enumerate(re.split(r"\r\n|\r|\n", text), 1)
        if line.strip() and not line.lstrip().startswith("#")
    ]
    if not lines:
        raise InputError(f"holds only empty lines and comments; {_HEADER}")
    number, first = lines[0]
    delimiter = next((mark for mark in _DELIMITERS if mark in first), ",")
    columns = _headings(number, _cells(number, first, delimiter))
    rows = []
    for number, line in lines[1:]:
        cells = _cells(number, line, delimiter)
        if len(cells) != len(columns):
            raise InputError(
                f"line {number}: has {len(cells)} cells, the header has {len(columns)} (cells "
                f"end at every {_DELIMITERS[delimiter]})"
            )
        rows.append((number, cells))
    return columns, rows


def _cells(number: int, line: str, delimiter: str) -> list[str]:
    try:
        (cells,) = csv.reader([line], delimiter=delimiter, skipinitialspace=True)
    except csv.Error as error:
        raise InputError(f"line {number}: cannot be read: {error}") from None
    return [cell.strip() for cell in cells]


def _headings(number: int, cells: Sequence[str]) -> list[_Column]:
    if all(_is_number(cell) for cell in cells):
        raise InputError(f"line {number}: holds numbers, no names; {_HEADER} (without # before it)")
    if len(cells) < 2:
        raise InputError(
            f'line {number}: "{shortened(cells[0])}" is one column, a table needs two; {_HEADER} '
            "(comma, semicolon or tab between them)"
        )
    columns = []
    for place, cell in enumerate(cells):
        brackets = re.search(r"\[([^][]*)\]$", cell)
        name = cell[: brackets.start()].strip() if brackets else cell
        unit = brackets.group(1).strip() if brackets else ""
        columns.append(_Column(place, cell, name, _SPELLINGS.get(unit, unit) or None))
    return columns


def _find(field: str, wanted: str | None, columns: Sequence[_Column], default: int) -> _Column:
    if wanted is None:
        return columns[default]
    fits = [column for column in columns if wanted.strip() in (column.heading, column.name)]
    if len(fits) == 1:
        return fits[0]
    listed, asked = some([f'"{column.shown}"' for column in columns]), shortened(wanted)
    if fits:
        raise InputError(f'{field} = "{asked}": names {len(fits)} of the columns {listed}')
    hint = suggest(wanted, [known for column in columns for known in (column.name, column.heading)])
    raise InputError(f'{field} = "{asked}": no such column; {hint}there are {listed}')


def _quantity(unit: str) -> str | None:
    return next((quantity for quantity, units in UNITS.items() if unit in units), None)


def _ratio(column: _Column, wanted: str) -> Fraction:
    """Factor from the column's unit to the wanted unit."""
    quantity = _quantity(wanted) or _NUMBER
    listed = ", ".join(UNITS[quantity])
    place = f'column "{column.shown}"'
    if column.unit is None and quantity != _NUMBER:
        raise InputError(
            f"{place}: has no unit, and {_article(quantity)} in {wanted} is asked for; write the "
            f'unit in the header, as in "{shortened(column.name) or quantity} [{wanted}]"'
        )
    unit = column.unit or "-"
    own = _quantity(unit)
    if own is None:
        raise InputError(f"{place}: the unit [{shortened(unit)}] is not known; use one of {listed}")
    if own != quantity and quantity == _NUMBER:
        raise InputError(
            f"{place}: is {_article(own)}, but a history is a factor without unit; give "
            f'unit = "{unit}" to take the numbers in {unit}, and give the load as a direction of '
            "length 1"
        )
    if own != quantity:
        raise InputError(
            f"{place}: is {_article(own)}, and {_article(quantity)} in {wanted} is asked for "
            f"({listed})"
        )
    return UNITS[own][unit] / UNITS[quantity][wanted]


def _article(quantity: str) -> str:
    return f"an {quantity}" if quantity[0] in "aeiou" else f"a {quantity}"


def _is_number(cell: str) -> bool:
    try:
        parsed(cell)
    except ValueError:
        return False
    return True


def _number(
    number: int, cells: Sequence[str], column: _Column, ratio: Fraction, gap: bool = False
) -> float:
    """Number in a cell; NaN if it is empty and gaps are allowed."""
    cell = cells[column.place]
    place = f'line {number}, column "{column.shown}"'
    remedy = "; leave the cell empty where a node was lost" if gap else ""
    if not cell and gap:
        return np.nan
    if not cell:
        raise InputError(f"{place}: is empty; every line needs a number there")
    if not _is_number(cell):
        hint = " (decimals are written with a point)" if "," in cell else ""
        raise InputError(f'{place}: "{shortened(cell)}" is not a number{hint}{remedy}')
    # an exact ratio of integers, so that 5 ms becomes the double nearest to 0.005 s
    value = float(cell) * ratio.numerator / ratio.denominator
    if not np.isfinite(value):
        raise InputError(f'{place}: "{shortened(cell)}" is not a finite number{remedy}')
    return value
