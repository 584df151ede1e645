"""What decides the numbers of a run: every source that a run imports, and nothing that only asks for them or shows."""

import shutil
from pathlib import Path

import grimp
import pytest
from support import ROOT

from sweep.results import provenance


@pytest.mark.parametrize("maker", ["sweep.engine.run", "sweep.studies.boundaries", "sweep.studies.critical"])
def test_what_the_maker_of_a_dataset_imports_decides(maker: str) -> None:
    """Found by another reader of imports."""
    graph = grimp.build_graph("sweep", cache_dir=None)
    for module in [name for name in graph.modules if name.startswith("sweep.plots")]:
        graph.remove_module(module)
    imported = {maker, *graph.find_upstream_modules(maker)}
    packages = {name.rpartition(".")[0] for name in imported} - {"sweep"}
    assert set(map(provenance.module_of, provenance.decisive_sources(maker))) == imported | packages


def test_an_edit_changes_the_hash_where_a_run_imports_it(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """In a copy of the package."""
    package = Path(shutil.copytree(ROOT / "sweep", tmp_path / "sweep", ignore=shutil.ignore_patterns("__pycache__")))
    monkeypatch.setattr(provenance, "_PACKAGE", package)
    read = provenance.sources.__wrapped__  # a process reads them once

    def changed(name: str, text: str = "# edited\n") -> bool:
        before = read()
        paths = list(package.glob(name))
        assert paths
        for path in paths:
            path.write_text(path.read_text(encoding="utf-8") + text, encoding="utf-8")
        return read() != before

    (package / "kernels" / "new.py").touch()
    assert not any(map(changed, ("explorer/*.py", "plots/*.py", "cli/*.py", "*i.py", "__init__.py", "kernels/new.py")))
    assert all(map(changed, ("config/schema.py", "engine/local.py", "kernels/adams/step.py", "models/user/loading.py")))
    assert changed("kernels/layout.py", "def later() -> None:\n    from sweep.kernels import (\n        new,\n    )\n")
    assert changed("kernels/new.py")
