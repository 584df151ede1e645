"""The benchmark in `data/benchmark`: its tables fit together, its scorer judges rightly, its example solves it.

`scripts/benchmark_references.py` made the tables.
"""

import csv
import importlib.util
import re
import subprocess
import sys
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from support import ROOT, columns

from sweep.models.ladder import slip
from sweep.models.model import take

FOLDER = ROOT / "data" / "benchmark"


def _rows(name: str) -> list[dict[str, str]]:
    with (FOLDER / name).open(encoding="utf-8", newline="") as stream:
        return list(csv.DictReader(stream))


def _references() -> dict[str, dict[float, float]]:
    spins: dict[str, dict[float, float]] = {}
    for row in _rows("references.csv"):
        spins.setdefault(row["case"], {})[float(row["t"])] = float(row["spin"])
    return spins


@pytest.fixture(scope="module")
def example() -> Any:
    """The module `data/benchmark/example_scipy.py`."""
    spec = importlib.util.spec_from_file_location("example_scipy", FOLDER / "example_scipy.py")
    assert spec is not None
    assert spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


def _score(folder: Path, lines: list[str]) -> subprocess.CompletedProcess[str]:
    """What the scorer says to these answers, without any package."""
    (folder / "answers.csv").write_text("\n".join(lines) + "\n", encoding="utf-8")
    command = [sys.executable, "-I", "-S", FOLDER / "score.py", "answers.csv"]
    return subprocess.run(command, cwd=folder, capture_output=True, text=True, encoding="utf-8", check=False)


def test_every_case_has_its_references() -> None:
    cases, spins = _rows("cases.csv"), _references()
    assert [row["case"] for row in cases] == list(spins)
    for row in cases:
        assert [float(t) for t in row["times"].split()] == list(spins[row["case"]])
    assert all(0 < float(row["error_bound"]) <= 1e-11 for row in _rows("references.csv"))
    said = re.search(r"`cases.csv` \| (\d+) cases", (FOLDER / "README.md").read_text(encoding="utf-8"))
    assert said
    assert int(said[1]) == len(cases)


def test_reversals_come_before_the_end_and_as_kane_and_levinson_found() -> None:
    reversals = {row["case"]: row for row in _rows("reversals.csv")}
    for row in reversals.values():
        times = [float(t) for t in row["times"].split()]
        assert len(times) == int(row["reversals"])
        assert all(0 < t < float(row["until"]) for t in times)
    zeros = {
        name: reversals[f"kane_levinson_{name}"]["times"] for name in ("left", "right", "left_damped", "right_damped")
    }
    assert [round(float(zeros[name]), 3) for name in ("left", "left_damped")] == [2.855, 2.556]
    assert round(float(zeros["right"]), 2) == 11.53
    assert zeros["right_damped"] == ""


def test_references_agree_with_those_of_128_bits() -> None:
    def key(row: Any) -> tuple[float, ...]:
        return tuple(float(row[name]) for name in ("a", "b", "delta", "mu", "n0", "x0", "y0"))

    path = ROOT / "sweep" / "bench" / "data" / "reference_spins.csv"
    table = np.genfromtxt(path, delimiter=",", names=True, dtype=None, encoding="utf-8")
    others = {(key(row), float(row["t"])): float(row["spin"]) for row in table[table["model"] == "slip"]}
    spins, compared = _references(), 0
    for case in (row for row in _rows("cases.csv") if row["model"] == "slip"):
        for t, spin in spins[case["case"]].items():
            if (key(case), t) in others:
                compared += 1
                assert spin == pytest.approx(others[key(case), t], abs=1e-13)
    assert compared > 40


@pytest.mark.parametrize(
    ("case", "end", "error"), [("mu60_b3", 50, 1e-10), ("mu10000_b4", 50, 1e-8), ("kane_levinson_left", 1, 1e-7)]
)
def test_the_example_agrees_with_the_references(example: Any, case: str, end: float, error: float) -> None:
    chosen = example.read_cases()[case]
    chosen["times"] = [t for t in chosen["times"] if t <= end]
    np.testing.assert_allclose(
        example.solve(chosen), [_references()[case][t] for t in chosen["times"]], rtol=0, atol=error
    )


def test_the_equations_of_the_example_are_those_of_the_package(example: Any) -> None:
    y, constants = (0.1, -0.05, 0.2, 0.1, 0.3, 0.01, -0.02), take(slip.Constants.of(columns(mu=75.0)), 0)
    u1, u2, *omega, v1, v2 = y
    u = [u1, u2, -np.sqrt(1 - u1**2 - u2**2)]
    v_p = [v1, v2, -(v1 * u1 + v2 * u2) / u[2]]
    body = example.slipping_body({name: float(value[0]) for name, value in columns(mu=75.0).items()})
    _, x_p, _ = example.contact(u, omega, body[0], np)
    slopes = example.slipping([*u, *omega, *example.add(v_p, example.cross(x_p, omega))], body)
    expected, _ = slip.rhs(y, constants)
    np.testing.assert_allclose([*slopes[:2], *slopes[3:6]], expected[:5], rtol=1e-13)


def test_the_scorer_finds_a_planted_error(tmp_path: Path) -> None:
    lines = ["case,t,spin,seconds,reversals"]
    for case in ("mu60_b3", "wide43"):
        lines += [f"{case},{t:g},{spin!r},0.5,1" for t, spin in _references()[case].items()]
    found = _score(tmp_path, lines)
    assert found.returncode == 0
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
        (["case,t"], "the first line must name the columns case, t, spin; spin missing"),
        (["case,t,spin"], "there are no answers in it"),
        (["case,t,spin", "mu60_b33,50,0.1"], "line 2: there is no case 'mu60_b33' in cases.csv"),
        (["case,t,spin", "mu60_b3,51,0.1"], "line 2: mu60_b3 has no reference at t = 51, but at 50, 100, 200, 400"),
        (["case,t,spin", "mu60_b3,50,fast"], "line 2: spin should be a number, not 'fast'"),
        (["case,t,spin", "mu60_b3,50,0.1", "mu60_b3,50,0.1"], "line 3: mu60_b3 at t = 50 is answered twice"),
    ],
)
def test_the_scorer_says_what_is_wrong_with_answers(tmp_path: Path, lines: list[str], message: str) -> None:
    found = _score(tmp_path, lines)
    assert found.returncode == 1
    assert found.stderr.startswith("error: answers.csv")
    assert message in found.stderr


def test_the_scorer_says_that_there_is_no_file(tmp_path: Path) -> None:
    command = [sys.executable, FOLDER / "score.py", "none.csv"]
    found = subprocess.run(command, cwd=tmp_path, capture_output=True, text=True, encoding="utf-8", check=False)
    assert found.stderr == "error: none.csv: No such file or directory\n"
