"""The session of a case file in the viewer: numbers that change, and answers to requests."""

from __future__ import annotations

import time
import warnings
from collections.abc import Callable
from pathlib import Path
from typing import Any

import tomli_w

from foldyn.analyses.reading import case_of_document, read_document
from foldyn.errors import FoldynError, FoldynWarning, InputError
from foldyn.live.controls import changed, controls
from foldyn.live.newest import Newest
from foldyn.live.view_requests import computed, offered
from foldyn.viewer import stage

Message = dict[str, Any]


class CaseSession:
    """Answers the requests of a case file's page.

    Parameters
    ----------
    path : Path
        The file, which is read once; an invalid case file is refused.

    Attributes
    ----------
    title : str
    about : dict
        Data for the page: its "controls", and the analyses that it "offers".
    """

    def __init__(self, path: Path) -> None:
        self.path, self.document = path, read_document(path)
        self.title = case_of_document(path, self.document).heading
        self.controls = controls(self.document)
        self.about = {
            "controls": [control.described() for control in self.controls],
            "offers": offered(self.document),
            "name": f"{path.stem}-changed.toml",
        }
        self._newest: Newest[Any, Message] = Newest(self._computed)

    def compute(self, wish: Any) -> Message:
        """Answer a request {"numbers": ..., "compute": ...} with a stage, or with an error message.

        The answer is "superseded" if a newer request came before it was ready.
        """
        answer = self._newest.answer(wish)
        return {"superseded": True} if answer is None else answer

    def case_file(self, wish: Any) -> Message:
        """Text of the case file with the numbers of a request."""
        return told(self.path, lambda: {"text": tomli_w.dumps(self._document(wish))})

    def _document(self, wish: Any) -> dict[str, Any]:
        numbers = wish.get("numbers") if isinstance(wish, dict) else None
        if not isinstance(numbers, dict):
            raise InputError("a wish must be a table with numbers and what to compute")
        return changed(self.document, self.controls, numbers)

    def _computed(self, wish: Any) -> Message:
        began = time.perf_counter()
        with warnings.catch_warnings(record=True) as caught:
            warnings.simplefilter("always", FoldynWarning)
            answer = told(self.path, lambda: self._stage(wish))
        notes = [str(one.message) for one in caught if issubclass(one.category, FoldynWarning)]
        return {
            **answer,
            "notes": list(dict.fromkeys(notes)),
            "seconds": time.perf_counter() - began,
        }

    def _stage(self, wish: Any) -> Message:
        case_file, result = computed(self.path, self._document(wish), wish.get("compute"))
        cases = {case_file.heading: case_file.case()}
        nodes = case_file.output.nodes.tolist()
        made = stage({case_file.heading: result}, cases, self.title, nodes)
        return {"about": made.whole(), "arrays": made.arrays.texts()}


def told(path: Path, answer: Callable[[], Message]) -> Message:
    """Return a function's answer, or its error message without the path of the file."""
    try:
        return answer()
    except FoldynError as error:
        return {"error": str(error).removeprefix(f"{path}: ")}
    except MemoryError:
        return {"error": "this needs more memory than there is: take a smaller sheet"}
    except Exception as error:  # a defect of ours: the page stays open and reports it
        return {"error": f"this could not be computed ({type(error).__name__}: {error})"}
