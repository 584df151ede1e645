"""The documentation as a reader meets it: built, and every page opened in chromium.

python -m pytest -m browser -n0 tests/test_pages.py
"""

from __future__ import annotations

import shlex
from collections.abc import Iterator
from pathlib import Path
from typing import TYPE_CHECKING

import pytest
from support import ROOT
from support.processes import python

if TYPE_CHECKING:
    from playwright.sync_api import Browser, BrowserContext

pytestmark = pytest.mark.browser

BUILD = ROOT / "build" / "docs"

# Typesetting is over, or its fault.
TYPESET = "window.MathJax?.startup?.promise.then(() => null, String)"

# How far text reaches to the right, but for formulas, tables and pictures that scroll by themselves.
WIDTH = """Math.max(...[...document.querySelectorAll('article :is(h1, p, li, dd, dt, pre, table)')]
    .filter(each => !each.closest('.table-wrapper, .math'))
    .map(each => each.getBoundingClientRect().right))"""


@pytest.fixture(scope="module")
def pages() -> list[Path]:
    """Every page, built by the command of docs/how-to/develop.md."""
    python(*shlex.split("-m sphinx -j auto -W --keep-going -q -b html docs build/docs"))
    return sorted(BUILD.rglob("*.html"))


@pytest.fixture(scope="module")
def offline(browser: Browser) -> Iterator[BrowserContext]:
    """A browser without a network."""
    with browser.new_context(offline=True) as context:
        yield context


def faults(offline: BrowserContext, path: Path) -> list[str]:
    """What goes wrong when a page is opened, and formulas that are not typeset."""
    said = list[str]()
    page = offline.new_page()
    page.on("console", lambda message: message.type in ("error", "warning") and said.append(message.text))
    page.on("pageerror", lambda error: said.append(str(error)))
    page.on("requestfailed", lambda request: said.append(f"not found: {request.url}"))
    page.on("request", lambda request: request.url.startswith("http") and said.append(f"not here: {request.url}"))
    page.goto(path.as_uri())
    if fault := page.evaluate(TYPESET):
        said.append(fault)
    written = path.read_text(encoding="utf-8").count('class="math ')
    typeset = page.locator("mjx-container:visible").count()
    if typeset != written:
        said.append(f"{typeset} of {written} formulas are typeset")
    if wrong := page.locator("mjx-container:has([data-mjx-error], [data-mml-node=merror])").count():
        said.append(f"{wrong} formulas are wrong")
    page.set_viewport_size({"width": 420, "height": 900})
    if (width := page.evaluate(WIDTH)) > 421:
        said.append(f"text reaches to {width:.0f} px on a page of 420 px")
    page.close()
    return said


def test_every_page_opens_with_all_its_formulas_and_without_a_network(
    pages: list[Path], offline: BrowserContext
) -> None:
    assert not {path.relative_to(BUILD): found for path in pages if (found := faults(offline, path))}


def test_options_keep_their_two_dashes(pages: list[Path]) -> None:  # noqa: ARG001
    text = (BUILD / "reference" / "commands.html").read_text(encoding="utf-8")
    assert "--fresh" in text
    assert "–fresh" not in text
