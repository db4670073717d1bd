"""From a slider to the picture: `python benchmarks/viewer.py [--changes 40]`.

`foldyn view` of a Miura sheet of 4 x 3 cells runs in this process and computes six modes; headless
Chromium moves the slider of its dihedral. A time is from the slider's event to the end of the frame
in which the new shapes have been drawn, by the browser's clock. Printed: median and extremes, with
WebGL in software and with the plain canvas, beside the share of it that is computing; and the
machine. Needs Playwright and Chromium.
"""

from __future__ import annotations

import argparse
import os
import shutil
import statistics
import tempfile
import threading
from pathlib import Path

from machine import describe
from playwright.sync_api import Page, sync_playwright
from threadpoolctl import threadpool_limits

from foldyn.live.files import served

CASE = """
title = "Miura sheet of 4 x 3 cells"
[pattern]
kind = "miura"
cells = [4, 3]
a = 0.025
b = 0.025
panel_angle = 60
dihedral = 60
[sheet]
youngs_modulus = 1.219e9
poissons_ratio = 0.2
thickness = 2.4e-4
density = 667.0
[model]
preset = "plate"
[[supports]]
nodes = "xmax"
axes = "xyz"
[analysis]
kind = "modes"
count = 6
"""
SLIDE = """async (place) => {
  const { live } = document.getElementById("live");
  const { slider } = live.numbers.find((each) => each.name === "pattern.dihedral");
  const shown = new Promise((done) => live.host.addEventListener("shown", done, { once: true }));
  slider.value = place;
  const begun = performance.now();
  slider.dispatchEvent(new Event("input"));
  const { detail } = await shown;
  await new Promise((done) => requestAnimationFrame(() => setTimeout(done)));
  return [performance.now() - begun, 1000 * detail.seconds, live.page.view.kind];
}"""


def measure(page: Page, address: str, changes: int) -> tuple[list[float], list[float], str]:
    """Milliseconds of changes, those of computing, and what has drawn them."""
    page.goto(address)
    page.wait_for_selector("#live[data-shown]", timeout=300_000)
    page.evaluate("document.getElementById('live').live.page.play(false)")
    rows = [page.evaluate(SLIDE, 300 + 7 * k) for k in range(changes + 3)][3:]
    return [row[0] for row in rows], [row[1] for row in rows], rows[0][2]


def main() -> None:
    """Measure with both painters."""
    given = argparse.ArgumentParser(description=__doc__)
    given.add_argument("--changes", type=int, default=40)
    changes = given.parse_args().changes
    browser = next(filter(None, map(shutil.which, ("chromium", "google-chrome"))), None)
    with tempfile.TemporaryDirectory() as folder, threadpool_limits(1, user_api="blas"):
        path = Path(folder) / "miura.toml"
        path.write_text(CASE, "utf-8")
        server, _ = served([path])
        threading.Thread(target=server.serve_forever, daemon=True).start()
        with server, sync_playwright() as started:
            arguments = ["--no-sandbox", "--enable-unsafe-swiftshader"]
            chromium = started.chromium.launch(executable_path=browser, args=arguments)
            for line in describe(None):
                print(f"- {line}")
            print(f"- Chromium {chromium.version}; load {os.getloadavg()[0]:.1f} at the beginning")
            for query in ("", "?plain"):
                page = chromium.new_page(viewport={"width": 1500, "height": 950})
                times, computing, painter = measure(page, server.address + query, changes)
                print(
                    f"{painter}: {statistics.median(times):.0f} ms (median of {len(times)}; "
                    f"{min(times):.0f} to {max(times):.0f}), "
                    f"{statistics.median(computing):.0f} ms of it computing"
                )
            print(f"load {os.getloadavg()[0]:.1f} at the end")
            server.shutdown()


if __name__ == "__main__":
    main()
