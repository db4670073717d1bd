"""The page of a report: one self-contained HTML file."""

from __future__ import annotations

from collections.abc import Iterable
from html import escape
from os import PathLike
from pathlib import Path

from foldyn.errors import InputError
from foldyn.report.sections import Charts, Heading, Section, Table
from foldyn.viewer import Stage, scripts
from foldyn.writing import write_text

CSS = """
:root { color-scheme: light dark; --page: #fff; --text: #1a1a1a; --quiet: #444; --rule: #d8d8d8;
  --faint: #e2e2e2; --link: #0072b2; --code: #f6f6f6; }
:root.dark { color-scheme: dark; --page: #15181c; --text: #e8e8e8; --quiet: #b8bec4;
  --rule: #3a4046; --faint: #2c3238; --link: #6cbdf0; --code: #20252a; }
:root:not(.dark) { color-scheme: light; }
* { box-sizing: border-box; }
body { margin: 0 auto; padding: 1.5rem 1rem 4rem; max-width: 62rem; background: var(--page);
  color: var(--text); font: 1rem/1.55 system-ui, "Segoe UI", Roboto, Helvetica, Arial, sans-serif;
  overflow-wrap: break-word; }
h1 { font-size: 1.9rem; line-height: 1.2; margin: 0.5rem 0 1rem; }
h2 { font-size: 1.4rem; line-height: 1.25; margin: 2.5rem 0 0.75rem; padding-top: 0.75rem;
  border-top: 1px solid var(--rule); }
h3 { font-size: 1.1rem; margin: 1.75rem 0 0.5rem; }
p { max-width: 46rem; margin: 0.6rem 0; }
a { color: var(--link); }
nav ul { margin: 0; padding-left: 1.2rem; }
figure { margin: 1.25rem 0; }
img, video { display: block; max-width: 100%; height: auto; margin: 0 auto; background: #fff; }
figcaption, caption { color: var(--quiet); font-size: 0.92rem; text-align: left; }
figcaption { margin-top: 0.4rem; max-width: 46rem; }
caption { padding-bottom: 0.4rem; max-width: min(46rem, 100vw - 2rem); }
.table { overflow-x: auto; margin: 1.25rem min(0px, 50% - 50vw + 1rem) 1.25rem 0; }
.kept { margin-right: 0; }
table { border-collapse: collapse; font-size: 0.92rem; }
th, td { padding: 0.3rem 0.6rem; text-align: left; vertical-align: top; }
th:first-child, td:first-child { padding-left: 0.2rem; }
th { border-bottom: 2px solid var(--text); vertical-align: bottom; text-wrap: balance; }
th button { all: unset; cursor: pointer; }
th button:hover { text-decoration: underline; }
th button:focus-visible { outline: 3px solid #56b4e9; outline-offset: 1px; }
th[aria-sort="ascending"] button::after { content: " ▲"; }
th[aria-sort="descending"] button::after { content: " ▼"; }
td { border-bottom: 1px solid var(--faint); }
.number { text-align: right; font-variant-numeric: tabular-nums; }
td.number { white-space: nowrap; }
summary { cursor: pointer; color: var(--link); }
pre { overflow-x: auto; padding: 0.8rem 1rem; background: var(--code); font-size: 0.85rem;
  line-height: 1.4; }
td.number::after { content: attr(data-lacks); visibility: hidden; }
.stacked table, .stacked caption, .stacked thead, .stacked tbody { display: block; }
.stacked thead tr { display: flex; flex-wrap: wrap; gap: 0.3rem; font-size: 0.85rem; }
.stacked thead tr::before { content: "Sort by"; }
.stacked:not(.sorts) thead { display: none; }
.stacked th { padding: 0 0.4rem; border: 1px solid var(--rule); border-radius: 5px;
  font-weight: normal; }
.stacked tbody tr { display: block; padding: 0.4rem 0; border-bottom: 1px solid var(--rule); }
.stacked td { display: flex; justify-content: space-between; gap: 1rem; border: 0;
  padding: 0.1rem 0.2rem; text-align: right; }
.stacked td:empty, .stacked td.number::after { display: none; }
.stacked td::before { content: attr(data-title); color: var(--quiet); text-align: left; }
.plots { display: grid; gap: 0.5rem 1.5rem;
  grid-template-columns: repeat(auto-fit, minmax(min(100%, 18rem), 1fr)); }
.plots > div { min-width: 0; }
.plots h3 { margin: 0.5rem 0 0.2rem; font-size: 1rem; }
.plots p { font-size: 0.85rem; margin: 0.2rem 0; }
.plot { --ink: var(--text); --grid: var(--faint); }
.plot .keys { display: flex; flex-wrap: wrap; gap: 0.1rem 0.9rem; margin: 0; }
.plot .keys button { display: inline-flex; align-items: center; gap: 0.35rem; min-height: 1.6rem;
  padding: 0 0.15rem; font: inherit; font-size: 0.82rem; color: inherit; text-align: left;
  background: none; border: 0; cursor: pointer; }
.plot .keys button[aria-pressed="false"] { text-decoration: line-through; }
.plot .keys button[aria-pressed="false"] svg { opacity: 0.25; }
.plot .keys svg { flex: none; }
body:has(main > .foldyn) { max-width: 86rem; }
body:has(main > .foldyn) :is(figure, .plots) { max-width: 60rem; }
@media (max-width: 40rem) {
  body { padding: 1rem 0.8rem 3rem; }
  h1 { font-size: 1.5rem; }
  h2 { font-size: 1.2rem; }
  th, td { padding: 0.3rem 0.5rem; }
  .wide { overflow-x: auto; }
  .wide img { max-width: none; width: 44rem; }
}
@media print { h2 { break-after: avoid; } figure, tr { break-inside: avoid; } }
"""


