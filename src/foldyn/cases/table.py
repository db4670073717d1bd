"""A history from a table of values, straight or smooth between them."""

from __future__ import annotations

import os
from dataclasses import dataclass
from typing import Any, ClassVar

import numpy as np
from numpy.typing import NDArray
from scipy.interpolate import CubicSpline

from foldyn.cases import waveforms
from foldyn.cases.csv_table import read_columns
from foldyn.cases.history import Formula, check_flag, set_field
from foldyn.errors import InputError
from foldyn.values import SMALLEST, numbers, show

SHARP = 0.01  # of the range of a table: how far a sharp corner leads away from a straight line


@dataclass(frozen=True, eq=False)
class Table(Formula):
    """Factors given at times, linear between them, the first and the last held outside.

    Parameters
    ----------
    times : array_like, shape (n,)
        Times (s), strictly increasing, n >= 2.
    values : array_like, shape (n,)
        Factors at these times.
    smooth : bool
        A cubic spline through the values instead of straight lines: for measured displacements
        that a support follows, whose velocity must not jump at every value.
    """

    times: Any
    values: Any
    smooth: bool = False
    kind: ClassVar[str] = "table"
    code: ClassVar[int] = waveforms.TABLE

    def __post_init__(self) -> None:
        """Check the arguments."""
        times, values = numbers("times", self.times), numbers("values", self.values)
        if times.ndim != 1 or times.size < 2:
            raise InputError(f"times = {show(self.times)}: must be a list of at least two numbers")
        if values.shape != times.shape:
            raise InputError(
                f"values = {show(self.values)}: must be a list of as many numbers as times "
                f"({times.size})"
            )
        back = np.flatnonzero(np.diff(times) < SMALLEST)
        if back.size:
            i = int(back[0]) + 1
            raise InputError(
                f"times[{i}] = {times[i]}: must be greater than the time before it ({times[i - 1]})"
            )
        check_flag("smooth", self.smooth)
        set_field(self, "times", times)
        set_field(self, "values", values)

    @classmethod
    def from_csv(
        cls,
        path: str | os.PathLike[str],
        time: str | None = None,
        value: str | None = None,
        unit: str = "-",
        smooth: bool = False,
    ) -> Table:
        """Table from two columns of a CSV file, whose units are checked and converted.

        The file is a text in UTF-8: a line with the names of the columns and their units in
        brackets, as in ``time [ms],force [mN]``, then lines of numbers. Cells are separated by
        tabs, semicolons or commas, whichever of these the header has first in this order. Empty
        lines and lines that begin with # are skipped.

        Parameters
        ----------
        path : path
            The file.
        time, value : str, optional
            Headings of the two columns, with or without the unit; the first and the second column
            by default. The unit of the time is s, ms, us or min.
        unit : str
            What the values become. The default "-" is a factor without unit, from a column with
            [-], [1], [%] or no unit. With "N", "mN" or "kN" the column must be a force in one of
            these and is converted: the load's vector is then a direction, (1, 0, 0) for a force
            along x. Likewise "m", "cm", "mm" and "m/s2", "mm/s2".
        smooth : bool
            As for the class.

        Raises
        ------
        InputError
            The file cannot be read, a column is missing or ambiguous, a unit is missing, unknown
            or of another quantity, a cell is not a finite number, times do not increase, or there
            are fewer than two lines of numbers. The message names the file and the line.
        """
        return cls(*read_columns(path, time, value, unit), smooth)

    def polynomials(self) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        """See `History.polynomials`."""
        cubics = np.zeros((len(self.times), 4))
        if self.smooth:
            cubics[:-1] = CubicSpline(self.times, self.values).c.T
        else:
            cubics[:-1, 2] = np.diff(self.values) / np.diff(self.times)
        cubics[:, 3] = self.values
        return self.times, cubics

    def knots(self) -> tuple[float, ...]:
        """See `History.knots`: both ends, and sharp corners; those of a curve's points are not."""
        sharp = np.ones(len(self.times), bool)
        sharp[1:-1] = False
        if not self.smooth:
            steps = np.diff(self.times)
            turn = np.abs(np.diff(np.diff(self.values) / steps))
            sharp[1:-1] = turn * np.minimum(steps[1:], steps[:-1]) > SHARP * np.ptp(self.values)
        return tuple(self.times[sharp].tolist())

    def __eq__(self, other: object) -> bool:
        """Tell whether the other is a table of the same numbers."""
        if not isinstance(other, Table):
            return NotImplemented
        return (
            self.smooth == other.smooth
            and np.array_equal(self.times, other.times)
            and np.array_equal(self.values, other.values)
        )

    def __hash__(self) -> int:
        """Hash of the numbers."""
        return hash((self.times.tobytes(), self.values.tobytes(), self.smooth))
