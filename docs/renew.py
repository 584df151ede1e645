"""Renew what the pages show: tables, what commands and programs print, and pictures.

    python docs/renew.py [PAGE ...]

Pages are plain Markdown, and building them runs nothing.  Comments in a page say what is renewed:

`<!-- made: NAME -->`: all up to `<!-- end -->` is made by `tables.MADE[NAME]` from the sources of the program.
`<!-- picture: FILE -->`: the image below is FILE, which the commands of the page have written; or the present figure of
    matplotlib if FILE is `plt`; or a screenshot of the explorer in Debian's chromium, for which the extra `browser` is
    needed, if FILE is `explorer`.
`<!-- file: NAME -->`: the block below is written to the file NAME.
`<!-- not run: REASON -->`: the block below is not run.

The commands and programs of a page run one after the other, in a folder of its own with the repository's `configs` and
`data`.  A ```console block with output gets the output of today, without progress, and so does a ```text block that
follows a ```python block.
"""

from __future__ import annotations

import contextlib
import io
import re
import shlex
import shutil
import subprocess
import sys
import tempfile
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import matplotlib as mpl
import matplotlib.pyplot as plt
from PIL import Image

sys.path[:0] = [str(Path(__file__).parent)]

from tables import MADE  # noqa: E402

ROOT = Path(__file__).parents[1]
STATIC = ROOT / "docs" / "_static"
PAGES = [ROOT / "README.md", ROOT / "docs" / "index.md", ROOT / "docs" / "gallery.md"]
PAGES += sorted((ROOT / "docs").glob("[!_]*/*.md"))

SETTINGS = "figure.figsize: 9.0, 4.5\n"
"""Of matplotlib: pictures are as wide as a page, so that their text can be read there."""

PART = re.compile(
    r"(?:^ *<!-- (?P<mark>not run|file|picture): (?P<about>[^\n]+?) -->\n+)?"
    r"(?:^(?P<indent> *)```(?P<kind>\w*)\n(?P<text>.*?)^(?P=indent)```$|^!\[[^\]]*\]\((?P<image>\S+)\)$)",
    re.MULTILINE | re.DOTALL,
)
_MADE = re.compile(r"(?<=^<!-- made: )(\w+)( -->\n).*?(?=^<!-- end -->$)", re.MULTILINE | re.DOTALL)
_EXPLORED = "?x=b&y=mu&n0=0.05&cell=mu:100,b:5.10909090909091,n0:0.05&cell=mu:80,b:1.981818181818182,n0:0.05"


def with_tables(text: str) -> str:
    return _MADE.sub(lambda match: f"{match[1]}{match[2]}{MADE[match[1]]()}\n", text)


def renewed(page: Path, pictures: Path) -> str:
    """Return the text of a page as it is today, and write its pictures into the folder `pictures`."""
    with tempfile.TemporaryDirectory() as folder, contextlib.chdir(folder), mpl.rc_context():
        for name in ("configs", "data"):
            shutil.copytree(ROOT / name, name, ignore=shutil.ignore_patterns("benchmark", "reference*"))
        Path("matplotlibrc").write_text(SETTINGS, encoding="utf-8")  # which commands read too
        mpl.rc_file("matplotlibrc")
        mpl.use("agg")
        text = "".join(_parts(with_tables(page.read_text(encoding="utf-8")), pictures))
    plt.close("all")
    return text


def _parts(text: str, pictures: Path) -> Iterator[str]:
    names: dict[str, Any] = {}
    printed, end = "", 0
    for part in PART.finditer(text):
        between = text[end : part.start()]
        end = part.end()
        yield between
        if part["mark"] == "file":
            Path(part["about"]).write_text(part["text"], encoding="utf-8")
        elif part["mark"] == "picture":
            _draw(part["about"], pictures / Path(part["image"]).name)
        elif part["mark"] is None and part["kind"] == "console":
            yield part[0].replace(part["text"], _console(part["text"]))
            continue
        elif part["mark"] is None and part["kind"] == "text" and printed and not between.strip():
            yield part[0].replace(part["text"], printed)
            continue
        if part["mark"] is None and part["kind"] == "python":
            with contextlib.redirect_stdout(io.StringIO()) as stream:
                exec(compile(part["text"], "<page>", "exec"), names)
            printed = stream.getvalue()
        yield part[0]
    yield text[end:]


def _console(block: str) -> str:
    """Run the commands of a block; return it with their output if it had any."""
    lines = block.splitlines()
    shows = not all(line.startswith("$ ") for line in lines)
    text = ""
    for line in lines:
        if line.startswith("$ "):
            output = _output(shlex.split(line[2:], comments=True))
            text += f"{line}\n{output if shows else ''}"
    return text


def _output(words: list[str]) -> str:
    assert words[:3] == ["python", "-m", "sweep"], words
    target = words[-1] if words[-2] == ">" else None
    command = [sys.executable, *words[1 : -2 if target else None]]
    done = subprocess.run(command, capture_output=True, text=True)
    if done.returncode:
        raise RuntimeError(f"{shlex.join(words)}\n{done.stdout}{done.stderr}")
    if target:
        Path(target).write_text(done.stdout, encoding="utf-8")
    return "" if target else done.stdout


def _draw(source: str, target: Path) -> None:
    if source == "plt":
        plt.savefig(target, bbox_inches="tight")
        plt.close("all")
    elif source == "explorer":
        _photograph(target)
    else:
        shutil.copy(source, target)
    if target.suffix == ".png" and source != "explorer":  # whose greys would turn pink
        all_colours = Image.open(target).convert("RGB")
        # A step of k-means gives each group of colours its own mean, and the cells of a map their own colour.
        few = all_colours.quantize(method=Image.Quantize.MAXCOVERAGE, kmeans=1, dither=Image.Dither.NONE)
        few.save(target, optimize=True)  # a third as large


def _photograph(target: Path) -> None:
    """Take a picture of the explorer with two trajectories, at a width that pages show without loss."""
    from playwright.sync_api import sync_playwright

    import sweep

    shown = sweep.explore(sweep.run("configs/quick.yaml", progress=False))
    with sync_playwright() as playwright:
        browser = playwright.chromium.launch(executable_path="/usr/bin/chromium", args=["--no-sandbox"])
        page = browser.new_page(viewport={"width": 1250, "height": 900})
        page.goto(f"{shown.url}{_EXPLORED}")
        page.wait_for_function("window.Bokeh?.documents[0]?.is_idle")
        page.wait_for_timeout(5000)  # both trajectories have begun
        while page.get_by_text("working on").locator("visible=true").count():
            page.wait_for_timeout(1000)
        box = page.locator("#map").bounding_box()
        assert box
        page.mouse.move(box["x"] + 0.6 * box["width"], box["y"] + 330)
        page.wait_for_timeout(1000)
        page.screenshot(path=target, full_page=True)
        browser.close()
    shown.close()


if __name__ == "__main__":
    for page in [Path(name).resolve() for name in sys.argv[1:]] or PAGES:
        page.write_text(renewed(page, STATIC), encoding="utf-8")
        print(page.relative_to(ROOT), flush=True)
