"""Which kind each cell of a dataset is of, and the words for it."""

import re

import numpy as np
import pytest
import xarray as xr

from sweep.kernels.status import DIVERGED, LIFT_OFF, SETTLED, TIME_LIMIT, Doubt
from sweep.parameters import PARAMETERS
from sweep.plots import labels
from sweep.plots.marks import BLANK, WORDS, legend, marks
from sweep.plots.quantities import field
from sweep.results.dataset import VARIABLES, described
from sweep.results.summary import describe
from sweep.units import PAPER_UNITS
from sweep.variables import attributes

STATUS = [SETTLED, TIME_LIMIT, LIFT_OFF, DIVERGED, 0, SETTLED]


@pytest.fixture
def cells() -> xr.Dataset:
    """Six cells along mu, of all kinds; the last one without a reversal."""
    values = {
        "status": STATUS,
        "reversals": [3, 4, 99, 99, 99, 0],
        "reversals_predicted": [3, 6, 5, 5, 5, 1],
        "t_last_reversal": [10, 20, np.nan, np.nan, np.nan, np.nan],
        "spin_final": [0.1, 0.2, np.nan, np.nan, np.nan, 0.1],
        "doubts": [Doubt.STEP | Doubt.ROUND_OFF, Doubt.WINDOWS, Doubt.WINDOWS | Doubt.ROUND_OFF, 0, 0, 0],
    }
    specs = {name: VARIABLES[name] for name in values}
    variables = {name: ("mu", np.array(values[name], s.dtype), described(s)) for name, s in specs.items()}
    mu = xr.Variable("mu", np.arange(6.0), attributes(PARAMETERS["mu"], PAPER_UNITS))
    return xr.Dataset(variables, {"mu": mu})


def test_the_kinds_of_a_count(cells: xr.Dataset) -> None:
    kinds = {kind: where.values.nonzero()[0].tolist() for kind, where in marks(cells, "reversals").items()}
    some = {"not_run": [4], "failed": [2, 3], "time_limit": [1], "round_off": [0], "uncertain": [0, 1]}
    assert kinds == {kind: [] for kind in WORDS} | some
    assert list(kinds) == list(WORDS)


def test_predictions_and_statuses_have_no_marks_of_failure(cells: xr.Dataset) -> None:
    for name in ("reversals_predicted", "status"):
        assert not any(where.any() for where in marks(cells, name).values())


def test_a_missing_value_of_a_sound_run_is_not_a_failure(cells: xr.Dataset) -> None:
    kinds = marks(cells, "t_last_reversal")
    assert kinds["no_value"].values.nonzero()[0].tolist() == [5]
    assert "no reversal (1)" in legend(cells, "t_last_reversal").values()
    np.testing.assert_array_equal(np.any([kinds[kind] for kind in BLANK], axis=0), cells["t_last_reversal"].isnull())


def test_a_final_spin_is_not_a_lower_bound(cells: xr.Dataset) -> None:
    words = legend(cells, "spin_final")
    assert words["time_limit"] == "not settled: time limit (1)"
    assert "uncertain" not in words


def test_a_legend_says_how_trajectories_failed(cells: xr.Dataset) -> None:
    words = legend(cells, "reversals")
    assert words["failed"] == "failed: 1 lifted off the table, 1 diverged (2)"
    assert words["time_limit"].startswith("lower bound")


def test_the_difference(cells: xr.Dataset) -> None:
    assert field(cells, "difference").values[[0, 1, 5]].tolist() == [0, -2, -1]
    assert marks(cells, "difference")["failed"].equals(marks(cells, "reversals")["failed"])
    with pytest.raises(ValueError, match=r"no variable difference; choose .*spin_final"):
        field(cells.drop_vars("reversals_predicted"), "difference")


def test_labels_have_words_and_units(cells: xr.Dataset) -> None:
    assert labels.label(cells, "mu") == "friction μ (1/√(g c))"
    assert labels.label(cells, "spin_final") == "final spin n (√(g/c))"
    assert labels.label(cells, "reversals") == "spin reversals, simulated"
    plain = xr.Dataset({"torque": ((), 1.0, {"long_name": "torque, in all", "units": "N m"})})
    assert labels.label(plain, "torque") == "torque, in all (N m)"
    plain["torque"].attrs = {"long_name": "torque about the axis, in m g c", "units": "1"}  # of an older dataset
    assert labels.label(plain, "torque") == "torque about the axis, in m g c"
    assert labels.label(xr.Dataset({"other_thing": 1.0}), "other_thing") == "other thing"


NUMBERS = {0.05: "0.05", -5: "−5", -2e-5: "−2×10⁻⁵", 1e-7: "10⁻⁷", -1e-7: "−10⁻⁷", 1.1e-7: "1.1×10⁻⁷", 1e9: "10⁹"}


def test_numbers() -> None:
    assert {at: labels.number(at) for at in NUMBERS} == NUMBERS


def test_constants_stand_in_the_order_of_the_reference() -> None:
    si = {"Ixz": 0.0, "mass": (1.0, "kg"), "omega3": 0.0, "n0": (-5.0, "radian s-1"), "a": (0.2, "m"), "offset": 0.0}
    pairs = {name: v if isinstance(v, tuple) else (v, "1") for name, v in si.items()}
    dataset = xr.Dataset(coords={name: ((), v, {"units": units}) for name, (v, units) in pairs.items()})
    assert labels.constants(dataset) == "a = 0.2 m, mass = 1 kg, n₀ = −5 rad/s"
    # Zero is nothing special in a user's model, whose parameters may have any names.
    own = dataset.assign_attrs(model_brings="a model", model_parameters="mass Ixz")
    assert labels.constants(own).startswith("mass = 1 kg, Ixz = 0, omega3".replace("omega3", "ω₃"))


def test_a_map_and_the_last_lines_of_a_run_agree_on_the_number_of_uncertain_counts(small: xr.Dataset) -> None:
    number, size = int((small["certain"] == 0).sum()), small["certain"].size
    assert 0 < number < size
    assert legend(small, "reversals")["uncertain"] == f"uncertain count ({number})"
    said = describe(small)
    assert f"\n{size - number} of {size} counts are certain; the others:\n" in said
    assert sum(map(int, re.findall(r"^  (\d+)\b", said, re.MULTILINE))) == number
