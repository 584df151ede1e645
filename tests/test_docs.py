"""What README and docs show works: commands, Python, configurations, links, paths and names; and what they say is so.

Fenced blocks are run as they stand, page by page from top to bottom, in a folder with the configurations of
`configs/` on coarser grids: ```console (lines that begin with `$ `), ```python and ```{code-cell}; every ```yaml
must be a configuration; a ```{code-block} with a caption is a file.  A block that must not be run has a comment above
it that says why: <!-- not run: takes minutes -->.  It takes minutes, and is a campaign.

What a page shows as output is made when the pages are built, by ```{code-cell}, ```{console} and ```{python}.  A page
that has nothing else is run then alone.
"""

import pkgutil
import re
import shlex
import shutil
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import matplotlib as mpl
import matplotlib.pyplot as plt
import numpy as np
import pytest
from click.testing import CliRunner
from matplotlib.testing.compare import compare_images
from ruamel.yaml import YAML
from support import ROOT

import sweep
from sweep.cli import main

PAGES = [ROOT / "README.md", ROOT / "docs" / "index.md", *sorted((ROOT / "docs").glob("[!_]*/*.md"))]


def _name(page: Path) -> str:
    return str(page.relative_to(ROOT).with_suffix(""))


_FENCE = re.compile(
    r"(?P<skipped><!-- not run: [^\n]+ -->\n+)?"
    r"^(?P<indent> *)```(?P<kind>\S*)[^\n]*\n(?P<text>.*?)^(?P=indent)```$",
    re.MULTILINE | re.DOTALL,
)
_LINK = re.compile(r"!?\[[^\]]*\]\((?P<target>[^)\s]+)\)")
_PATH = re.compile(r"`(?P<path>(?:\.ci|configs|data|docs|scripts|sweep|tests)/[\w./*-]*)`")
_ROLE = re.compile(r"\{py:\w+\}`~?(?P<name>[\w.]+)`")
_NAME = re.compile(r"`(?P<name>sweep(?:\.[A-Za-z_]\w*)+)(?:\(\))?`")


@dataclass(frozen=True)
class Block:
    page: Path
    line: int
    kind: str
    text: str
    skipped: bool

    def __str__(self) -> str:
        return f"{self.page.relative_to(ROOT)}:{self.line}"


def blocks(page: Path) -> Iterator[Block]:
    text = page.read_text(encoding="utf-8")
    for match in _FENCE.finditer(text):
        indent = len(match["indent"])
        lines = "".join(line[indent:] or "\n" for line in match["text"].splitlines(keepends=True))
        line = text.count("\n", 0, match.start("kind")) + 1
        yield Block(page, line, match["kind"], lines, bool(match["skipped"]))


def commands(block: Block) -> list[str]:
    """Those of a block, which has no output: what is shown as output is made when the pages are built."""
    assert all(line.startswith("$ ") for line in block.text.splitlines()), block
    return [line[2:] for line in block.text.splitlines()]


def _runs(page: Path) -> list[Block]:
    """The blocks to run, none if building the pages runs all of them."""
    kinds = ("console", "{console}", "python", "{python}", "{code-cell}", "yaml", "{code-block}")
    found = [block for block in blocks(page) if block.kind in kinds and not block.skipped]
    return found if {block.kind for block in found} & {"console", "python", "yaml"} else []


def _coarsen(value: Any) -> Any:
    """The same configuration with axes of three values."""
    if isinstance(value, dict):
        return {key: min(3, v) if key in ("num", "samples") else _coarsen(v) for key, v in value.items()}
    return value


