"""Tables from CSV files: columns, units, and the one message that a bad file gets."""

from __future__ import annotations

import numpy as np
import pytest

from foldyn.cases import Table
from foldyn.errors import InputError

PLAIN = "time [s],factor\n0,0\n0.5,1\n2,-0.25\n"


@pytest.fixture
def table(tmp_path):
    """Write a text as pulse.csv and make a table of it."""

    def read(text: str | bytes, **columns) -> Table:
        path = tmp_path / "pulse.csv"
        path.write_bytes(text.encode() if isinstance(text, str) else text)
        return Table.from_csv(path, **columns)

    return read


@pytest.mark.parametrize(
    "text",
    [
        PLAIN,
        PLAIN.replace(",", ";"),
        PLAIN.replace(",", "\t"),
        PLAIN.replace("\n", "\r\n"),
        PLAIN.replace("\n", "\r"),
        PLAIN.rstrip("\n"),
        "\ufeff" + PLAIN,
        "# made by hand\n\n" + PLAIN.replace("0.5,1", "  # a peak, here\n 0.5 , 1e0\n"),
        PLAIN.replace("time [s],factor", '"time [s]", "factor"'),
        PLAIN.replace("factor", "factor [-]"),
        PLAIN.replace("factor", "factor[1]"),
        PLAIN.replace("time [s],factor", "[s],"),
        "time [min];factor [%]\n0;0\n0.008333333333333333;100\n0.03333333333333333;-25\n",
        "time [ms],factor\n0,0\n500,1\n2000,-0.25\n",
        "time [µs],factor\n0,0\n500000,1\n2e6,-0.25\n",
    ],
)
def test_the_same_table_in_many_forms(table, text) -> None:
    assert table(text) == Table([0.0, 0.5, 2.0], [0.0, 1.0, -0.25])


def test_columns_by_name_or_heading(table) -> None:
    text = "no;force [mN];time, ch 1 [ms];time [s]\n1;5;0;0\n2;7;1;10\n"
    wanted = Table([0.0, 0.001], [0.005, 0.007])
    assert table(text, time="time, ch 1", value="force", unit="N") == wanted
    assert table(text, time="time, ch 1 [ms]", value="force [mN]", unit="N") == wanted
    assert table(text, time="time", value="no") == Table([0.0, 10.0], [1.0, 2.0])


@pytest.mark.parametrize(
    ("unit", "ratios"),
    [
        ("N", {"N": 1.0, "mN": 1e-3, "kN": 1e3}),
        ("mN", {"N": 1e3, "kN": 1e6}),
        ("m", {"mm": 1e-3}),
        ("mm", {"cm": 10.0}),
        ("m/s2", {"mm/s2": 1e-3, "m/s^2": 1.0}),
        ("m/s²", {"m/s²": 1.0}),
        ("-", {"%": 1e-2}),
        ("%", {"%": 1.0, "-": 100.0}),
    ],
)
def test_units_are_converted(table, unit, ratios) -> None:
    for own, ratio in ratios.items():
        found = table(f"time [s],value [{own}]\n0,1\n1,3\n", unit=unit)
        np.testing.assert_allclose(found.values, [ratio, 3 * ratio], rtol=1e-15)


def test_conversion_rounds_once(table) -> None:
    times = np.arange(1, 1000)
    rows = "\n".join(f"{t},{t}" for t in times)
    found = table(f"time [ms],force [mN]\n{rows}\n", unit="N")
    exact = np.array([float(f"{t}e-3") for t in times])
    np.testing.assert_array_equal(found.times, exact)
    np.testing.assert_array_equal(found.values, exact)


