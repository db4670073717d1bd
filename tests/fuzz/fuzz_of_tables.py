"""Fuzzer of tables in CSV files."""

from __future__ import annotations

from pathlib import Path

from fuzz_target import Target

from foldyn.cases import Table
from foldyn.cases.csv_table import read_headings, read_numbers
from foldyn.errors import InputError

WORDS = ("time", "t", "[s]", "[ms]", "[min]", "[N]", "[kN]", "[m/s2]", "[%]", "[]", "# note", ";")


def seeds(_: Path) -> list[bytes]:
    """Tables with commas, with semicolons and with gaps."""
    rows = "\n".join(f"{5 * i},{0.1 * i},{i * i}" for i in range(12))
    return [
        f"time [ms],force [N],other [mm]\n{rows}\n".encode(),
        f"# measured\r\nt [s];factor;x [m]\r\n{rows}".replace(",", ";").encode("utf-8-sig"),
        b't [min]\t"f\t[-]"\n0\t1e-3\n1\t2\n2.5\t3\n',
    ]


def read(file: Path) -> None:
    """As a history, and as a measurement with gaps."""
    try:
        Table.from_csv(file, unit="N")
    except InputError:
        Table.from_csv(file)
    names = [name for name, _ in read_headings(file)]
    read_numbers(file, {"time": (names[0], "s")}, gaps=("time",))


TARGET = Target("csv", seeds, read, ".csv", WORDS)
