"""The session of a case file in the viewer: numbers that change, and answers to requests."""

from __future__ import annotations

import threading
import time
import warnings
from collections.abc import Callable, Mapping
from contextvars import copy_context
from functools import partial
from pathlib import Path
from typing import Any, Generic, TypeVar

import numpy as np
import tomli_w
import xarray as xr
from numpy.typing import NDArray

from foldyn.analyses import CaseFile
from foldyn.analyses.conversion import converted
from foldyn.analyses.reading import case_of_document, read_document
from foldyn.analyses.sections import Choice
from foldyn.cases.models import BARS_AND_HINGES
from foldyn.dynamics import prepare
from foldyn.errors import FoldynError, FoldynWarning, InputError, quietly, warn
from foldyn.live.controls import changed, controls
from foldyn.values import choice
from foldyn.viewer import stage

Wish = TypeVar("Wish")
Answer = TypeVar("Answer")


class Newest(Generic[Wish, Answer]):
    """A thread that computes the newest request.

    There is no queue: a newer request replaces a waiting one, and the result of a request that is
    being computed is discarded.

    Parameters
    ----------
    compute : callable
        Returns the answer to a request; it runs only in this thread and raises nothing.
    """

    def __init__(self, compute: Callable[[Wish], Answer]) -> None:
        self._compute = compute
        self._changed = threading.Condition()
        self._count = 0
        self._waiting: tuple[int, Wish] | None = None
        self._ready: tuple[int, Answer] | None = None
        run = copy_context().run
        threading.Thread(target=run, args=(self._work,), name="newest wish", daemon=True).start()

    def answer(self, wish: Wish) -> Answer | None:
        """Wait for the answer to a request; None as soon as a newer one arrives."""
        with self._changed:
            self._count += 1
            mine = self._count
            self._waiting = mine, wish
            self._changed.notify_all()
            self._changed.wait_for(
                lambda: self._count > mine or (self._ready is not None and self._ready[0] == mine)
            )
            ready = self._ready
            return None if self._count > mine or ready is None else ready[1]

    def _work(self) -> None:
        while True:
            with self._changed:
                while self._waiting is None:
                    self._changed.wait()
                (number, wish), self._waiting = self._waiting, None
            answer = self._compute(wish)
            with self._changed:
                self._ready = number, answer
                self._changed.notify_all()


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
        Data for the page: "controls", its sliders, and "offers", the analyses that can be chosen.
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
            raise InputError("a request must be a table with numbers and what to compute")
        return changed(self.document, self.controls, numbers)

    def _computed(self, wish: Any) -> Message:
        began = time.perf_counter()
        with warnings.catch_warnings(
            record=True, action="always", category=FoldynWarning
        ) as caught:
            answer = told(self.path, lambda: self._stage(wish))
        told_of = (str(one.message) for one in caught if issubclass(one.category, FoldynWarning))
        notes = list(dict.fromkeys(told_of))
        return {**answer, "notes": notes, "seconds": time.perf_counter() - began}

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


KINDS: Mapping[str, str] = {
    "modes": "Modes",
    "frf": "Frequency response",
    "statics": "Static curve",
    "dynamics": "Short motion",
    "bands": "Bands",
    "response": "Response curve",
}
"""Analyses that can be computed, with their names on the page."""
STEPS, PERIODS, FREQUENCIES, COUNT = 10, 10.0, 200, 6
"""Sizes of analyses that the file does not define: steps of a static curve, duration of a motion in
periods of the first mode, frequencies of a response, number of modes."""
SAMPLES, STEPS_A_SAMPLE = 250, 4
"""Samples of a motion, and steps between samples unless the file gives them: a hundred steps in a
period."""
MOST_WORK = 1e7
"""Largest product of steps and dofs of a motion with fixed steps, about a second of computing;
longer motions are shortened."""
MOST_FREE, MODES = 60, 6
"""Largest number of free dofs of a response curve (about 0.1 s per point), and the number of modes
to which larger sheets are reduced."""

Document = dict[str, Any]


def offered(document: Document) -> dict[str, str]:
    """Kinds of analysis that a case file allows; the kind of the file comes first."""
    own = document["analysis"]["kind"]
    driven = any("force" in load for load in document.get("loads", ())) or "drive" in document
    imposed = any("displacement" in support for support in document.get("supports", ()))
    based = any("base" in support for support in document.get("supports", ()))
    possible = {
        "modes": True,
        "frf": driven or based,
        "statics": bool(document.get("loads")) or (imposed and not based),
        "dynamics": bool(document.get("loads")) or imposed or based,
    }  # others only for files of their kind: few patterns repeat, and response curves take seconds
    kinds = [kind for kind in KINDS if kind == own or possible.get(kind)]
    return {kind: KINDS[kind] for kind in sorted(kinds, key=lambda kind: kind != own)}


