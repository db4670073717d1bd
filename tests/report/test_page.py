"""The report page holds everything it shows."""

from __future__ import annotations

import base64
import re
import struct
from html.parser import HTMLParser
from io import BytesIO

import numpy as np
import pytest
from matplotlib.figure import Figure
from PIL import Image

from foldyn.errors import InputError
from foldyn.report import Heading, Picture, Table, Text, write_report
from foldyn.report.sections import rounded

_VOID = {"meta", "img", "br", "link"}


class _Page(HTMLParser):
    """Checks nesting and collects what the page holds."""

    def __init__(self, text):
        super().__init__()
        self.open, self.rows, self.texts, self.tags = [], [], {}, []
        self.feed(text)
        self.close()
        assert self.open == []
        self.images = [attrs for tag, attrs in self.tags if tag == "img"]
        self.links = [attrs["href"] for tag, attrs in self.tags if tag == "a"]
        self.anchors = [attrs["id"] for _, attrs in self.tags if "id" in attrs]

    def handle_starttag(self, tag, attrs):
        self.tags.append((tag, dict(attrs)))
        if tag not in _VOID:
            self.open.append(tag)
        if tag == "tr":
            self.rows.append([])
        if tag in ("td", "th"):
            self.rows[-1].append("")

    def handle_endtag(self, tag):
        assert self.open.pop() == tag

    def handle_data(self, data):
        if self.open and self.open[-1] in ("td", "th"):
            self.rows[-1][-1] += data
        elif self.open:
            self.texts.setdefault(self.open[-1], []).append(data)


def _png(width=2, height=2):
    file = BytesIO()
    Image.new("L", (width, height), 64).save(file, "PNG")
    return file.getvalue()


def _gif(width=2, height=2):
    buffer = BytesIO()
    Image.new("P", (width, height)).save(buffer, "GIF")
    return buffer.getvalue()


def _write(tmp_path, *sections, title="Report"):
    path = write_report(sections, tmp_path / "report.html", title=title)
    return _Page(path.read_text(encoding="utf-8"))


def test_pictures_are_inside_and_unchanged(tmp_path):
    png, gif = _png(), _gif()
    (tmp_path / "a.png").write_bytes(png)
    sheet = Picture(tmp_path / "a.png", caption="A sheet", alt="gray square")
    page = _write(tmp_path, sheet, Picture(gif, caption="It moves"))
    first, second = page.images
    assert first["src"] == "data:image/png;base64," + base64.b64encode(png).decode()
    assert first["alt"] == "gray square"
    assert second["src"].startswith("data:image/gif;base64,")
    assert base64.b64decode(second["src"].split(",")[1]) == gif
    assert second["alt"] == "It moves"
    assert page.texts["figcaption"] == ["A sheet", "It moves"]


def test_films_are_inside_and_play(tmp_path):
    mp4 = struct.pack(">I", 24) + b"ftypisom" + bytes(20)
    page = _write(tmp_path, Picture(mp4, caption="It moves & turns"))
    assert page.images == []
    (film,) = [attrs for tag, attrs in page.tags if tag == "video"]
    assert film["src"] == "data:video/mp4;base64," + base64.b64encode(mp4).decode()
    assert film["aria-label"] == "It moves & turns"
    # browsers play by themselves only what is muted, phones only what may stay in the page
    assert {"controls", "loop", "autoplay", "muted", "playsinline"} <= set(film)
    assert page.texts["figcaption"] == ["It moves & turns"]


def test_wide_pictures_are_scrolled_on_a_phone(tmp_path):
    pictures = _png(1350, 3), _png(900, 3), _gif(300, 200)
    page = _write(tmp_path, *map(Picture, pictures))
    frames = [attrs.get("class") for tag, attrs in page.tags if tag == "div"]
    assert frames == ["wide", None, None]
    sizes = [(image["width"], image["height"]) for image in page.images]
    assert sizes == [("1350", "3"), ("900", "3"), ("300", "200")]


def test_figures_are_drawn_as_png(tmp_path):
    page = _write(tmp_path, Picture(Figure(figsize=(2, 1), dpi=50)))
    data = base64.b64decode(page.images[0]["src"].split(",")[1])
    assert struct.unpack(">II", data[16:24]) == (100, 50)


def test_page_refers_to_nothing_outside(tmp_path):
    path = write_report(
        [Heading("A"), Heading("B"), Picture(_png())], tmp_path / "r.html", title="R"
    )
    text = path.read_text(encoding="utf-8")
    page = _Page(text)
    assert all(link.startswith("#") for link in page.links)
    assert all(image["src"].startswith("data:") for image in page.images)
    assert {tag for tag, _ in page.tags}.isdisjoint({"script", "link", "iframe"})
    assert "url(" not in text and "@import" not in text
    assert ("meta", {"charset": "utf-8"}) in page.tags
    assert any(attrs.get("name") == "viewport" for tag, attrs in page.tags if tag == "meta")