@pytest.fixture
def checkout(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[Path]:
    """A folder like the repository's, with small configurations: of coarse axes, without late times, and with the
    measurements that other tests have kernels for."""
    yaml = YAML(typ="safe", pure=True)
    (tmp_path / "configs").mkdir()
    for path in (ROOT / "configs").glob("*.yaml"):
        small = _coarsen(yaml.load(path))
        small["integrator"] = {**small.get("integrator", {}), "t_end": 10 if small.get("units") == "SI" else 300}
        if small.get("model") == "noslip" and small.get("units") == "SI":
            small["measure"] = ["reversals", {"reversal_times": 1}, "energy_error"]
        else:
            small.pop("measure", None)
        yaml.dump(small, tmp_path / "configs" / path.name)
    for path in (ROOT / "configs").iterdir():
        if path.suffix in (".py", ".csv"):
            shutil.copy(path, tmp_path / "configs")
    (tmp_path / "docs" / "tutorial").mkdir(parents=True)
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr("sweep.plots.animation.FRAMES_A_SECOND", 3)
    monkeypatch.setattr(mpl, "rcParams", mpl.RcParams(mpl.rcParams | {"figure.max_open_warning": 0}))
    mpl.use("Agg")
    yield tmp_path
    plt.close("all")  # or the next page draws on


def _run_command(block: Block, command: str) -> None:
    words = shlex.split(command, comments=True)
    assert words[:3] == ["python", "-m", "sweep"], f"{block}: {command}: only sweep's own commands are run"
    words, target = (words[:-2], words[-1]) if words[-2] == ">" else (words, "")
    result = CliRunner().invoke(main, words[3:])
    assert result.exit_code == 0, f"{block}: {command}\n{result.output}"
    if target:
        Path(target).write_text(result.stdout, encoding="utf-8")


def _check_configuration(block: Block, folder: Path) -> None:
    text = block.text if "friction" in block.text else f"{block.text}friction: {{mu: 60}}\n"
    path = folder / f"line{block.line}.yaml"
    path.write_text(text, encoding="utf-8")
    sweep.load_config(path)


@pytest.mark.campaign
@pytest.mark.parametrize("page", [page for page in PAGES if _runs(page)], ids=_name)
def test_what_a_page_shows_runs(page: Path, checkout: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    names: dict[str, Any] = {}
    found = _runs(page)
    if found[0].kind == "{code-cell}":  # Sphinx runs a notebook in its own folder
        folder = checkout / page.relative_to(ROOT).parent
        folder.mkdir(parents=True, exist_ok=True)
        monkeypatch.chdir(folder)
    for block in found:
        if block.kind in ("console", "{console}"):
            for command in commands(block):
                _run_command(block, command)
        elif block.kind == "yaml":
            _check_configuration(block, checkout)
        elif block.kind == "{code-block}":
            head, _, text = block.text.partition("\n\n")
            (checkout / head.removeprefix(":caption: ")).write_text(text, encoding="utf-8")
        else:
            code = re.sub(r"\A(:\w.*\n)+", "", block.text)
            exec(compile(code, str(block), "exec"), names)


_DRAWS = re.compile(r"python -m sweep (run|plot|trajectory|animate|critical|boundaries|fit|explore)\b(?!.*--dry)")
_OF_OTHER_THINGS = {"cluster", "develop", "reproduce", "resume"}
"""How-to pages whose commands draw, but which are about something else, or take minutes."""


@pytest.mark.parametrize("page", sorted((ROOT / "docs" / "how-to").glob("*.md")), ids=_name)
def test_how_to_pages_that_draw_show_a_figure_soon(page: Path) -> None:
    text = page.read_text(encoding="utf-8")
    figure = re.search(r"^```\{(picture|image|python)\}", text, re.MULTILINE)
    draws = bool(_DRAWS.search(text)) and page.stem not in _OF_OTHER_THINGS
    assert bool(figure) >= draws
    assert not figure or text.count("\n## ", 0, figure.start()) <= 1


@pytest.mark.parametrize("page", [*PAGES, ROOT / "data" / "README.md", ROOT / "scripts" / "LOG.md"], ids=_name)
def test_links_paths_and_names_lead_somewhere(page: Path) -> None:
    text = page.read_text(encoding="utf-8")
    targets = [m["target"].split("#")[0] for m in _LINK.finditer(text) if "://" not in m["target"]]
    lost = [target for target in targets if target and not (page.parent / target).exists()]
    lost += [m["path"] for m in _PATH.finditer(text) if not list(ROOT.glob(m["path"].rstrip("/")))]
    lost += [m["name"] for pattern in (_ROLE, _NAME) for m in pattern.finditer(text) if not _exists(m["name"])]
    assert not lost


def _exists(name: str) -> bool:
    """Whether a module, or a public name of one, can be imported."""
    try:
        pkgutil.resolve_name(name)
    except (ImportError, AttributeError):
        return False
    return True


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


@pytest.mark.campaign
def test_the_picture_of_the_readme_is_what_the_program_draws(tmp_path: Path) -> None:
    """To renew it: `python scripts/pictures.py`."""
    sweep.plot(sweep.run(ROOT / "configs" / "mu_b.yaml", n0=0.05), output=tmp_path / "map.png")
    # Letters may be rendered a little differently.
    assert compare_images(str(ROOT / "docs" / "_static" / "map.png"), str(tmp_path / "map.png"), tol=10) is None
