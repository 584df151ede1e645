"""What README and docs show works: commands, Python, configurations, links, paths and names; and what they say is so.

Everyday tests read the pages.  A campaign runs the code of each page, as `docs/renew.py` does, and compares what it
prints and draws with what stands there.
"""

import ast
import pkgutil
import re
import runpy
import shlex
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import pytest
from matplotlib.testing.compare import compare_images
from support import ROOT

import sweep
from sweep.cli import main

RENEW = runpy.run_path(str(ROOT / "docs" / "renew.py"))
PAGES: list[Path] = RENEW["PAGES"]

_LINK = re.compile(r"!?\[[^\]]*\]\((?P<target>[^)\s]+)\)")
_PATH = re.compile(r"`(?P<path>(?:\.ci|configs|data|docs|scripts|sweep|tests)/[\w./*-]*)`")
_NAME = re.compile(r"`(?P<name>sweep(?:\.[A-Za-z_]\w*)+)(?:\(\))?`")


def _name(page: Path) -> str:
    return str(page.relative_to(ROOT).with_suffix(""))


@dataclass(frozen=True)
class Block:
    page: Path
    line: int
    kind: str
    text: str
    mark: str | None

    def __str__(self) -> str:
        return f"{self.page.relative_to(ROOT)}:{self.line}"


def blocks(*kinds: str) -> Iterator[Block]:
    for page in PAGES:
        text = page.read_text(encoding="utf-8")
        for part in RENEW["PART"].finditer(text):
            if part["kind"] in kinds:
                yield Block(page, text.count("\n", 0, part.start("kind")) + 1, part["kind"], part["text"], part["mark"])


def commands() -> Iterator[tuple[str, list[str]]]:
    """Every command of sweep that stands on a line of its own in a block, with its place."""
    for block in blocks("console", "text", ""):
        for line in block.text.splitlines():
            words = shlex.split(line.removeprefix("$ "), comments=True) if "sweep " in line else []
            if words[:3] == ["python", "-m", "sweep"] or (line.startswith("$ ") and words[:1] == ["sweep"]):
                yield f"{block}: {line}", words[words.index("sweep") + 1 :]


def test_commands_have_the_options_that_pages_give_them() -> None:
    found = list(commands())
    assert len(found) > 50
    for place, (name, *words) in found:
        known = {option for parameter in main.commands[name].params for option in parameter.opts} | {"--help", "-h"}
        assert not {word.partition("=")[0] for word in words if word.startswith("--")} - known, place


def test_programs_are_python() -> None:
    for block in blocks("python"):
        ast.parse(block.text, str(block))


