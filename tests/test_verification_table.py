"""Every row of the verification table, and its page."""

from __future__ import annotations

import numpy as np
import pytest

from verification.table import BEGIN, BENCHMARKS, END, PAGE, key, read, with_table


@pytest.mark.matrix
@pytest.mark.parametrize("row", BENCHMARKS, ids=key)
def test_a_benchmark_is_as_close_as_it_says(row):
    ours = row.ours()
    assert abs(row.difference(ours)) <= row.error
    np.testing.assert_allclose(ours, read()[key(row)], rtol=1e-3)


def test_the_page_has_the_rows_and_the_stored_numbers():
    page = PAGE.read_text("utf-8")
    assert with_table(page, read()) == page
    table = page.split(BEGIN)[1].split(END)[0]
    assert table.count("\n| ") == len(BENCHMARKS) + 1 >= 17


def test_rows_are_told_apart_and_large_differences_explained():
    stored = read()
    assert sorted(stored) == sorted({key(row) for row in BENCHMARKS})
    for row in BENCHMARKS:
        ours = stored[key(row)]
        assert len(ours) == len(row.reference)
        assert abs(row.difference(ours)) <= row.error
        assert row.why or abs(row.difference(ours)) < 0.03
