"""Draws the page of the explorer, as a visitor sees it who has run two cells; needs the extra `browser`.

python -m sweep run configs/quick.yaml
python scripts/explore_picture.py runs/quick/quick.nc docs/_static/explore.png
"""

from __future__ import annotations

import signal
import subprocess
import sys

from playwright.sync_api import sync_playwright

QUERY = "x=mu&y=b&show=reversals&n0=0.05&cell=b:5.10909090909,mu:100&cell=b:3.5,mu:160"
NAMED = "Bokeh.documents[0].get_model_by_name"


def main(dataset: str, path: str) -> None:
    command = [sys.executable, "-m", "sweep", "explore", dataset, "--no-browser"]
    with subprocess.Popen(command, stdout=subprocess.PIPE, text=True) as explorer, sync_playwright() as playwright:
        address = explorer.stdout.readline().split()[-1]
        browser = playwright.chromium.launch(executable_path="/usr/bin/chromium", args=["--no-sandbox"])
        page = browser.new_page(viewport={"width": 1100, "height": 1040})
        page.goto(f"{address}?{QUERY}")
        ran = f"{NAMED}('curve legend')?.items.filter((item) => /reversals$/.test(item.label.value)).length == 2"
        page.wait_for_function(ran, timeout=600_000)
        page.evaluate(f"{NAMED}('time').value = 700")
        page.focus("#map")
        for key in 5 * ["ArrowRight"] + 6 * ["ArrowUp"]:
            page.keyboard.press(key)
        page.locator("#cell").get_by_text("b = 5.10909").wait_for()
        page.wait_for_timeout(1000)
        page.screenshot(path=path, full_page=True)
        explorer.send_signal(signal.SIGINT)


if __name__ == "__main__":
    main(*sys.argv[1:])
