"""What is taken from inside Numba may go with any of its versions, which `pyproject.toml` bounds."""

import ast

from support import ROOT


def test_one_module_alone_looks_inside_numba() -> None:
    for path in (ROOT / "sweep").rglob("*.py"):
        nodes = ast.walk(ast.parse(path.read_text(encoding="utf-8")))
        names = [node.module or "" for node in nodes if isinstance(node, ast.ImportFrom)]
        inside = any(name.startswith("numba.core") for name in names)
        assert inside == (path == ROOT / "sweep" / "jit.py"), path
