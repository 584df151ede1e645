"""What `sweep.jit` takes from inside Numba, which may go with any of its versions: `pyproject.toml` bounds these."""

import ast
import operator
from pkgutil import resolve_name

import pytest
from numba import njit
from numba.core.caching import FunctionCache
from support import ROOT

PRIVATE = [
    "numba.core.bytecode:FunctionIdentity._unique_ids",
    "numba.core.caching:FunctionCache._index_key",
    "numba.core.caching:FunctionCache.cache_path",
    "numba.core.caching:FunctionCache.save_overload",
    "numba.core.caching:IndexDataCacheFile._data_path",
    "numba.core.caching:IndexDataCacheFile._load_index",
    "numba.core.registry:cpu_target.target_context.codegen",
    "numba.core.registry:cpu_target.target_context.get_dummy_value",
    "numba.core.registry:cpu_target.target_context.refresh",
    "numba.core.codegen:JITCPUCodegen.magic_tuple",
]


@pytest.mark.parametrize("name", PRIVATE)
def test_numba_still_has_it(name: str) -> None:
    resolve_name(name)


def test_dispatchers_and_caches_still_have_it() -> None:
    operator.attrgetter("_cache", "py_func", "signatures")(njit(resolve_name))
    operator.attrgetter("_cache_file", "_impl.filename_base")(FunctionCache(resolve_name))


def test_one_module_alone_looks_inside_numba() -> None:
    """The list above is of what that module takes."""
    for path in (ROOT / "sweep").rglob("*.py"):
        nodes = ast.walk(ast.parse(path.read_text(encoding="utf-8")))
        names = [node.module or "" for node in nodes if isinstance(node, ast.ImportFrom)]
        inside = any(name.startswith("numba.core") for name in names)
        assert inside == (path == ROOT / "sweep" / "jit.py"), path
