"""The report of the paper's numbers, and that any wrong coefficient shows in it."""

import re
from collections.abc import Callable, Iterable
from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest
from support.cli import invoke

from sweep.models import MODELS
from sweep.models.ladder import analytic
from sweep.models.theory import coefficients
from sweep.report import rows
from sweep.report.rows import Section
from sweep.reproduce import report, simulations, theory
from sweep.reproduce.rows import against_paper, published

GROUPS: dict[str, Callable[[], Iterable[Any]]] = {
    "slip": theory._slip_rows,
    "noslip": theory._rolling_rows,
    "effective": theory._reduced_rows,
    "averaged": theory._reduced_rows,
}


def failures(group: Callable[[], Iterable[Any]]) -> list[str]:
    return [row.what for row in group() if not row.holds]


# One coefficient of each kind: shape, inertia and friction, or frequency, coupling and friction.
@pytest.mark.campaign
@pytest.mark.parametrize(
    ("name", "index"),
    [("slip", 0), ("slip", 4), ("slip", 9), ("slip", 10), ("noslip", 1), ("noslip", 5), ("effective", 2),
     ("effective", 6), ("effective", 9), ("averaged", 0), ("averaged", 1), ("averaged", 2), ("averaged", 3)],
)  # fmt: skip
def test_a_wrong_coefficient_of_a_model_is_found(name: str, index: int, monkeypatch: pytest.MonkeyPatch) -> None:
    right = MODELS[name]

    class Wrong(right.constants):  # type: ignore[name-defined, misc]
        @classmethod
        def of(cls, columns: Any) -> Any:
            values = list(right.constants.of(columns))
            values[index] = 1.1 * values[index]
            return right.constants(*values)

    monkeypatch.setitem(MODELS, name, replace(right, constants=Wrong))
    assert failures(GROUPS[name])


def test_a_wrong_coefficient_of_the_formulas_is_found(monkeypatch: pytest.MonkeyPatch) -> None:
    def wrong(columns: Any) -> coefficients.Coefficients:
        k = coefficients.coefficients(columns)
        return k._replace(m1=1.01 * k.m1)

    monkeypatch.setattr(analytic, "coefficients", wrong)
    assert failures(lambda: theory.formulas().rows)


def test_the_exit_code_shows_whether_all_rows_hold(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    def two(holds: bool) -> Callable[[], Section]:
        return lambda: Section(
            "Two", [rows.below("one", "eq", 1.0, 2.0, "why"), rows.states("<two>", "eq", "a", "b", holds)]
        )

    monkeypatch.setattr(report, "SECTIONS", (theory.formulas, two(True)))
    assert invoke("reproduce", "--output", tmp_path).exit_code == 0
    monkeypatch.setattr(report, "SECTIONS", (theory.formulas, two(False)))
    result = invoke("reproduce", "--output", tmp_path)
    assert result.exit_code == 1
    assert "FAIL <two>" in result.stdout
    page = (tmp_path / "reproduce.html").read_text(encoding="utf-8")
    assert "does not hold" in page
    assert not re.search("https?:", page)  # letters alone occur in pictures by chance


@pytest.mark.campaign
def test_every_number_of_the_paper_is_in_a_row_that_holds(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    asked = set[str]()

    def noted(key: str, *row: Any) -> rows.Row:
        asked.add(key)
        return against_paper(key, *row)

    for module in (theory, simulations):
        monkeypatch.setattr(module, "against_paper", noted)
    result = invoke("reproduce", "--output", tmp_path)
    assert (result.exit_code, "FAIL" in result.stdout, asked) == (0, False, set(published()))
    assert (tmp_path / "reproduce.html").exists()
