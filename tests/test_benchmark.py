"""The benchmark in `data/benchmark`: its tables fit together, its scorer judges rightly, its example solves it.

`scripts/benchmark_references.py` made the tables.
"""

import re
import runpy
from pathlib import Path
from subprocess import CompletedProcess

import numpy as np
import pandas
import pytest
from support import ROOT
from support.processes import python

FOLDER = ROOT / "data" / "benchmark"


CASES, REFERENCES, REVERSALS = (
    pandas.read_csv(FOLDER / f"{name}.csv", dtype={"times": str}) for name in ("cases", "references", "reversals")
)


def _spins(case: str) -> pandas.Series:
    """The reference spins of a case, by time."""
    return REFERENCES[REFERENCES["case"] == case].set_index("t")["spin"]


def _score(folder: Path, lines: list[str], code: int = 0) -> CompletedProcess[str]:
    """What the scorer says to these answers, if there are any, without any package."""
    if lines:
        (folder / "answers.csv").write_text("\n".join(lines) + "\n", encoding="utf-8")
    return python("-I", "-S", FOLDER / "score.py", "answers.csv", folder=folder, code=code)


def test_every_case_has_its_references() -> None:
    assert list(CASES["case"]) == list(REFERENCES["case"].unique())
    for case, times in zip(CASES["case"], CASES["times"], strict=True):
        assert [float(t) for t in times.split()] == list(_spins(case).index)
    assert REFERENCES["error_bound"].between(0, 1e-11, inclusive="right").all()
    said = re.search(r"`cases.csv` \| (\d+) cases", (FOLDER / "README.md").read_text(encoding="utf-8"))
    assert said
    assert int(said[1]) == len(CASES)


def test_reversals_come_before_the_end_and_as_kane_and_levinson_found() -> None:
    rows = REVERSALS.fillna({"times": ""})
    times = {row.case: [float(t) for t in row.times.split()] for row in rows.itertuples()}
    for row in rows.itertuples():
        assert len(times[row.case]) == row.reversals
        assert all(0 < t < row.until for t in times[row.case])
    zeros = [times[f"kane_levinson_{name}"] for name in ("left", "left_damped", "right", "right_damped")]
    assert [[round(t, 3) for t in each] for each in zeros[:2]] == [[2.855], [2.556]]
    assert [round(t, 2) for t in zeros[2]] == [11.53]
    assert zeros[3] == []


def test_references_agree_with_those_of_128_bits() -> None:
    others = pandas.read_csv(ROOT / "sweep" / "bench" / "data" / "reference_spins.csv")
    same = ["model", "a", "b", "delta", "mu", "n0", "x0", "y0", "t"]
    both = CASES[CASES["model"] == "slip"].merge(REFERENCES, on="case").merge(others, on=same)
    assert len(both) > 40
    np.testing.assert_allclose(both["spin_x"], both["spin_y"], rtol=0, atol=1e-13)


@pytest.mark.parametrize(
    ("case", "end", "error"), [("mu60_b3", 50, 1e-10), ("mu10000_b4", 50, 1e-8), ("kane_levinson_left", 1, 1e-7)]
)
def test_the_example_agrees_with_the_references(case: str, end: float, error: float) -> None:
    example = runpy.run_path(str(FOLDER / "example_scipy.py"))
    chosen = example["read_cases"]()[case]
    chosen["times"] = [t for t in chosen["times"] if t <= end]
    np.testing.assert_allclose(example["solve"](chosen), [_spins(case)[t] for t in chosen["times"]], rtol=0, atol=error)


def test_the_scorer_finds_a_planted_error(tmp_path: Path) -> None:
    lines = ["case,t,spin,seconds,reversals"]
    for case in ("mu60_b3", "wide43"):
        lines += [f"{case},{t:g},{spin!r},0.5,1" for t, spin in _spins(case).items()]
    found = _score(tmp_path, lines)
    assert "within 1e-10: 2 of 2 cases" in found.stdout
    case, t, spin, *rest = lines[2].split(",")
    lines[2] = ",".join([case, t, repr(float(spin) + 1e-7), *rest])
    found = _score(tmp_path, lines)
    assert re.search(r"^mu60_b3 +4/4 +1\.0e-07 .* within 1e-06$", found.stdout, re.MULTILINE)
    assert "within 1e-08: 1 of 2 cases" in found.stdout
    del lines[2]
    assert re.search(r"^mu60_b3 +3/4 +inf .* NOT WITHIN 1e-06$", _score(tmp_path, lines).stdout, re.MULTILINE)


@pytest.mark.parametrize(
    ("lines", "message"),
    [
        ([], ": No such file or directory\n"),
        (["case,t"], "the first line must name the columns case, t, spin; spin missing"),
        (["case,t,spin"], "there are no answers in it"),
        (["case,t,spin", "mu60_b33,50,0.1"], "line 2: there is no case 'mu60_b33' in cases.csv"),
        (["case,t,spin", "mu60_b3,51,0.1"], "line 2: mu60_b3 has no reference at t = 51, but at 50, 100, 200, 400"),
        (["case,t,spin", "mu60_b3,50,fast"], "line 2: spin should be a number, not 'fast'"),
        (["case,t,spin", "mu60_b3,50,0.1", "mu60_b3,50,0.1"], "line 3: mu60_b3 at t = 50 is answered twice"),
    ],
)
def test_the_scorer_says_what_is_wrong_with_answers(tmp_path: Path, lines: list[str], message: str) -> None:
    said = _score(tmp_path, lines, code=1).stderr
    assert said.startswith("error: answers.csv")
    assert message in said
