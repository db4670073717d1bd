"""The page of a report: one HTML file that needs no other."""

from __future__ import annotations

from collections.abc import Iterable
from html import escape
from os import PathLike
from pathlib import Path

from foldyn.errors import InputError
from foldyn.report.sections import Heading, Section
from foldyn.viewer import Stage, scripts
from foldyn.writing import write_text

_CSS = """
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
table { border-collapse: collapse; font-size: 0.92rem; }
th, td { padding: 0.3rem 0.6rem; text-align: left; vertical-align: top; }
th:first-child, td:first-child { padding-left: 0.2rem; }
th { border-bottom: 2px solid var(--text); vertical-align: bottom; text-wrap: balance; }
td { border-bottom: 1px solid var(--faint); }
.number { text-align: right; font-variant-numeric: tabular-nums; }
td.number { white-space: nowrap; }
summary { cursor: pointer; color: var(--link); }
pre { overflow-x: auto; padding: 0.8rem 1rem; background: var(--code); font-size: 0.85rem;
  line-height: 1.4; }
.unseen { visibility: hidden; user-select: none; }
.foldyn { width: min(84rem, 100vw - 2rem); margin-left: max(50% - 42rem, 50% - 50vw + 1rem); }
@media (max-width: 40rem) {
  body { padding: 1rem 0.8rem 3rem; }
  h1 { font-size: 1.5rem; }
  h2 { font-size: 1.2rem; }
  th, td { padding: 0.3rem 0.5rem; }
  .wide { overflow-x: auto; }
  .wide img { max-width: none; width: 44rem; }
  .foldyn { width: auto; margin-left: 0; }
}
@media print { h2 { break-after: avoid; } figure, tr { break-inside: avoid; } }
"""


def write_report(
    path: str | PathLike[str], title: str, sections: Iterable[Section | Stage]
) -> Path:
    """Write a report as one HTML page, pictures inside.

    Parameters
    ----------
    path : path-like
        File to write, in an existing directory.
    title : str
        Title of the page.
    sections : iterable of Heading, Text, Table, Listing, Picture or Stage
        In the order of the page. With two or more headings of level 2 the page begins with a list
        of them.

    Returns
    -------
    pathlib.Path
        The file written; nothing is written where a section is wrong.

    Raises
    ------
    InputError
        A section of another type, a picture that cannot be read, or no such directory.
    """
    path = Path(path)
    if not path.parent.is_dir():
        raise InputError(f"path: there is no directory {path.parent}; make it first")
    body, contents, stages = [], [], 0
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
                "Picture or Stage"
            )
    listed = ""
    if len(contents) > 1:
        items = "\n".join(f'<li><a href="#{a}">{escape(text)}</a></li>' for a, text in contents)
        listed = f'<nav aria-label="Contents"><ul>\n{items}\n</ul></nav>\n'
    head, end = _scripts(stages > 0)
    content = "\n".join(body)
    page = (
        '<!DOCTYPE html>\n<html lang="en">\n<head>\n<meta charset="utf-8">\n'
        '<meta name="viewport" content="width=device-width, initial-scale=1">\n'
        f"{head}<title>{escape(title)}</title>\n</head>\n<body>\n<main>\n"
        f"<h1>{escape(title)}</h1>\n{listed}{content}\n</main>\n{end}</body>\n</html>\n"
    )
    write_text(path, page)
    return path


def _scripts(interactive: bool) -> tuple[str, str]:
    """Policy and style in the head of a page, and the script at its end.

    The policy lets the browser take nothing but what is in the page.
    """
    css = (scripts.style() if interactive else "") + _CSS
    code = scripts.script() if interactive else ""
    policy = (
        f"default-src 'none'; style-src {scripts.digest(css)}; "
        f"script-src {scripts.digest(code)}; img-src data:; media-src data:"
    )
    head = f'<meta http-equiv="Content-Security-Policy" content="{policy}">\n<style>{css}</style>\n'
    return head, f"<script>{code}</script>\n" if code else ""
