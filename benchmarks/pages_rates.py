"""Pictures a second that pages draw in a browser without a graphics processor.

    .venv/bin/python benchmarks/pages_rates.py [--cells 4x3 100x100] [--seconds 5]

Each page holds 100 samples of a motion; it plays in headless Chromium at 1400 x 900, by WebGL in
software (SwiftShader) and by the canvas painter. The rate is the inverse of the median time between
two pictures, at most the screen's 60 a second; "script" is the median time (ms) of the page's own
code, and "processor" the time (ms) that all processes of the browser take for a picture, which
other programs hardly change. Linux only.
"""

from __future__ import annotations

import argparse
import os
import shutil
import tempfile
from pathlib import Path

import numpy as np
import xarray as xr
from machine import processor
from playwright.sync_api import sync_playwright

import foldyn as fd
from foldyn.report import write_report
from foldyn.viewer import stage

PAGE = "document.querySelector('.foldyn').page"
COUNT = f"""seconds => new Promise((done) => {{
  const page = {PAGE}, draw = page.draw.bind(page), own = [], at = [];
  page.draw = () => {{ const t = performance.now(); draw(); own.push(performance.now() - t); }};
  page.play(true);
  const end = performance.now() + 1000 * seconds;
  const next = (now) => {{
    at.push(now);
    if (now < end) requestAnimationFrame(next);
    else done([own, at]);
  }};
  requestAnimationFrame(next);
}})"""


def moving(cells: tuple[int, int]) -> tuple[xr.Dataset, fd.Case]:
    """A sheet that sways: 100 samples of six waves, as a dataset with what pages read."""
    pattern = fd.patterns.miura(cells, 0.025, b=0.025, panel_angle=60, dihedral=100)
    structure = fd.discretize(pattern, fd.Sheet(1.2e9, 0.2, 0.24e-3, density=667.0), preset="plate")
    case = fd.Case(structure, [fd.Fix([0, 1, 2], axes="xyz")])
    place = structure.nodes / pattern.size
    time = np.linspace(0.0, 1.0, 100)
    waves = [
        np.multiply.outer(
            np.sin(2.0 * np.pi * k * time), np.sin(np.pi * k * place[:, [1, 2, 0]]) / k
        )
        for k in range(1, 7)
    ]
    u = 0.02 * pattern.size * sum(waves)
    data = {"displacement": (("time", "node", "axis"), u, {"units": "m"})}
    return xr.Dataset(data, {"time": time, "node": np.arange(len(place))}), case


def spent() -> float:
    """Processor time (s) of all processes that this one has started, and theirs."""
    parent, own = {}, {}
    for place in Path("/proc").glob("[0-9]*/stat"):
        try:
            fields = place.read_text().rsplit(")", 1)[1].split()
        except OSError:
            continue
        number = int(place.parent.name)
        parent[number], own[number] = int(fields[1]), int(fields[11]) + int(fields[12])

    def ours(number: int) -> bool:
        while number in parent and number != os.getpid():
            number = parent[number]
        return number == os.getpid()

    return sum(time for number, time in own.items() if ours(number)) / os.sysconf("SC_CLK_TCK")


def main() -> None:
    """Measure and print a table."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--cells", nargs="*", default=["4x3", "100x100"])
    parser.add_argument("--seconds", type=float, default=5.0)
    chosen = parser.parse_args()
    print(processor())
    print("\n| cells | painter | colors | pictures/s | script (ms) | processor (ms) |")
    print("|---|---|---|---|---|---|")
    with tempfile.TemporaryDirectory() as folder, sync_playwright() as started:
        arguments = ["--no-sandbox", "--enable-unsafe-swiftshader"]
        browser = started.chromium.launch(executable_path=shutil.which("chromium"), args=arguments)
        for cells in chosen.cells:
            result, case = moving(tuple(map(int, cells.split("x"))))
            part = stage({"motion": result}, {"motion": case}, cells, [0])
            path = write_report([part], Path(folder) / f"{cells}.html", title=cells)
            for asked in ("webgl", "plain"):
                tab = browser.new_page(viewport={"width": 1400, "height": 900})
                tab.goto(f"file://{path}?{asked}")
                tab.wait_for_selector(".foldyn[data-ready='1']", timeout=120_000)
                for field in ("", "energy"):
                    tab.evaluate(f"{PAGE}.field = '{field}'; {PAGE}.recolor()")
                    before = spent()
                    own, at = tab.evaluate(COUNT, chosen.seconds)
                    each = 1e3 * (spent() - before) / len(own)
                    kind = tab.get_attribute(".foldyn", "data-painter")
                    rate = 1e3 / np.median(np.diff(at))
                    color = field or "paper"
                    row = cells, kind, color, f"{rate:.1f}", f"{np.median(own):.1f}", f"{each:.0f}"
                    print(f"| {' | '.join(row)} |", flush=True)
                tab.close()


if __name__ == "__main__":
    main()
