"""The general equations beside those that SymPy derives by Kane's method."""

import pytest
from support.kane import difference
from support.newton import LAWS


@pytest.mark.parametrize("couples", [(), ("sigma", "rolling")], ids="+".join)
@pytest.mark.parametrize("law", [*LAWS, None])
def test_the_equations_are_those_of_kane(law: str | None, couples: tuple[str, ...]) -> None:
    assert difference(law, couples, trials=40) < 1e-12
