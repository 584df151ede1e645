"""What decides the numbers of a run: every source that a run imports, and nothing that only asks for them or shows."""

import shutil
from pathlib import Path

import grimp
import pytest
from support import ROOT
from support.processes import python

from sweep.results import provenance


@pytest.fixture
def package(tmp_path: Path) -> Path:
    """A copy of the package, to be edited."""
    return Path(shutil.copytree(ROOT / "sweep", tmp_path / "sweep", ignore=shutil.ignore_patterns("__pycache__")))


def edit(path: Path, text: str = "# edited\n") -> None:
    with path.open("a", encoding="utf-8") as source:
        source.write(text)


@pytest.mark.parametrize("maker", ["sweep.engine.run", "sweep.studies.boundaries", "sweep.studies.critical"])
def test_what_the_maker_of_a_dataset_imports_decides(maker: str) -> None:
    """Found by another reader of imports."""
    graph = grimp.build_graph("sweep", cache_dir=None)
    for module in [name for name in graph.modules if name.startswith("sweep.plots")]:
        graph.remove_module(module)
    imported = {maker, *graph.find_upstream_modules(maker)}
    packages = {name.rpartition(".")[0] for name in imported} - {"sweep"}
    assert set(map(provenance.module_of, provenance.decisive_sources(maker))) == imported | packages


def test_an_edit_changes_the_hash_where_a_run_imports_it(package: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(provenance, "_PACKAGE", package)
    read = provenance.sources.__wrapped__  # a process reads them once

    def changed(name: str, text: str = "# edited\n") -> bool:
        before = read()
        paths = list(package.glob(name))
        assert paths
        for path in paths:
            edit(path, text)
        return read() != before

    new = package / "kernels" / "new.py"
    edit(new)
    assert not any(map(changed, ("explorer/*.py", "plots/*.py", "cli/*.py", "*i.py", "__init__.py", "kernels/new.py")))
    assert all(map(changed, ("config/schema.py", "engine/local.py", "kernels/adams/step.py", "models/user/loading.py")))
    assert changed("kernels/layout.py", "def later() -> None:\n    from sweep.kernels import (\n        new,\n    )\n")
    assert changed("kernels/new.py")


def test_a_run_of_edited_sources_is_refused(package: Path) -> None:
    """By the command itself; an edited widget and an edited picture are not what numbers depend on."""
    (package.parent / "c.yaml").write_text("model: analytic\nfriction: {mu: [40, 60]}\n", encoding="utf-8")

    def run(code: int = 0) -> str:
        return python("-m", "sweep", "run", "c.yaml", "--output", "out", folder=package.parent, code=code).stderr

    run()
    for room in ("explorer", "plots"):
        edit(package / room / "__init__.py")
    assert "already complete" in run()
    edit(package / "kernels" / "adams" / "step.py")
    assert "out/c.nc: not resumed, it comes from other sources of the model or kernel" in run(code=2)