def computed(path: Path, document: Document, kind: str) -> tuple[CaseFile, xr.Dataset]:
    """Return the case file as another kind of analysis, and the result with its first mass rule.

    Raises
    ------
    InputError, ComputationError
        As in `CaseFile.run`; also if the file does not allow this kind.
    """
    choice("compute", kind, offered(document))
    case_file = case_of_document(path, _as_kind(path, document, kind))
    if kind == "response":
        return case_file, _curve_of_motions(case_file)
    case = case_file.case()
    if kind != "dynamics" or case.structure.linear:
        return case_file, case_file.run()
    asked = case_file.analysis.arguments
    work = prepare(case, **asked).plan.steps * case.body.size
    if work <= MOST_WORK:
        return case_file, case_file.run()
    duration = asked["duration"] * MOST_WORK / work
    warn(
        f"only {duration:.3g} s of {asked['duration']:g} s are computed and shown, to keep the "
        "wait short; foldyn run computes the whole motion",
        "pages.md#change-parameters-in-the-viewer",
    )
    return case_file, case_file.run(duration=duration, interval=duration / SAMPLES)


def _curve_of_motions(case_file: CaseFile) -> xr.Dataset:
    """Response curve; for a large sheet in the span of a few modes."""
    free = len(case_file.case().free_dofs)
    if free <= MOST_FREE or case_file.analysis.arguments.get("modes"):
        return case_file.run()
    warn(
        f"the curve is computed with {MODES} modes instead of all {free} free dofs, to keep the "
        "wait short; foldyn run takes all of them",
        "pages.md#change-parameters-in-the-viewer",
    )
    return case_file.run(modes=MODES)


def _as_kind(path: Path, document: Document, kind: str) -> Document:
    """Convert the document to a kind; if it has another kind, use settings that compute quickly."""
    if document["analysis"]["kind"] == kind:  # of bands a single state: sliders vary it
        analysis = {k: value for k, value in document["analysis"].items() if k != "vary"}
        return {**document, "analysis": analysis}
    make = {"modes": _modes, "frf": _response, "statics": _curve, "dynamics": _motion}[kind]
    with quietly():  # settings without meaning for this kind are left out
        return make(path, document)


_modes = partial(converted, kind="modes", state="rest")


def _response(path: Path, document: Document) -> Document:
    """Frequency response under the file's drive, over its lowest modes."""
    lowest = _frequencies(path, document)
    out = converted(path, document, "frf", "rest")
    range_ = {"first": 0.3 * lowest[0], "last": 1.2 * lowest[-1], "count": FREQUENCIES}
    return {**out, "analysis": {"kind": "frf", "frequencies": range_, "method": "modal"}}


def _curve(_: Path, document: Document) -> Document:
    """Equilibrium path under the same loads without histories, with the base at rest."""
    timeless = {
        name: [
            {key: value for key, value in each.items() if key != "history"}
            for each in document.get(name, ())
            if "base" not in each
        ]
        for name in ("loads", "supports")
    }
    model = dict(document.get("model", {}))
    if isinstance(model.get("mass"), list):
        model["mass"] = model["mass"][0]
    own = {"model": model, "analysis": {"kind": "statics", "steps": STEPS}}
    return {**_kept(document), **timeless, **own}


def _motion(path: Path, document: Document) -> Document:
    """Motion under the file's loads and supports; loads without a history act from the start."""
    duration = PERIODS / float(_frequencies(path, document)[0])
    steps = {"method": "generalized_alpha", "dt": duration / (SAMPLES * STEPS_A_SAMPLE)}
    sampled: Document = {"every_steps": STEPS_A_SAMPLE}
    if document.get("model", {}).get("kind") == "superelements":  # which take any step
        steps, sampled = {}, {"interval": duration / SAMPLES}
    shown, analysis = _kept(document), {"kind": "dynamics", "duration": duration, **steps}
    return {**shown, "output": {**shown["output"], **sampled}, "analysis": analysis}


def _kept(document: Document) -> Document:
    """Sections shared by all kinds of analysis, and the nodes to show."""
    own = {key: value for key, value in document.items() if key not in ("drive", "initial")}
    nodes = document.get("output", {}).get("nodes")
    return {**own, "output": {} if nodes is None else {"nodes": nodes}}


def _frequencies(path: Path, document: Document) -> NDArray[np.float64]:
    """Lowest natural frequencies (Hz) above 0."""
    about = {**_modes(path, document), "analysis": {"kind": "modes", "count": COUNT}}
    found = case_of_document(path, about, choice=Choice(BARS_AND_HINGES)).run()
    values = found["frequency"].values[~found["rigid"].values]
    values = values[np.isfinite(values) & (values > 0.0)]
    if not len(values):
        raise InputError("no mode of the sheet oscillates, so there is no time scale; choose modes")
    return values
