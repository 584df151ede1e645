"""What is taken from inside Numba may go with any of its versions, which `pyproject.toml` bounds."""

import ast

from support import ROOT
from support.processes import python


def test_one_module_alone_looks_inside_numba() -> None:
    for path in (ROOT / "sweep").rglob("*.py"):
        nodes = ast.walk(ast.parse(path.read_text(encoding="utf-8")))
        names = [node.module or "" for node in nodes if isinstance(node, ast.ImportFrom)]
        inside = any(name.startswith("numba.core") for name in names)
        assert inside == (path == ROOT / "sweep" / "jit.py"), path


def test_a_compiling_process_makes_machine_code_only_of_what_python_calls() -> None:
    said = python("-c", """
from numba.core.codegen import JITCodeLibrary
from sweep.jit import compile_for_disk, compiled, called

made = []
JITCodeLibrary._object_compiled_hook = lambda module, _: made.append(module.name)
compile_for_disk()

@called
def inner(x):
    return 2.0 * x

@compiled
def outer(x):
    return inner(x) + inner(x + 1.0)

outer.compile("(f8,)")
print(*made)
""").stdout  # fmt: skip
    assert "outer" in said
    assert "inner" not in said
