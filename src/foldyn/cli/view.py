"""`foldyn view`: show a case file with sliders, results or a pattern in the browser."""

from __future__ import annotations

from argparse import Namespace
from typing import Any

from foldyn.cli.options import flag, integer
from foldyn.cli.signals import ENDINGS
from foldyn.cli.streams import speech


def add_view(commands: Any) -> None:
    """Add the command and its arguments."""
    command = commands.add_parser(
        "view",
        help="look at a case file, results or a pattern in the browser",
        description="Open a page in the browser: a case file with sliders for the numbers of its "
        "pattern, sheet and damping, computed anew with each change; results, several of one kind "
        "in step; or a pattern, folded to its fold angles. The page is served to this machine "
        "alone until Ctrl-C.",
    )
    command.add_argument(
        "files", metavar="FILE", nargs="+",
        help="case file (TOML) or the name of a shipped one, results (.nc), or a pattern file",
    )  # fmt: skip
    command.add_argument("--port", type=integer, default=0, help="port (default: any that is free)")
    flag(command, "--no-browser", "print the address and open no browser")
    flag(command, "--quiet", "print nothing but the address")
    flag(command, "--force", "run even if more than half of the memory is needed, as estimated")


def run_view(given: Namespace) -> None:
    """Serve the page until Ctrl-C."""
    import webbrowser

    from foldyn.live.files import served
    from foldyn.studies import find_case
    from foldyn.threads import one_thread

    say = speech(given.quiet)
    server, title = served([find_case(name) for name in given.files], given.port)
    with server, one_thread():  # threads do not pay for small matrices
        try:
            print(server.address, flush=True)
            say(f"{title}: the page is at this address until Ctrl-C")
            if not given.no_browser:
                webbrowser.open(server.address)
            server.serve_forever()
        except KeyboardInterrupt:
            if not ENDINGS.by_hand:
                raise
            say("")