def test_configurations_are_valid(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    files = {}
    for page in PAGES:
        for part in RENEW["PART"].finditer(page.read_text(encoding="utf-8")):
            if part["mark"] == "file":
                files[part["about"]] = part["text"]
    for name, text in files.items():
        Path(name).write_text(text, encoding="utf-8")
    for block in blocks("yaml"):
        text = block.text if "friction" in block.text else f"{block.text}friction: {{mu: 60}}\n"
        known = re.search(r"^(model: .*\.py|cases: .*\.csv)$", text, re.MULTILINE)
        sweep.load_config(_written(block.text if known else text, tmp_path, block))


def _written(text: str, folder: Path, block: Block) -> Path:
    path = folder / f"line{block.line}.yaml"
    path.write_text(text, encoding="utf-8")
    return path


_LOOKED_AT = {"explore", "check"}
"""Pages that a person looks at: a browser draws pictures of trajectories that run meanwhile; and a map of errors shows
cells that round-off decides, which differ between types of CPUs."""

_VARYING = re.compile(
    r"\d[\d.]*( to \d[\d.]*)? (s|min|ms|h|MiB|MB|trajectories/s)\b|\d[\d.]*e[-+]?\d+|\d+\.\d+\.\d+|20\d\d-\d\d-\d\d\S*"
)
"""What differs between machines and days: times, sizes, errors and versions."""

_NUMBER = re.compile(r"\d+(?:\.\d+)?")


_LONG = {"boundaries"}
"""A page whose searches take more than a minute; `tests/studies/test_boundaries.py` has shorter ones."""

_RENEWED = [
    pytest.param(page, marks=pytest.mark.release if page.stem in _LONG else pytest.mark.campaign, id=_name(page))
    for page in PAGES
    if page.stem not in _LOOKED_AT
]


@pytest.mark.parametrize("page", _RENEWED)
def test_what_a_page_shows_is_what_its_code_gives(page: Path, tmp_path: Path) -> None:
    """To renew it: `python docs/renew.py PAGE`."""
    text = RENEW["renewed"](page, tmp_path)
    shown, found = (_VARYING.sub("some", each) for each in (page.read_text(encoding="utf-8"), text))
    assert _NUMBER.sub("#", shown) == _NUMBER.sub("#", found)
    numbers = [[float(number) for number in _NUMBER.findall(each)] for each in (shown, found)]
    # On another type of CPU a late reversal, or one cell, may be counted otherwise.
    assert numbers[0] == pytest.approx(numbers[1], rel=0.05, abs=1)
    for drawn in tmp_path.iterdir():
        stored = ROOT / "docs" / "_static" / drawn.name
        # Letters may be rendered a little differently.
        assert drawn.suffix != ".png" or compare_images(str(stored), str(drawn), tol=10) is None


@pytest.mark.parametrize("page", PAGES, ids=_name)
def test_tables_are_those_of_the_program(page: Path) -> None:
    """To renew them: `python docs/renew.py PAGE`."""
    text = page.read_text(encoding="utf-8")
    assert text == RENEW["with_tables"](text)


def test_a_planted_difference_in_a_table_is_found() -> None:
    text = (ROOT / "docs/reference/dataset.md").read_text(encoding="utf-8")
    planted = text.replace("| `settled` |", "| `at rest` |")
    assert planted != text == RENEW["with_tables"](planted)


def test_every_stored_picture_stands_on_a_page() -> None:
    text = "".join(page.read_text(encoding="utf-8") for page in PAGES)
    stored = [path for path in (ROOT / "docs" / "_static").iterdir() if path.suffix in (".png", ".gif", ".svg")]
    assert not [path.name for path in stored if f"_static/{path.name})" not in text]


@pytest.mark.parametrize("page", [*PAGES, ROOT / "data" / "README.md", ROOT / "scripts" / "LOG.md"], ids=_name)
def test_links_paths_and_names_lead_somewhere(page: Path) -> None:
    text = page.read_text(encoding="utf-8")
    targets = [m["target"] for m in _LINK.finditer(text) if "://" not in m["target"]]
    lost = [target for target in targets if not _leads_somewhere(page, target)]
    lost += [m["path"] for m in _PATH.finditer(text) if not list(ROOT.glob(m["path"].rstrip("/")))]
    lost += [m["name"] for m in _NAME.finditer(text) if not _exists(m["name"])]
    assert not lost


def _leads_somewhere(page: Path, target: str) -> bool:
    """Whether a file exists, and has the heading that the link names."""
    name, _, heading = target.partition("#")
    path = page.parent / name if name else page
    return path.exists() and (not heading or heading in _anchors(path))


def _anchors(page: Path) -> set[str]:
    """The anchors of the headings of a page, as GitHub and Sphinx write them."""
    headings = re.findall(r"^#+ (.*)$", page.read_text(encoding="utf-8"), re.MULTILINE)
    return {re.sub(r"[^\w\- ]", "", heading.lower()).replace(" ", "-") for heading in headings}


def _exists(name: str) -> bool:
    """Whether a module, or a public name of one, can be imported."""
    try:
        pkgutil.resolve_name(name)
    except (ImportError, AttributeError):
        return False
    return True


_SPHINX = re.compile(r"^ *(```|:::)\{|\{(doc|ref|term|py:\w+)\}`|^\([\w-]+\)=$|^---\nfile_format", re.MULTILINE)


@pytest.mark.parametrize("page", PAGES, ids=_name)
def test_pages_can_be_read_without_sphinx(page: Path) -> None:
    assert not _SPHINX.search(page.read_text(encoding="utf-8"))


def test_pages_that_the_code_cites_exist() -> None:
    cited = re.compile(r"\b(?:docs|data|scripts)/[\w/-]+\.(?:md|csv|py|png)\b|\w*design/\w+\.md")
    sources = [path for folder in ("sweep", "tests", "scripts") for path in (ROOT / folder).rglob("*.py")]
    found = {match for path in sources for match in cited.findall(path.read_text(encoding="utf-8"))}
    assert not {path for path in found if not (ROOT / path).exists() and not (ROOT / "sweep/bench" / path).exists()}


def test_the_readme_has_the_two_commands() -> None:
    """`.ci/run` and every user take them from there, word for word."""
    start = "python3 -m venv .venv && .venv/bin/pip install -q -e "
    text = (ROOT / "README.md").read_text(encoding="utf-8")
    assert f"{start}. && .venv/bin/python -m sweep run configs/mu_b.yaml\n" in text
    assert f"{start}'.[test]' && .venv/bin/python -m pytest\n" in text


@pytest.mark.parametrize(("name", "words"), [("mu_b", "the {} trajectories"), ("quick", "# {} trajectories")])
def test_the_readme_says_how_large_a_sweep_is(name: str, words: str) -> None:
    cells = sweep.predict(ROOT / "configs" / f"{name}.yaml").reversals_predicted.size
    assert words.format(cells) in (ROOT / "README.md").read_text(encoding="utf-8")


@pytest.mark.parametrize("page", ["data/README.md", "docs/explanation/accuracy.md"])
def test_tables_of_reference_have_as_many_cells_as_is_said(page: str) -> None:
    rows = re.compile(r"^\|[^\n]*?(reference\w+\.csv)`[^\n]*?(\d+) (?:random )?cells", re.MULTILINE)
    said = rows.findall((ROOT / page).read_text(encoding="utf-8"))
    assert said
    for name, cells in said:
        table = next(path for path in (ROOT / "data" / name, ROOT / "sweep" / "bench" / "data" / name) if path.exists())
        columns = np.genfromtxt(table, delimiter=",", names=True, dtype=None, encoding="utf-8")
        given = [n for n in ("model", "a", "b", "c", "delta", "mu", "n0", "x0", "y0") if n in columns.dtype.names]
        assert len({str(row) for row in columns[given]}) == int(cells), name


def test_every_configuration_stands_in_the_reference() -> None:
    page = (ROOT / "docs" / "reference" / "configuration.md").read_text(encoding="utf-8")
    assert not [path.name for path in (ROOT / "configs").glob("*.yaml") if f"`configs/{path.name}`" not in page]


def test_the_finding_says_how_far_the_formula_is_off() -> None:
    said = re.search(r"(\d+) to (\d+) %", (ROOT / "docs/tutorial/finding.md").read_text(encoding="utf-8"))
    assert said
    line = sweep.predict(ROOT / "configs" / "mu.yaml")
    ratios = (line.n_c1_linear / line.n_c1).values
    assert [int(number) for number in said.groups()] == [round(100 * (1 - 1 / r)) for r in (ratios.min(), ratios.max())]
