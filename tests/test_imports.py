"""Which foreign packages each room imports; how rooms import one another is for the contracts in `pyproject.toml`."""

import sys

import grimp
import pytest

NUMERIC = ["jit", "kernels", "models", "sources", "variables"]

FOREIGN = {
    "bokeh": {"explorer"},
    "click": {"cli"},
    "contourpy": {"axis"},
    "distributed": {"api", "engine", "studies"},
    "jinja2": {"explorer", "report"},
    "llvmlite": {"bench", "jit", "results"},
    "matplotlib": {"api", "bench", "explorer", "plots", "report", "reproduce"},
    "mpl_toolkits": {"explorer"},
    "netCDF4": {"results"},
    "numba": {"bench", "engine", "jit", "kernels", "results"},
    "pydantic": {"config", "results"},
    "pydantic_core": {"config"},
    "rich": {"progress"},
    "ruamel": {"config"},
    "scipy": {"config", "plots", "reproduce", "results", "studies"},
    "tornado": {"explorer"},
    "trimesh": {"config"},
    "xarray": {"api", "cli", "engine", "explorer", "plots", "reproduce", "results", "studies"},
}  # fmt: skip
"""The rooms that import each package; NumPy is for all."""


@pytest.fixture(scope="module")
def graph() -> grimp.ImportGraph:
    return grimp.build_graph("sweep", include_external_packages=True, cache_dir=None)


def foreign(graph: grimp.ImportGraph) -> dict[str, set[str]]:
    """The rooms that import each foreign package."""
    packages = {name for name in graph.modules if name.partition(".")[0] not in {"sweep", *sys.stdlib_module_names}}
    return {
        name: {module.split(".")[1] for module in graph.find_modules_that_directly_import(name)}
        for name in packages - {"numpy"}
    }


def beyond(graph: grimp.ImportGraph, rooms: list[str]) -> set[str]:
    """What these rooms import, in whatever way, besides NumPy, Numba and the standard library."""
    reached = set[str]().union(*(graph.find_upstream_modules(f"sweep.{room}", as_package=True) for room in rooms))
    own = {"sweep", "numpy", "numba", "llvmlite", *sys.stdlib_module_names}
    return {name.partition(".")[0] for name in reached} - own


def test_each_package_imports_only_the_libraries_listed_for_it(graph: grimp.ImportGraph) -> None:
    assert foreign(graph) == FOREIGN


def test_numeric_code_imports_numpy_and_numba_alone(graph: grimp.ImportGraph) -> None:
    assert beyond(graph, NUMERIC) == set()
    assert beyond(graph, ["axis"]) == {"contourpy"}
