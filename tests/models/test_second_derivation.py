"""The general equations beside those that SymPy derives by Kane's method."""

import runpy

import pytest
from support import ROOT
from support.newton import LAWS

KANE = runpy.run_path(str(ROOT / "scripts" / "derive_general.py"))


@pytest.mark.parametrize("couples", [(), ("sigma", "rolling")], ids="+".join)
@pytest.mark.parametrize("law", [*LAWS, None])
def test_the_equations_are_those_of_kane(law: str | None, couples: tuple[str, ...]) -> None:
    assert KANE["difference"](law, couples) < 1e-12
