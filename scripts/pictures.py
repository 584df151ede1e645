"""Renew the stored pictures of the README and of `docs/how-to/explore.md`; the build of the pages draws all others.

    pip install -e .[browser] && python scripts/pictures.py

writes map.png, reversal.gif and explore.png into `docs/_static`, within three minutes.  The last is a screenshot of the
explorer in Debian's chromium.
"""

from __future__ import annotations

from pathlib import Path

import matplotlib as mpl
from playwright.sync_api import sync_playwright

import sweep

ROOT = Path(__file__).parents[1]
STATIC, CONFIGS = ROOT / "docs" / "_static", ROOT / "configs"

PAGE = "?x=b&y=mu&n0=0.05&cell=mu:100,b:5.10909090909091,n0:0.05&cell=mu:80,b:1.981818181818182,n0:0.05"
"""The address of a page with two trajectories."""


def explorer() -> None:
    """Take a picture of the explorer, at a width that pages show without loss."""
    shown = sweep.explore(sweep.run(CONFIGS / "quick.yaml", progress=False))
    with sync_playwright() as playwright:
        browser = playwright.chromium.launch(executable_path="/usr/bin/chromium", args=["--no-sandbox"])
        page = browser.new_page(viewport={"width": 1250, "height": 900})
        page.goto(f"{shown.url}{PAGE}")
        page.wait_for_function("window.Bokeh?.documents[0]?.is_idle")
        page.wait_for_timeout(20_000)  # both trajectories have ended
        box = page.locator("#map").bounding_box()
        assert box
        page.mouse.move(box["x"] + 0.6 * box["width"], box["y"] + 330)
        page.wait_for_timeout(1000)
        page.screenshot(path=STATIC / "explore.png", full_page=True)
        browser.close()
    shown.close()


if __name__ == "__main__":
    with mpl.rc_context({"figure.dpi": 150}):  # as wide as a page, so that its text keeps its size there
        sweep.plot(sweep.run(CONFIGS / "mu_b.yaml", n0=0.05), width="220mm", title="", output=STATIC / "map.png")
    shapes = {"b": [2, 3, 4]}
    sweep.animate(CONFIGS / "mu.yaml", STATIC / "reversal.gif", at=shapes, mu=100, t_end=420, begin=100, speed=64)
    explorer()
