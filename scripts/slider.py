"""How long a map of 64 × 64 cells takes in the browser after a slider of the explorer has moved.

    pip install -e .[browser] && python scripts/slider.py [TIMES]

Prints for each move the seconds until the first counts are drawn, of every fourth value along each axis, and until all
cells are foreseen.  Chromium has to be there.
"""

from __future__ import annotations

import re
import statistics
import subprocess
import sys
from pathlib import Path
from tempfile import TemporaryDirectory

from playwright.sync_api import Page, sync_playwright

import sweep

MAP = {
    "friction": {"mu": {"start": 20, "stop": 200, "num": 64}},
    "body": {"b": {"start": 1.2, "stop": 9.8, "num": 64}},
    "integrator": {"estimate_errors": False},
    "measure": ["reversals"],
}

MOVED = """([name, place]) => new Promise((resolve) => {
    const page = Bokeh.documents[0], source = page.get_model_by_name('map').children[0].renderers[0].data_source
    const began = performance.now(), seen = []
    const drawn = () => requestAnimationFrame(() => setTimeout(() => {
        seen.push((performance.now() - began) / 1000)
        if (seen.length < 2) return
        source.properties.data.change.disconnect(drawn)
        resolve(seen)
    }))
    source.properties.data.change.connect(drawn)
    page.get_model_by_name(name).value = place
})"""
"""Moves a slider; gives the seconds until the page has drawn the next two maps."""


def moved(page: Page, times: int) -> list[tuple[float, float]]:
    """The seconds of each move, after one that may compile."""
    places = [0.3, *(0.1 * (-1) ** k * (1 + k / times) for k in range(times))]
    found = []
    for place in places:
        found.append(tuple(page.evaluate(MOVED, ["body delta", place])))
        page.wait_for_timeout(100)
    return found[1:]


def main(times: int = 7) -> None:
    """Print a line for each move, and the medians."""
    with TemporaryDirectory() as folder:
        file = Path(folder) / "map.nc"
        sweep.run(MAP, name="map").to_netcdf(file)
        command = [sys.executable, "-m", "sweep", "explore", str(file), "--no-browser"]
        with subprocess.Popen(command, stdout=subprocess.PIPE, text=True) as server, sync_playwright() as driver:
            assert server.stdout
            address = re.search(r"http://localhost:\d+/", server.stdout.readline())
            assert address
            page = driver.chromium.launch(executable_path="/usr/bin/chromium").new_page()
            page.set_default_timeout(120_000)
            page.goto(address[0])
            page.wait_for_function("window.Bokeh?.documents[0]?.is_idle")
            found = moved(page, times)
            server.terminate()
    for first, all_ in found:
        print(f"first counts {first:.2f} s, all foreseen {all_:.2f} s")
    print("medians:", *(f"{statistics.median(each):.2f} s" for each in zip(*found, strict=True)))


if __name__ == "__main__":
    main(*map(int, sys.argv[1:]))