def test_table_cells(tmp_path):
    header = ["rule", "error (-)", "steps", "holds"]
    rows = [
        ["centroid", 0.062034567, 1000, True],
        ["panel", np.float64(1.25), np.int64(7), np.bool_(False)],
        ["none", None, None, None],
    ]
    page = _write(tmp_path, Table(header, rows, caption="Errors", digits=3))
    assert page.rows == [
        header,
        ["centroid", "0.062", "1000", "yes"],
        ["panel", "1.25", "7", "no"],
        ["none", "", "", ""],
    ]
    aligned = [attrs.get("class") for tag, attrs in page.tags if tag == "th"]
    assert aligned == [None, "number", "number", None]
    assert page.texts["caption"] == ["Errors"]


COLUMNS = Table(["a", "b"], [[0.25, 71300.0], [12.0, 4.5e-7], [1.125, None]], digits=4)


def test_a_column_of_numbers_holds_nothing_but_the_numbers():
    """What puts their points below each other is no text: copies and parsers do not find it."""
    cells = re.findall(r'<td class="number"([^>]*)>(.*?)</td>', COLUMNS.html())
    assert [text for _, text in cells] == ["0.25", "71300", "12", "4.5e-07", "1.125", ""]
    assert [attribute for attribute, _ in cells][::2] == [
        ' data-lacks="5"', ' data-lacks=".125"', ""
    ]  # fmt: skip


@pytest.mark.matrix
def test_points_of_a_column_stand_below_each_other(tmp_path, browser):
    write_report([COLUMNS], tmp_path / "page.html", title="Numbers")
    tab = browser.new_page()
    tab.goto((tmp_path / "page.html").as_uri())
    copied = tab.evaluate(
        "getSelection().selectAllChildren(document.querySelector('tbody')) || `${getSelection()}`"
    )
    assert [line.split() for line in copied.splitlines()] == [
        ["0.25", "71300"], ["12", "4.5e-07"], ["1.125"],
    ]  # fmt: skip
    ends = tab.evaluate(
        """[...document.querySelectorAll("td:first-child")].map((cell) => {
          const text = cell.firstChild, range = document.createRange();
          range.setStart(text, 0);
          range.setEnd(text, (text.data + ".").indexOf("."));
          return range.getBoundingClientRect().right; })"""
    )
    tab.close()
    assert np.ptp(ends) < 0.02  # pixels


@pytest.mark.parametrize(
    ("value", "text"),
    [
        (71300.4, "71300"),
        (999999.0, "1000000"),
        (-0.000123456, "-0.000123"),
        (1e-9, "1e-09"),
        (2.5e7, "2.5e+07"),
    ],
)
def test_exponents_are_for_numbers_far_from_one(value, text):
    assert rounded(value, 3) == text


def test_everything_is_escaped(tmp_path):
    bad = '<script>alert("x")</script> & more'
    table, picture = Table([bad], [[bad]], caption=bad), Picture(_png(), caption=bad)
    page = _write(tmp_path, Heading(bad), Text(bad), table, picture, title=bad)
    assert [tag for tag, _ in page.tags].count("script") == 1  # that of tables
    assert page.rows == [[bad], [bad]]
    assert page.images[0]["alt"] == bad
    for tag in ("title", "h1", "h2", "p", "caption", "figcaption"):
        assert "".join(page.texts[tag]).strip() == bad


def test_contents_link_to_the_parts(tmp_path):
    page = _write(tmp_path, Heading("One"), Heading("inside", level=3), Heading("Two"))
    assert page.links == ["#part-1", "#part-2"]
    assert page.anchors == ["part-1", "part-2"]
    alone = _write(tmp_path, Heading("One"))
    assert alone.links == []


def test_empty_lines_part_paragraphs(tmp_path):
    page = _write(tmp_path, Text("one\nline\n\n two \n \n\nthree"))
    assert [text for text in page.texts["p"] if text.strip()] == ["one\nline", "two", "three"]


@pytest.mark.parametrize(
    ("section", "words"),
    [
        (Picture("missing.png"), "no picture missing.png"),
        (Picture(b"not a picture"), "PNG, GIF, JPEG or MP4"),
        (Picture(3), "path, bytes or a matplotlib Figure"),
        ("just text", r"sections\[0\]: str"),
    ],
)
def test_wrong_sections_write_nothing(tmp_path, section, words):
    with pytest.raises(InputError, match=words):
        write_report([section], tmp_path / "r.html", title="R")
    assert list(tmp_path.iterdir()) == []


def test_wrong_arguments(tmp_path):
    with pytest.raises(InputError, match="no directory"):
        write_report([], tmp_path / "missing" / "r.html", title="R")
    with pytest.raises(InputError, match="level"):
        Heading("x", level=1)
    with pytest.raises(InputError, match=r"rows\[1\]: 1 cells under 2"):
        Table(["a", "b"], [[1, 2], [3]])
