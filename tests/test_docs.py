"""What README and docs show works: commands, Python, configurations, links and paths.

Fenced blocks are run as they stand, page by page from top to bottom, in a folder with the configurations of
`configs/` on coarser grids: ```console (lines that begin with `$ `), ```python and ```{code-cell}; every ```yaml
must be a configuration; a ```{code-block} with a caption is a file.  A block that must not be run has a comment above
it that says why: <!-- not run: takes minutes -->.  With <!-- campaign: takes a minute --> it is run among the
campaigns alone.
"""

from __future__ import annotations

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
from ruamel.yaml import YAML
from support import ROOT

import sweep
from sweep.cli import main

PAGES = [ROOT / "README.md", ROOT / "docs" / "index.md", *sorted((ROOT / "docs").glob("[!_]*/*.md"))]


def _name(page: Path) -> str:
    return str(page.relative_to(ROOT).with_suffix(""))


_FENCE = re.compile(
    r"(?:<!-- (?P<when>not run|campaign): [^\n]+ -->\n+)?"
    r"^(?P<indent> *)```(?P<kind>\S*)\n(?P<text>.*?)^(?P=indent)```$",
    re.MULTILINE | re.DOTALL,
)
_LINK = re.compile(r"!?\[[^\]]*\]\((?P<target>[^)\s]+)\)")
_PATH = re.compile(r"`(?P<path>(?:\.ci|configs|docs|scripts|sweep|tests)/[\w./*-]*)`")


@dataclass(frozen=True)
class Block:
    page: Path
    line: int
    kind: str
    text: str
    when: str
    """Empty, "not run" or "campaign"."""

    def __str__(self) -> str:
        return f"{self.page.relative_to(ROOT)}:{self.line}"


def blocks(page: Path) -> Iterator[Block]:
    text = page.read_text(encoding="utf-8")
    for match in _FENCE.finditer(text):
        indent = len(match["indent"])
        lines = "".join(line[indent:] or "\n" for line in match["text"].splitlines(keepends=True))
        line = text.count("\n", 0, match.start("kind")) + 1
        yield Block(page, line, match["kind"], lines, match["when"] or "")


def commands(block: Block) -> list[str]:
    return [line[2:] for line in block.text.splitlines() if line.startswith("$ ")]


def _runs(page: Path, *when: str) -> list[Block]:
    kinds = ("console", "python", "{code-cell}", "yaml", "{code-block}")
    return [block for block in blocks(page) if block.kind in kinds and block.when in when]


def _coarsen(value: Any) -> Any:
    """The same configuration with axes of three values, without late times, and with one set of measurements, which
    spares a compilation."""
    if isinstance(value, dict):
        return {key: min(3, v) if key == "num" else _coarsen(v) for key, v in value.items()}
    return value


@pytest.fixture
def checkout(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[Path]:
    """A folder like the repository's, with small configurations."""
    yaml = YAML(typ="safe", pure=True)
    (tmp_path / "configs").mkdir()
    for path in (ROOT / "configs").glob("*.yaml"):
        small = _coarsen(yaml.load(path))
        small["integrator"] = {**small.get("integrator", {}), "t_end": 300}
        small.pop("measure", None)
        yaml.dump(small, tmp_path / "configs" / path.name)
    for path in (ROOT / "configs").glob("*.py"):
        shutil.copy(path, tmp_path / "configs")
    (tmp_path / "docs" / "tutorial").mkdir(parents=True)
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr(mpl, "rcParams", mpl.RcParams(mpl.rcParams | {"figure.max_open_warning": 0}))
    mpl.use("Agg")
    yield tmp_path
    plt.close("all")  # or the next page draws on


def _run_command(block: Block, command: str) -> None:
    words = shlex.split(command, comments=True)
    assert words[:3] == ["python", "-m", "sweep"], f"{block}: {command}: only sweep's own commands are run"
    result = CliRunner().invoke(main, words[3:])
    assert result.exit_code == 0, f"{block}: {command}\n{result.output}"


def _check_configuration(block: Block, folder: Path) -> None:
    text = block.text if "friction" in block.text else f"{block.text}friction: {{mu: 60}}\n"
    path = folder / f"line{block.line}.yaml"
    path.write_text(text, encoding="utf-8")
    sweep.load_config(path)


def _run_page(page: Path, checkout: Path, monkeypatch: pytest.MonkeyPatch, *when: str) -> None:
    names: dict[str, Any] = {}
    for block in _runs(page, *when):
        if block.kind == "console":
            for command in commands(block):
                _run_command(block, command)
        elif block.kind == "yaml":
            _check_configuration(block, checkout)
        elif block.kind == "{code-block}":
            head, _, text = block.text.partition("\n\n")
            (checkout / head.removeprefix(":caption: ")).write_text(text, encoding="utf-8")
        else:
            # Sphinx runs a notebook in its own folder.
            monkeypatch.chdir(checkout / "docs" / "tutorial" if block.kind == "{code-cell}" else checkout)
            exec(compile(block.text, str(block), "exec"), names)


@pytest.mark.parametrize("page", [page for page in PAGES if _runs(page, "")], ids=_name)
def test_what_a_page_shows_runs(page: Path, checkout: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    _run_page(page, checkout, monkeypatch, "")


@pytest.mark.campaign
@pytest.mark.parametrize("page", [page for page in PAGES if _runs(page, "campaign")], ids=_name)
def test_what_a_page_shows_runs_though_slow(page: Path, checkout: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    _run_page(page, checkout, monkeypatch, "", "campaign")


def test_console_blocks_hold_commands() -> None:
    empty = [str(b) for page in PAGES for b in blocks(page) if b.kind == "console" and not commands(b)]
    assert not empty


@pytest.mark.parametrize("page", PAGES, ids=_name)
def test_links_and_paths_lead_somewhere(page: Path) -> None:
    text = page.read_text(encoding="utf-8")
    targets = [m["target"].split("#")[0] for m in _LINK.finditer(text) if "://" not in m["target"]]
    lost = [target for target in targets if target and not (page.parent / target).exists()]
    lost += [m["path"] for m in _PATH.finditer(text) if not list(ROOT.glob(m["path"].rstrip("/")))]
    assert not lost


def test_the_readme_has_the_two_commands() -> None:
    """`.ci/run` and every user take them from there, word for word."""
    start = "python3 -m venv .venv && .venv/bin/pip install -q -e "
    text = (ROOT / "README.md").read_text(encoding="utf-8")
    assert f"{start}. && .venv/bin/python -m sweep run configs/mu_b.yaml\n" in text
    assert f"{start}'.[test]' && .venv/bin/python -m pytest\n" in text


def test_the_figures_in_the_notebook_are_those_of_its_text() -> None:
    """`docs/tutorial/finding.md` says 8 to 23 %."""
    line = sweep.predict(ROOT / "configs" / "mu.yaml")
    ratios = np.concatenate([line[f"{n}_linear"] / line[n] for n in ("n_c1_plus", "n_c1_minus")])
    assert (round(100 * (ratios.min() - 1)), round(100 * (ratios.max() - 1))) == (8, 23)
