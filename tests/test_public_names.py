"""What `import sweep` offers: functions that no module of theirs hides, and modules that no function hides."""

import ast
import doctest
import inspect
import re
import tomllib
from pathlib import Path

import pytest

import sweep


@pytest.mark.parametrize("name", sweep.__all__)
def test_every_public_name_is_documented_in_the_source(name: str) -> None:
    """`__doc__` would not do: a class without a docstring has that of its dataclass or of the class above it."""
    (node,) = ast.parse(inspect.getsource(getattr(sweep, name))).body
    assert isinstance(node, ast.FunctionDef | ast.ClassDef)
    said = ast.get_docstring(node)
    assert said, name
    if isinstance(node, ast.FunctionDef):
        taken = [*node.args.args, *node.args.kwonlyargs, *filter(None, [node.args.kwarg])]
        assert [each.arg for each in taken if not re.search(rf"^(\w+, )*{each.arg}\b.* : ", said, re.MULTILINE)] == []


@pytest.mark.parametrize("name", ["run", "boundaries", "critical", "trajectory", "open_dataset", "predict", "plot"])
def test_examples_in_docstrings_hold(name: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    (test,) = doctest.DocTestFinder(recurse=False).find(getattr(sweep, name), name, globs={"sweep": sweep})
    assert test.examples
    doctest.DebugRunner(verbose=False).run(test)


def test_the_version_is_the_one_that_datasets_record() -> None:
    project = tomllib.loads((Path(__file__).parents[1] / "pyproject.toml").read_text(encoding="utf-8"))["project"]
    assert sweep.__version__ == project["version"]
