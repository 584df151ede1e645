"""What `import sweep` offers: functions that no module of theirs hides, and modules that no function hides."""

from __future__ import annotations

import importlib
import types

import pytest

import sweep


@pytest.mark.parametrize(("name", "module"), [("run", "sweep.engine.run"), ("trajectory", "sweep.studies.trajectory")])
def test_functions_and_modules_of_one_name_do_not_hide_each_other(name: str, module: str) -> None:
    assert isinstance(importlib.import_module(module), types.ModuleType)
    room, _, _ = module.rpartition(".")
    assert isinstance(getattr(importlib.import_module(room), name), types.ModuleType)
    assert isinstance(getattr(sweep, name), types.FunctionType)


@pytest.mark.parametrize("name", sweep.__all__)
def test_every_public_name_is_there_and_documented(name: str) -> None:
    assert getattr(sweep, name).__doc__
