"""How fast the explorer is, in chromium: seconds to the first map, to another map, and from a click to its curve.

    python scripts/explorer_speed.py [CELLS_A_SIDE …]

Needs the extra `browser` and Debian's chromium.  The datasets are synthetic: counts of a small sweep, spread over a
larger grid; what is measured does not depend on their values.
"""

from __future__ import annotations

import re
import subprocess
import sys
import tempfile
import time
from pathlib import Path
from typing import Any

import numpy as np
import xarray as xr
from playwright.sync_api import Page, sync_playwright

import sweep

TEXT = """\
name: speed
body: {a: 10.0, b: {start: 1.2, stop: 9.8, num: 12}, delta: 0.03}
friction: {mu: {start: 20, stop: 200, num: 10}}
integrator: {t_end: 10000}
"""

MAP = "Bokeh.documents[0].get_model_by_name('map').children[0]"

PAINTED = f"window.Bokeh?.documents[0]?.is_idle && {MAP}.renderers[2].data_source.data.image[0].length > 4"

DRAWN = "Bokeh.documents[0].get_model_by_name('curve legend').items[0].label.value"

FRAMES = f"""async () => {{
    const range = {MAP}.x_range, [start, end] = [range.start, range.end], began = performance.now()
    for (let k = 1; k <= 30; k++) {{
        range.setv({{start: start + (k * (end - start)) / 100, end}})
        await new Promise(requestAnimationFrame)
    }}
    return (performance.now() - began) / 30
}}"""


def enlarged(dataset: xr.Dataset, side: int) -> xr.Dataset:
    """The dataset on a grid of side × side cells, each with the values of the nearest old one."""
    axes = {d: np.linspace(dataset[d].values[0], dataset[d].values[-1], side) for d in ("mu", "b")}
    attributes = {d: dataset[d].attrs for d in axes}
    large = dataset.sel(axes, method="nearest")
    return large.assign_coords({d: (d, values, attributes[d]) for d, values in axes.items()})


def timed(page: Page, condition: str) -> float:
    began = time.perf_counter()
    page.wait_for_function(condition, timeout=120_000)
    return time.perf_counter() - began


def measure(browser: Any, file: Path) -> dict[str, float]:
    """Seconds and milliseconds, by what takes them."""
    command = [sys.executable, "-m", "sweep", "explore", str(file), "--no-browser"]
    began = time.perf_counter()
    with subprocess.Popen(command, stdout=subprocess.PIPE, text=True) as process:
        assert process.stdout
        address = re.search(r"http://\S+", process.stdout.readline())
        assert address
        found = {"start of the command, s": time.perf_counter() - began}
        page = browser.new_page(viewport={"width": 1400, "height": 950})
        began = time.perf_counter()
        page.goto(address[0])
        timed(page, PAINTED)
        found["address to map, s"] = time.perf_counter() - began
        page.reload()
        began = time.perf_counter()
        page.reload()
        timed(page, PAINTED)
        found["address to map again, s"] = time.perf_counter() - began
        page.get_by_role("button", name="difference").click()
        found["another map, s"] = timed(page, f"{MAP}.title.text === 'simulated − predicted'")
        found["a frame while zooming, ms"] = page.evaluate(FRAMES)
        time.sleep(5)  # until the first stretch of a trajectory, which is run to warm up, is over
        box = page.locator("#map canvas").first.bounding_box()
        for k in range(3):
            before = page.evaluate(DRAWN)
            page.mouse.click(box["x"] + box["width"] * (0.3 + 0.2 * k), box["y"] + box["height"] / 2)
            found[f"click {k + 1} to curve, s"] = timed(
                page, f"/reversals?( …)?$/.test({DRAWN}) && {DRAWN} !== {before!r}"
            )
            found[f"click {k + 1} to its end, s"] = timed(page, f"/reversals?$/.test({DRAWN})")
        page.close()
        process.kill()
    return found


def main(sides: list[int]) -> None:
    """Print a table."""
    with tempfile.TemporaryDirectory() as folder, sync_playwright() as playwright:
        config = Path(folder, "speed.yaml")
        config.write_text(TEXT, encoding="utf-8")
        small = sweep.run(config)
        browser = playwright.chromium.launch(
            executable_path="/usr/bin/chromium", args=["--no-sandbox", "--disable-gpu"]
        )  # fmt: skip
        results = {}
        for side in sides:
            file = Path(folder, f"{side}.nc")
            enlarged(small, side).to_netcdf(file)
            results[side * side] = measure(browser, file)
        browser.close()
    print("| | " + " | ".join(f"{cells} cells" for cells in results) + " |")
    print("|---|" + "---|" * len(results))
    for name in next(iter(results.values())):
        print(f"| {name} | " + " | ".join(f"{found[name]:.2g}" for found in results.values()) + " |")


if __name__ == "__main__":
    main([int(side) for side in sys.argv[1:]] or [32, 1000])
