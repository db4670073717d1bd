"""`foldyn fold`: a pattern file, folded."""

from __future__ import annotations

from argparse import Namespace
from pathlib import Path
from typing import TYPE_CHECKING, Any

from foldyn.cli.folder import check_folder, drawing
from foldyn.cli.options import add_switches
from foldyn.cli.signals import ENDINGS
from foldyn.cli.streams import progress_bar, speech
from foldyn.errors import InputError
from foldyn.input_files import read_text

if TYPE_CHECKING:
    from foldyn.formats import Frame
    from foldyn.statics import Folding

MOST = 8  # MiB, of a file of angles


def add_fold(commands: Any) -> None:
    """Add the command and its arguments."""
    command = commands.add_parser(
        "fold",
        help="fold a pattern file",
        description="Fold a flat or partly folded pattern, every mountain and valley its own way, "
        "and say what does not fold. OUT is the folded pattern, as FOLD with the states on the way "
        "as frames; a picture and an animation stand beside it.",
    )
    command.add_argument("pattern", metavar="PATTERN", help="pattern file: FOLD, SVG, CP, ...")
    aim = command.add_mutually_exclusive_group()
    aim.add_argument(
        "--to",
        metavar="80%",
        help="how far, of the fold angles of the file and of 180 degrees where it has none",
    )
    aim.add_argument(
        "--angles",
        metavar="FILE",
        help='angles (degrees), one a line: "mountain 90", "zigzag 60" (a family), "3 4 -120" (the '
        "crease between two vertices, valleys positive)",
    )
    aim.add_argument(
        "--to-frame", metavar="FRAME", help="number or title of the frame to fold to, of the file"
    )
    command.add_argument("--steps", type=int, default=20, help="states on the way (20)")
    command.add_argument(
        "--start",
        default="auto",
        help="pattern, folded (open from the folded state), or auto (default): folded where the "
        "pattern does not fold its way",
    )
    command.add_argument("--scale", type=float, help="factor on all lengths")
    command.add_argument("--unit", help="unit of the coordinates of the file: mm, cm, m, in, ...")
    command.add_argument("--frame", help="number or title of the frame to start from")
    command.add_argument("--out", help="file to write (default: NAME-folded.fold)")
    add_switches(command)


def run_fold(given: Namespace) -> Path:
    """Run the command; returns the path of the folded pattern."""
    from foldyn.formats import FORMATS, read_pattern, write_pattern
    from foldyn.statics import fold

    source = Path(given.pattern)
    pattern = read_pattern(source, given.scale, given.unit, _frame(given.frame))
    out = Path(f"{source.stem}-folded.fold" if given.out is None else given.out)
    fmt = FORMATS.get(out.suffix.lower())
    if fmt is None or fmt.write is None:
        able = ", ".join(end for end, each in FORMATS.items() if each.write is not None)
        raise InputError(f"--out {out}: name a file that ends in one of {able}")
    check_folder(out.parent, given.out, [out.name])
    angles = None
    if given.angles is not None:
        angles = read_angles(given.angles)
    elif given.to_frame is not None:
        angles = read_pattern(source, given.scale, given.unit, _frame(given.to_frame))
    say = speech(given.quiet)
    with progress_bar(given.quiet, total=given.steps, unit="step") as bar:

        def tell(step: int, steps: int) -> None:
            if step == 1:
                bar.reset(steps)
            bar.update()

        folding = fold(
            pattern, angles, given.to, steps=given.steps, start=given.start, progress=tell
        )
    out.parent.mkdir(parents=True, exist_ok=True)
    with ENDINGS.saving():
        write_pattern(out, folding.pattern, _frames(folding) if fmt.frames else ())
    say(folding.report())
    say(f"wrote {out}")
    if not given.no_figures:
        with drawing(out, f"\nfoldyn: kept what was computed: {out}"):
            say(f"wrote {', '.join(_figures(folding, out))}")
    return out


def _frame(given: str | None) -> int | str | None:
    return int(given) if given is not None and given.isdecimal() else given


def _frames(folding: Folding) -> list[Frame]:
    from foldyn.formats import Frame

    positions, last = folding.path["position"].values, len(folding.path["step"]) - 1
    return [Frame(f"step {k} of {last}", x) for k, x in enumerate(positions)]


def read_angles(path: str) -> dict[Any, float]:
    """Angles (degrees) by word or pair of vertices, from a text with one on each line."""
    text = read_text(Path(path), "a file of angles", MOST, "leave out all but the angles")
    found: dict[Any, float] = {}
    for number, line in enumerate(text.splitlines(), start=1):
        parts = line.partition("#")[0].replace(",", " ").split()
        if not parts:
            continue
        key: Any = parts[0]
        try:
            angle = float(parts[-1])
            if len(parts) == 3:
                key = (int(parts[0]), int(parts[1]))
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


def _figures(folding: Folding, out: Path) -> list[str]:
    """Draw the states and the animation; returns the names of their files."""
    from foldyn import plots
    from foldyn.writing import whole

    picture, film = out.with_suffix(".png"), out.with_suffix(".gif")
    with whole(picture) as part:
        plots.draw_folding(folding).savefig(part, dpi=120)
    plots.animate_folding(folding, film)
    return [str(picture), str(film)]
