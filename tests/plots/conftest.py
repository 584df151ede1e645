"""The pictures of the page on adding one."""

import re
from types import ModuleType
from typing import Any

import pytest
from support import ROOT

from sweep.plots import pictures, quantities
from sweep.plots.pictures.record import Picture


@pytest.fixture
def page(monkeypatch: pytest.MonkeyPatch) -> list[Picture]:
    """The pictures of the two blocks of code on the page, registered as those in files of their own."""
    text = (ROOT / "docs" / "how-to" / "add-picture.md").read_text(encoding="utf-8")
    found = list[Picture]()
    for block in re.findall(r"```python\n(.*?)```", text, re.DOTALL):
        module: Any = ModuleType("page")
        exec(block, module.__dict__)
        found += module.PICTURES
    for each in found:
        monkeypatch.setitem(pictures.PICTURES, each.name, each)
        monkeypatch.setitem(quantities.DERIVED, each.name, each.derive)
    return found
