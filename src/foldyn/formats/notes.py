"""Notes on building a drawing: repairs and doubts, with places in the file."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

from numpy.typing import NDArray

from foldyn.formats.drawing import Drawing

_SHOWN = 3


def count(number: int, noun: str, plural: str = "") -> str:
    """Number with its noun, "1 line" or "2 lines"."""
    return f"{number} {noun if number == 1 else plural or noun + 's'}"


def without_length(has_length: Mapping[str, bool]) -> list[str]:
    """Sentence on elements that shrink to points, as by a scale of 0, with their places."""
    places = [place for place, has in has_length.items() if not has]
    if not places:
        return []
    shown = ", ".join(places[:_SHOWN]) + (", ..." if len(places) > _SHOWN else "")
    return [f"left out {count(len(places), 'element')} of no length: {shown}"]


class Notes:
    """Collects the sentences of a diagnosis.

    Parameters
    ----------
    drawing : Drawing
        The drawing being built; its own notes come first.
    unit : float
        Length (m) of its unit; places are given in the file's coordinates.
    """

    def __init__(self, drawing: Drawing, unit: float) -> None:
        self.repairs, self.doubts = list(drawing.repairs), list(drawing.doubts)
        self._places, self._unit = drawing.places, unit

    def line(self, source: int) -> str:
        """Name of a drawn line."""
        return self._places[source] if self._places else f"line {source}"

    def point(self, point: NDArray) -> str:
        """Place of a point (m) in the file's coordinates."""
        return "(" + ", ".join(f"{x:.6g}" for x in (point / self._unit).tolist()) + ")"

    def lines(self, sources: Sequence[int], points: Sequence[NDArray] = ()) -> str:
        """Names and places of some lines."""
        names: dict[str, None] = {}
        for k, source in enumerate(sources):
            where = f" near {self.point(points[k])}" if len(points) else ""
            names.setdefault(self.line(int(source)) + where)
        shown = list(names)[:_SHOWN]
        more = f" and {len(names) - _SHOWN} more" if len(names) > _SHOWN else ""
        return ", ".join(shown) + more

    def contradict(self, pairs: Sequence[tuple[int, int]]) -> None:
        """Report coincident lines of which one is a mountain and the other a valley."""
        if pairs:
            one, other = pairs[0]
            more = f" (and {len(pairs) - 1} more such pairs)" if len(pairs) > 1 else ""
            self.doubts.append(
                f"{self.line(one)} and {self.line(other)}{more} lie in one place, a mountain and a "
                "valley: the first is kept"
            )
