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
    css, code = scripts.style_of_text(), ""
    if any(isinstance(section, Stage | Charts) for section in sections):
        css, code = scripts.style(), scripts.script()
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
