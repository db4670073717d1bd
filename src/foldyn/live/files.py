"""Files in the viewer: a case file with sliders, results of one kind side by side, or a pattern."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from contextlib import suppress
from functools import partial
from html import escape
from pathlib import Path
from typing import Any

import numpy as np

from foldyn.errors import FoldynError, InputError, quietly
from foldyn.formats import read_pattern
from foldyn.live.case_session import CaseSession
from foldyn.live.embedded import View, check_results, results_stage
from foldyn.live.server import Server
from foldyn.patterns import Pattern
from foldyn.patterns.frames import fold_angles
from foldyn.report.page import document
from foldyn.results import load
from foldyn.statics import fold
from foldyn.viewer import Stage, rest_stage, scripts

CASE, RESULT = ".toml", ".nc"
MOST_FOLDED = 300
"""Largest number of panels of a pattern that is folded for viewing; larger patterns are shown at
rest."""


def served(paths: Sequence[Path], port: int = 0) -> tuple[Server, str]:
    """Return a server of files, not yet running, and the title of its page.

    Parameters
    ----------
    paths : sequence of Path
        A case file, a pattern file, or results of one kind.
    port : int
        0 takes any free port.

    Raises
    ------
    InputError
        A file cannot be used, the files are of several kinds, or the port is taken.
    """
    endings = [path.suffix.lower() for path in paths]
    if len(paths) > 1 and set(endings) != {RESULT}:
        raise InputError(
            f": {len(paths)} files that are not all results (.nc); give one case file, one "
            "pattern, or results",
            "FILE",
        )
    try:
        if endings[0] == CASE:
            session = CaseSession(paths[0])
            page = partial(live_page, session.title, session.about)
            answers = {"/compute": session.compute, "/case-file": session.case_file}
            return Server(page, answers, port), session.title
        shown = _results(paths) if endings[0] == RESULT else _pattern(paths[0])
        text = shown.html()
        return Server(lambda key: text, None, port), shown.title
    except (OSError, OverflowError) as error:
        why = getattr(error, "strerror", None) or error
        raise InputError(f" = {port}: {why}; choose another one, or 0", "--port") from None


def live_page(title: str, about: Mapping[str, Any], key: str) -> str:
    """Text of the page.

    about : data for the script of the page: "controls" and "offers".
    key : secret that requests of the page carry.
    """
    told = scripts.in_page({**about, "key": key})
    main = (
        f"<h1>{escape(title)}</h1>\n"
        '<div class="live" id="live"><p>This page needs JavaScript.</p></div>\n'
        f'<script type="application/json" id="live.about">{told}</script>'
    )
    css, code = scripts.style("live"), scripts.script_of_live()
    return document(title, main, css, code, "; connect-src 'self'")


def _results(paths: Sequence[Path]) -> View:
    """Results named after their files, or with the folder's name if file names repeat."""
    stems = [path.stem for path in paths]
    if len(set(stems)) < len(stems):
        stems = [f"{path.absolute().parent.name}/{path.stem}" for path in paths]
    if len(set(stems)) < len(stems):
        raise InputError(": the same file twice; give each once", "FILE")
    results = {name: load(path) for name, path in zip(stems, paths, strict=True)}
    title = f"{check_results(results)}: {', '.join(results)}"
    return View(title, results_stage(results, title))


def _pattern(path: Path) -> View:
    """Stage of a pattern folding to its fold angles, or at rest if it has none or does not fold."""
    return View(path.stem, folded_stage(read_pattern(path), path.stem))


def folded_stage(pattern: Pattern, title: str) -> Stage:
    """Stage of a pattern folding to its fold angles if that is quick, otherwise at rest."""
    wanted = pattern.fold_angles
    given = np.isfinite(wanted)
    moves = given.any() and float(np.abs(wanted - fold_angles(pattern))[given].max()) > 1e-6
    if moves and len(pattern.faces) <= MOST_FOLDED:
        with suppress(FoldynError), quietly():  # `foldyn fold` reports failures to fold
            return results_stage({title: fold(pattern).path}, title)
    return rest_stage(pattern, title)
