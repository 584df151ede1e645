"""What decides the numbers of a run: every source that a run imports, and nothing that only shows them."""

from __future__ import annotations

import shutil
import subprocess
import sys
from pathlib import Path

import grimp
import pytest
from support import ROOT

from sweep.results import provenance

PACKAGE = ROOT / "sweep"
DECISIVE = {path.relative_to(PACKAGE).as_posix() for path in provenance.decisive_sources()}


def file_of(module: str) -> str:
    """Path of a module within the package."""
    path = PACKAGE.joinpath(*module.split(".")[1:])
    return (path / "__init__.py" if path.is_dir() else path.with_suffix(".py")).relative_to(PACKAGE).as_posix()


def test_every_module_that_a_run_imports_is_decisive() -> None:
    graph = grimp.build_graph("sweep", cache_dir=None)
    for module in [name for name in graph.modules if name.startswith("sweep.plots")]:
        graph.remove_module(module)
    imported = {"sweep.engine.run", *graph.find_upstream_modules("sweep.engine.run")}
    assert {"sweep.config.schema", "sweep.grid", "sweep.kernels.adams.step", "sweep.models.ladder.slip"} <= imported
    assert {file_of(module) for module in imported} <= DECISIVE


def test_what_only_asks_or_shows_is_not_decisive() -> None:
    assert not DECISIVE & {"cli/runs.py", "progress.py", "plots/maps.py", "studies/trajectory.py", "bench/report.py"}


@pytest.mark.parametrize(
    ("name", "decides"),
    [("config/schema.py", True), ("kernels/adams/step.py", True), ("new/room.py", True), ("plots/maps.py", False)],
)
def test_an_edit_changes_the_identity_of_a_run(
    name: str, decides: bool, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    copy = tmp_path / "sweep"
    shutil.copytree(PACKAGE, copy, ignore=shutil.ignore_patterns("__pycache__"))
    monkeypatch.setattr(provenance, "_PACKAGE", copy)
    sources = provenance.sources.__wrapped__  # a process reads them once
    before = sources()
    (copy / name).parent.mkdir(exist_ok=True)
    with (copy / name).open("a", encoding="utf-8") as source:
        source.write("# edited\n")
    assert (sources() != before) == decides


def test_a_run_of_edited_sources_is_refused(tmp_path: Path) -> None:
    """By the command itself, in a copy of the package."""
    shutil.copytree(PACKAGE, tmp_path / "sweep", ignore=shutil.ignore_patterns("__pycache__"))
    (tmp_path / "c.yaml").write_text("model: analytic\nfriction: {mu: [40, 60]}\n", encoding="utf-8")

    def run() -> tuple[int, str]:
        command = [sys.executable, "-m", "sweep", "run", "c.yaml", "--output", "out", "--quiet"]
        done = subprocess.run(command, cwd=tmp_path, capture_output=True, text=True, check=False)
        return done.returncode, done.stderr

    assert run() == (0, "")
    with (tmp_path / "sweep" / "kernels" / "adams" / "step.py").open("a", encoding="utf-8") as source:
        source.write("\n# edited\n")
    code, said = run()
    assert (code, "out/c.nc: not resumed, it comes from other sources of the model or kernel" in said) == (2, True)
