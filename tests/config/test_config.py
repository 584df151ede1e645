"""What a configuration says, and how it is read."""

from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pandas
import pytest
from hypothesis import assume, given
from hypothesis import strategies as st
from support import SMALL, Write

from sweep import ConfigError, load_config
from sweep.config.values import Range


def test_settings_replace_the_files_values(write: Write) -> None:
    config = load_config(write(), {"friction.mu": 7.5, "integrator.step": 0.01, "n0": [0.1, 0.2]})
    assert config.parameters["mu"].numbers == (7.5,)
    assert config.integrator.step == 0.01
    assert list(config.axes) == ["b", "n0"]


def test_axes_are_mu_b_n0_then_as_written(write: Write) -> None:
    text = (
        SMALL.replace("delta: 0.03", "delta: [0.02, 0.03]").replace("10.0", "[9, 10]").replace("x0: 0.01", "x0: [0, 1]")
    )
    assert list(load_config(write(text)).axes) == ["mu", "b", "n0", "a", "delta", "x0"]


def test_ranges(write: Write) -> None:
    config = load_config(
        write(), {"mu": {"start": 1, "stop": 100, "num": 3, "spacing": "log"}, "b": {"start": 2, "stop": 3, "num": 3}}
    )
    np.testing.assert_allclose(config.parameters["mu"].numbers, [1, 10, 100])
    assert config.parameters["b"].numbers == (2.0, 2.5, 3.0)


def test_yaml_numbers_mean_what_they_look_like(write: Write) -> None:
    config = load_config(write(SMALL.replace("[40, 60]", "[1e1, 2.5E1, +3., 012]").replace("x0: 0.01", "x0: -1e-3")))
    assert config.parameters["mu"].numbers == (10.0, 25.0, 3.0, 12.0)
    assert config.parameters["x0"].numbers == (-0.001,)


def test_defaults_are_the_papers_standard_case(write: Write) -> None:
    config = load_config(write("friction: {mu: 60}\n", "plain.yaml"))
    assert config.name == "plain"
    assert {name: v.numbers for name, v in config.parameters.items()} == {
        "mu": (60.0,), "b": (3.0,), "n0": (0.05,), "a": (10.0,), "c": (1.0,), "delta": (0.03,),
        "x0": (0.01,), "y0": (0.01,),
    }  # fmt: skip
    assert (config.integrator.t_end, config.integrator.patience) == (1e6, 30_000)
    assert config.measure == ("reversals", "energy_error", "margin", "noise_limited", "resting_spin")


def test_fingerprint_sees_what_decides_the_numbers(write: Write) -> None:
    first = load_config(write()).fingerprint()
    for same in ({"name": "other"}, {"max_failed_fraction": 0.5}, {"delta": 0.03}):
        assert load_config(write(), same).fingerprint() == first
    for other in ({"mu": [40, 61]}, {"t_end": 1501}, {"step": 0.01}, {"measure": ["reversals"]}, {"y0": 0.02}):
        assert load_config(write(), other).fingerprint() != first


CASES = "name: table\ncases: cells.csv\nstart: {x0: 0.01}\n"


@pytest.mark.parametrize("table", [dict, pandas.DataFrame])
def test_cases_given_by_columns(table: Callable[..., Any]) -> None:
    columns = {"mu": np.array([60.0, 130.0]), "n0": [0.05, -0.02]}
    config = load_config({"start": {"x0": 0.01}}, {"cases": table(columns)})
    assert config.cases == {"mu": (60.0, 130.0), "n0": (0.05, -0.02)}
    assert load_config(config, {"t_end": 50.0}).cases == config.cases
    other = load_config({"start": {"x0": 0.01}}, {"cases": {"mu": [60.0, 131.0], "n0": [0.05, -0.02]}})
    assert other.fingerprint() != config.fingerprint()
    assert load_config({"start": {"x0": 0.01}, "cases": columns}).fingerprint() == config.fingerprint()


@pytest.mark.parametrize(
    ("columns", "said"),
    [
        ({"muu": [1.0]}, "cases.muu: unknown parameter (did you mean mu?)"),
        ({"mu": [1.0], "n0": [1.0, 2.0]}, "cases: its columns must be lists of the same length"),
        ({}, "cases: its columns must be lists of the same length"),
        ({"mu": [1.0], "n0": 0.05}, "cases.n0: must be a list of numbers, not 0.05"),
        ({"mu": [1.0, "two"]}, "cases.mu[1]: must be a finite number >= 0"),
        ({"mu": [1.0, float("nan")]}, "cases.mu[1]: must be a finite number >= 0"),
    ],
)
def test_wrong_columns_of_cases_are_refused(columns: dict[str, Any], said: str) -> None:
    with pytest.raises(ConfigError) as refusal:
        load_config({"cases": columns})
    assert said in str(refusal.value)
    assert len(refusal.value.faults) == 1


def test_cases(write: Write, tmp_path: Path) -> None:
    (tmp_path / "cells.csv").write_text("mu, b,n0\n60,3,0.05\n1e2,2.5,-0.02\n\n", encoding="utf-8")
    config = load_config(write(CASES))
    grid = config.grid
    assert (grid.dims, grid.shape) == (("case",), (2,))
    columns = grid.columns()
    assert (list(columns["mu"]), list(columns["n0"]), list(columns["a"])) == ([60, 100], [0.05, -0.02], [10, 10])


@given(
    start=st.floats(-1e6, 1e6),
    stop=st.floats(-1e6, 1e6),
    num=st.integers(2, 50),
    finer=st.integers(1, 12),
    spacing=st.sampled_from(["linear", "log"]),
)
def test_a_finer_range_has_the_values_of_a_coarser_one(
    start: float, stop: float, num: int, finer: int, spacing: str
) -> None:
    assume(spacing == "linear" or start * stop > 0)
    coarse, fine = (
        Range(start=start, stop=stop, num=n, spacing=spacing).values() for n in (num, finer * (num - 1) + 1)
    )
    assert coarse == fine[::finer]
    assert (coarse[0], coarse[-1]) == (start, stop)
    spaced = np.linspace if spacing == "linear" else np.geomspace
    np.testing.assert_allclose(coarse, spaced(start, stop, num), rtol=1e-11, atol=1e-9 if spacing == "linear" else 0)
