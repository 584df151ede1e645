"""A page for each room of the package: its modules and their docstrings, found in the tree at build time."""

from __future__ import annotations

import ast
from pathlib import Path
from typing import Any

from sphinx.application import Sphinx

_PACKAGE = Path(__file__).parents[2] / "sweep"


def _modules(folder: Path) -> list[str]:
    """Dotted names of the modules that `folder` holds, at any depth; an empty `__init__` is left out."""
    names = []
    for path in sorted(folder.rglob("*.py")):
        parts = path.relative_to(_PACKAGE.parent).with_suffix("").parts
        if parts[-1] == "__main__" or not ast.parse(path.read_text(encoding="utf-8")).body:
            continue
        names.append(".".join(parts[:-1] if parts[-1] == "__init__" else parts))
    return names


def _page(title: str, modules: list[str]) -> str:
    lines = [f"# {title}", ""]
    for name in modules:
        # Matplotlib gives each class of figures a `set` of its own, in markup of its own.
        directive = [f".. automodule:: {name}", "   :members:", "   :exclude-members: set", "   :ignore-module-all:"]
        lines += [f"## `{name}`", "", "```{eval-rst}", *directive, "```", ""]
    return "\n".join(lines)


def _write(app: Sphinx, _config: Any) -> None:
    rooms = sorted(path.parent for path in _PACKAGE.glob("*/__init__.py"))
    single = [f"sweep.{p.stem}" for p in sorted(_PACKAGE.glob("*.py")) if not p.stem.startswith("__")]
    pages = {room.name: _page(f"`sweep.{room.name}`", _modules(room)) for room in rooms}
    # The names of `sweep.api` are those of `sweep`, which has a page of its own.
    pages["single"] = _page("Single modules", [name for name in single if name != "sweep.api"])
    names = ["single", *(room.name for room in rooms)]
    about = "For those who change the program: every module and its docstrings."
    pages["index"] = "\n".join(["# Modules", "", about, "", "```{toctree}", ":maxdepth: 1", "", *names, "```", ""])
    folder = Path(app.srcdir) / "reference" / "rooms"
    folder.mkdir(exist_ok=True)
    for old in folder.glob("*.md"):
        if old.stem not in pages:
            old.unlink()
    for name, text in pages.items():
        path = folder / f"{name}.md"
        if not path.exists() or path.read_text(encoding="utf-8") != text:
            path.write_text(text, encoding="utf-8")


def setup(app: Sphinx) -> dict[str, bool]:
    app.connect("config-inited", _write)
    return {"parallel_read_safe": True}