def write_report(
    sections: Iterable[Section | Stage], path: str | PathLike[str], *, title: str
) -> Path:
    """Write a report as one HTML page, pictures inside.

    Parameters
    ----------
    sections : iterable of Heading, Text, Table, Listing, Picture, Charts or Stage
        Parts of the page, in order. A page with two or more headings of level 2 begins with a list
        of these headings; Stages at the very beginning stay above the list.
    path : path-like
        File to write, in an existing directory.
    title : str
        Title of the page.

    Returns
    -------
    pathlib.Path
        The file written; nothing is written if a section is wrong.

    Raises
    ------
    InputError
        A section is of another type, a picture cannot be read, or the directory does not exist.
    """
    path = Path(path)
    if not path.parent.is_dir():
        raise InputError(f"path: there is no directory {path.parent}; make it first")
    write_text(report_html(title, sections), path)
    return path


def report_html(title: str, sections: Iterable[Section | Stage]) -> str:
    """Text of the page of a report; see `write_report`."""
    sections, body, contents, stages = list(sections), [], [], 0
    for number, section in enumerate(sections):
        if isinstance(section, Heading) and section.level == 2:
            contents.append((f"part-{len(contents) + 1}", section.text))
            body.append(section.html(contents[-1][0]))
        elif isinstance(section, Stage):
            stages += 1
            body.append(section.html(f"stage-{stages}"))
        elif isinstance(section, Section):
            body.append(section.html())
        else:
            raise InputError(
                f"sections[{number}]: {type(section).__name__}; use Heading, Text, Table, Listing, "
                "Picture, Charts or Stage"
            )
    listed = ""
    if len(contents) > 1:
        items = "\n".join(f'<li><a href="#{a}">{escape(text)}</a></li>' for a, text in contents)
        listed = f'<nav aria-label="Contents"><ul>\n{items}\n</ul></nav>'
    opening = next((k for k, one in enumerate(sections) if not isinstance(one, Stage)), stages)
    content = "\n".join([*body[:opening], *([listed] if listed else []), *body[opening:]])
    css, code = CSS, ""
    if any(isinstance(section, Stage | Charts) for section in sections):
        css, code = scripts.style() + CSS, scripts.script()
    elif any(isinstance(section, Table) for section in sections):
        code = scripts.script_of_tables()
    return document(title, f"<h1>{escape(title)}</h1>\n{content}", css, code)


def document(title: str, main: str, css: str, code: str, allowed: str = "") -> str:
    """Text of an HTML page with one style and one script.

    The content security policy allows the browser to load nothing from outside the page.

    allowed : additions to the policy, such as "; connect-src 'self'".
    """
    policy = (
        f"default-src 'none'; style-src {scripts.digest(css)}; "
        f"script-src {scripts.digest(code)}; img-src data:; media-src data:{allowed}"
    )
    end = f"<script>{code}</script>\n" if code else ""
    return (
        '<!DOCTYPE html>\n<html lang="en">\n<head>\n<meta charset="utf-8">\n'
        '<meta name="viewport" content="width=device-width, initial-scale=1">\n'
        f'<meta http-equiv="Content-Security-Policy" content="{policy}">\n<style>{css}</style>\n'
        f"<title>{escape(title)}</title>\n</head>\n<body>\n<main>\n"
        f"{main}\n</main>\n{end}</body>\n</html>\n"
    )