FORCE = 'column "F [mN]": is a force, but a history is a factor without unit;'
CELL = 'line 3, column "t [s]": '
BAD = [
    ("", "holds only empty lines and comments"),
    ("# time [s],factor\n", "holds only empty lines"),
    ("0,0\n1,1\n", "line 1: holds numbers, no names; begin with a line that names"),
    ("# time [s],f\n0,0\n1,1\n", "line 2: holds numbers, no names"),
    ("time [s]  force\n0 0\n1 1\n", 'line 1: "time [s]  force" is one column'),
    ("time,f\n0,0\n1,1\n", 'column "time": has no unit, and a time in s is asked for; write'),
    ("time [],f\n0,0\n1,1\n", 'column "time []": has no unit, and a time in s'),
    ("time [h],f\n0,0\n1,1\n", 'column "time [h]": the unit [h] is not known; use one of s, ms,'),
    ("F [N],t [s]\n0,0\n1,1\n", 'column "F [N]": is a force, and a time in s is asked for'),
    ("t [s],F [mN]\n0,0\n1,1\n", f'{FORCE} give unit = "mN"'),
    ("t [s],F [lbf]\n0,0\n1,1\n", 'column "F [lbf]": the unit [lbf] is not known; use one of -,'),
    ("t [s],f\n0,0\n\n1,one\n", 'line 4, column "f": "one" is not a number'),
    ("t [s];f\n0;0\n0,5;1\n", f'{CELL}"0,5" is not a number (decimals are written with a point)'),
    ("t [s],f\n0,0\n1_0,1\n", f'{CELL}"1_0" is not a number'),
    ("t [s],f\n0,0\n1,\n", 'line 3, column "f": is empty'),
    ("# x\nt [s],f\n0,0\n1,NaN\n", 'line 4, column "f": "NaN" is not a finite number'),
    ("t [s],f\n0,0\ninf,1\n", f'{CELL}"inf" is not a finite'),
    ("t [min],f\n0,0\n1e308,1\n", 'line 3, column "t [min]": "1e308" is not a fin'),
    ("t [ms],f\n0,0\n\n5,1\n5,2\n", "line 5: the time 0.005 s does not come after"),
    ("t [s],f\n0,0\n2,1\n1,2\n", "line 4: the time 1 s does not come after"),
    ("t [s],f\n0,0\n", "too few lines of numbers (1); a table needs at least two"),
    ("t [s],f\n", "too few lines of numbers (0)"),
    ("t [s],f\n0,0\n1,1,1\n", "line 3: has 3 cells, the header has 2 (cells end at every comma)"),
    ("t [s]\tf\n0\t0\n1\n", "line 3: has 1 cells, the header has 2 (cells end at ev"),
    (b"t [\xb5s],f\n0,0\n1,1\n", "is not a text file in UTF-8"),
    (f"t [s],f\n0,0\n1,{9999 * '-'}\n", f'line 3, column "f": "{56 * "-"} ...'),
    (f"t [s{9999 * 's'}],f\n0,0\n1,2\n", f'column "t [{20 * "s"}'),
    ("t [s],f\n0,0\n1," + 200_000 * "1", "line 3: cannot be read: field larger"),
]


@pytest.mark.parametrize("text", [pair[0] for pair in BAD], ids=range(len(BAD)))
def test_a_bad_file_gets_one_message(table, tmp_path, text) -> None:
    with pytest.raises(InputError) as caught:
        table(text)
    assert str(caught.value).startswith(f"{tmp_path / 'pulse.csv'}: {dict(BAD)[text]}")
    assert len(str(caught.value)) < 600


@pytest.mark.parametrize(
    ("columns", "message"),
    [
        ({"time": "zeit"}, '"zeit": no such column; there are "time [s]", "force [N]", "no"'),
        ({"value": "forse"}, "value = \"forse\": no such column; did you mean 'force'? the"),
        ({"value": "time"}, 'time and value: are both the column "time [s]"'),
        ({"time": "force [N]"}, 'time and value: are both the column "force [N]"'),
        ({"value": "no", "unit": "N"}, 'column "no": has no unit, and a force in N is asked for'),
        ({"unit": "m"}, 'column "force [N]": is a force, and a length in m is asked for'),
        ({"unit": "m/s2"}, 'column "force [N]": is a force, and an acceleration in m/s2 is asked'),
        ({"unit": "s"}, 'unit = "s": is not known; choose one of -, 1, %, N, mN, kN'),
        ({"unit": None}, "unit = None: is not known"),
        ({"time": 0}, "time = 0: must be the heading of a column"),
    ],
)
def test_columns_and_units_that_do_not_fit(table, columns, message) -> None:
    with pytest.raises(InputError) as caught:
        table("time [s],force [N],no\n0,0,1\n1,1,2\n", **columns)
    assert message in str(caught.value)


def test_a_name_of_two_columns_is_refused(table) -> None:
    text = "t [s],F [N],F [mN]\n0,0,0\n1,1,1\n"
    with pytest.raises(InputError, match=r'value = "F": names 2 of the columns "t \[s\]", "F '):
        table(text, value="F", unit="N")
    assert table(text, value="F [mN]", unit="N").values[1] == 1e-3


def test_files_that_cannot_be_read(tmp_path) -> None:
    with pytest.raises(InputError, match=r"none\.csv: there is no such file"):
        Table.from_csv(tmp_path / "none.csv")
    with pytest.raises(InputError, match="is a folder; give a CSV file"):
        Table.from_csv(tmp_path)
    with pytest.raises(InputError, match="path = 3: give the path of a file"):
        Table.from_csv(3)  # type: ignore
    with pytest.raises(InputError, match="cannot be read"):
        Table.from_csv("a\0b.csv")
