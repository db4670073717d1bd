"""`foldyn fold`: fold the pattern of a file."""

from __future__ import annotations

from argparse import Namespace
from pathlib import Path
from typing import TYPE_CHECKING, Any

from foldyn.cli.convert import RESULT
from foldyn.cli.folder import check_folder, drawing
from foldyn.cli.options import add, add_film, add_reading, add_switches, frame_of, integer, reading
from foldyn.cli.signals import ENDINGS
from foldyn.cli.streams import Clock, noted_warnings, progress_bar, speech
from foldyn.errors import InputError, MotionInterrupted, within
from foldyn.input_files import read_text
from foldyn.values import parsed

if TYPE_CHECKING:
    from collections.abc import Callable

    from foldyn.analyses.provenance import Call
    from foldyn.patterns import Pattern
    from foldyn.statics import Folding

MOST = 8  # MiB, largest file of angles


def add_fold(commands: Any) -> None:
    """Add the command and its arguments."""
    command = commands.add_parser(
        "fold",
        help="fold a pattern file",
        description="Fold a flat or partly folded pattern, every mountain and valley its own way, "
        "and say what does not fold. OUT is the folded pattern, as FOLD with the states on the way "
        "as frames; a page in the same folder shows them.",
    )
    command.add_argument("pattern", metavar="PATTERN", help="pattern file: FOLD, SVG, CP, ...")
    aim: Any = command.add_mutually_exclusive_group()
    add(aim, str, {
        "--to 80%": "how far, of the fold angles of the file and of 180 degrees where it has none",
        "--angles FILE": 'angles (degrees), one a line: "mountain 90", "zigzag 60" (a family), '
        '"3 4 -120" (the crease between two vertices, valleys positive)',
    })  # fmt: skip
    add(aim, frame_of, {"--to-frame FRAME": "number or title of the frame to fold to, of the file"})
    add(command, integer, {"--steps": "states on the way (20)"}, default=20)
    starts = (
        "pattern, folded (open from the folded state), or auto (default): folded where the pattern "
        "does not fold its way"
    )
    cut = "subdivided: cut from their middles, so that they bend as paper does (default: whole)"
    add(command, str, {"--initial": starts}, default="auto")
    add(command, str, {"--panels": cut}, default="whole")
    add_reading(command, "number or title of the frame to begin with")
    add(command, str, {
        "--out": "file to write (default: NAME-folded.fold): the folded pattern, or as a result "
        "(.nc) the states on the way",
    })  # fmt: skip
    add_film(command)
    add_switches(command)


def run_fold(given: Namespace) -> Path:
    """Run `foldyn fold`; return the path of the folded pattern."""
    from foldyn.analyses.provenance import Call
    from foldyn.formats import read_pattern
    from foldyn.plots.writers import find_ffmpeg

    clock = Clock.now()
    source = Path(given.pattern)
    with noted_warnings() as noted:
        pattern = read_pattern(source, **reading(given))
        out = Path(f"{source.stem}-folded.fold" if given.out is None else given.out)
        write = _writer(out)
        check_folder(out.parent, given.out, [out.name])
        if given.film == "mp4":
            with within("--film mp4: "):
                find_ffmpeg()
        try:
            folding = _folded(pattern, source, given)
        except MotionInterrupted as stop:
            if stop.partial is None:
                raise
            _write(stop.partial, out, write)
            raise KeyboardInterrupt(f"{stop}\nfoldyn: kept what was computed: {out}") from None
    _write(folding, out, write)
    call = Call(given.typed, tuple(noted), **clock.spent())
    say = speech(given.quiet)
    say(folding.report())
    say(f"wrote {out}")
    if not given.no_figures:
        with drawing(out, f"\nfoldyn: kept what was computed: {out}"):
            say(f"wrote {', '.join(_drawn(folding, out, source.stem, given, call))}")
    return out


def _write(folding: Folding, out: Path, write: Callable[[Folding], None]) -> None:
    out.parent.mkdir(parents=True, exist_ok=True)
    with ENDINGS.saving():
        write(folding)


def _folded(pattern: Pattern, source: Path, given: Namespace) -> Folding:
    """Fold a pattern as the arguments ask."""
    from foldyn.formats import read_pattern
    from foldyn.statics import fold

    angles = None
    if given.angles is not None:
        angles = read_angles(given.angles)
    elif given.to_frame is not None:
        options = {**reading(given), "frame": given.to_frame, "flat_foldable": False}
        angles = read_pattern(source, **options)
    with progress_bar(given.quiet, total=given.steps, unit="step") as bar:

        def tell(step: int, steps: int) -> None:
            if step == 1:
                bar.reset(steps)
            bar.update()

        return fold(
            pattern, angles, fraction=given.to, steps=given.steps, initial=given.initial,
            panels=given.panels, progress=tell,
        )  # fmt: skip


def _writer(out: Path) -> Callable[[Folding], None]:
    """Return the function that writes a folding to a file with this name."""
    from foldyn.formats import FORMATS, write_pattern
    from foldyn.results import frames_of, save

    if out.suffix.lower() == RESULT:
        return lambda folding: save(folding.path, out)
    fmt = FORMATS.get(out.suffix.lower())
    if fmt is None or fmt.write is None:
        able = ", ".join(end for end, each in FORMATS.items() if each.write is not None)
        raise InputError(f"--out {out}: name a file that ends in one of {able}, or in {RESULT}")
    return lambda folding: write_pattern(
        folding.pattern, out, frames=frames_of(folding.path).frames if fmt.frames else ()
    )


def read_angles(path: str) -> dict[Any, float]:
    """Read angles (degrees) by name or pair of vertices from a text, one per line."""
    text = read_text(Path(path), "a file of angles", MOST, "leave out all but the angles")
    found: dict[Any, float] = {}
    for number, line in enumerate(text.splitlines(), start=1):
        parts = line.partition("#")[0].replace(",", " ").split()
        if not parts:
            continue
        key: Any = parts[0]
        try:
            angle = parsed(parts[-1])
            if len(parts) == 3:
                key = (parsed(parts[0], int), parsed(parts[1], int))
        except ValueError:
            angle = None
        if angle is None or len(parts) not in (2, 3):
            raise InputError(
                f"{path}: line {number}: {line.strip()[:60]!r}: write a word or two vertices, and "
                'an angle in degrees: "mountain 90" or "3 4 -120"'
            )
        if key in found:
            raise InputError(f"{path}: line {number}: {key} is given twice")
        found[key] = angle
    if not found:
        raise InputError(f'{path}: is empty; write lines such as "mountain 90" or "3 4 -120"')
    return found


def _drawn(folding: Folding, out: Path, name: str, given: Namespace, call: Call) -> list[str]:
    """Draw the page, and the film if asked for; return the names of their files."""
    from foldyn import plots
    from foldyn.analyses.folding_page import write_folding_page

    page = write_folding_page(folding, out.with_suffix(".html"), f"{name}, folded", call)
    films = []
    if given.film:
        films.append(plots.animate_folding(folding, out.with_suffix(f".{given.film}")))
    return [str(path) for path in (page, *films)]
