"""What decides the numbers of a run: every source that a run or study imports, and nothing that only shows them."""

import shutil
from pathlib import Path

import grimp
import pytest
from support import ROOT

from sweep.results import provenance


def test_what_the_makers_of_datasets_import_decides() -> None:
    graph = grimp.build_graph("sweep", cache_dir=None)
    for module in [name for name in graph.modules if name.startswith("sweep.plots")]:
        graph.remove_module(module)
    makers = ["sweep.engine.run", *(name for name in graph.modules if name.startswith("sweep.studies."))]
    imported = set(makers).union(*map(graph.find_upstream_modules, makers))
    decisive = {path.relative_to(ROOT).with_suffix("") for path in provenance.decisive_sources()}
    assert imported - {".".join(path.parts).removesuffix(".__init__") for path in decisive} == set()


def test_an_edit_changes_the_hash_where_it_can_change_numbers(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """In a copy of the package."""
    package = Path(shutil.copytree(ROOT / "sweep", tmp_path / "sweep", ignore=shutil.ignore_patterns("__pycache__")))
    monkeypatch.setattr(provenance, "_PACKAGE", package)
    read = provenance.sources.__wrapped__  # a process reads them once

    def changed(name: str) -> bool:
        before = read()
        with (package / name).open("a", encoding="utf-8") as stream:
            stream.write("# edited\n")
        return read() != before

    assert not any(map(changed, ("explorer/page.py", "plots/picture.py", "cli/runs.py", "bench/new.py")))
    assert all(map(changed, ("config/schema.py", "engine/local.py", "kernels/adams/new.py", "models/user/loading.py")))
