"""What a measurement declares, and what follows for models, methods and the end of runs."""

from typing import Any

import pytest
from support import STANDARD

import sweep
from sweep.kernels import methods
from sweep.kernels.adams.kernel import METHOD as ADAMS
from sweep.kernels.measures import MEASURES
from sweep.kernels.measures.measurement import Measurement
from sweep.kernels.methods import PLAIN
from sweep.models import MODELS
from sweep.models.model import Offer
from sweep.results.dataset import SERIES, VARIABLES


class Slid(Measurement):
    name, summary, asks = "slid", "distance along v1", Offer.SPIN
    reads, every_step, final_when_settled = ("v1",), True, False


@pytest.fixture(autouse=True)
def slid(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(MEASURES, "slid", Slid)


def configured(model: str = "slip", **integrator: Any) -> sweep.Config:
    body, start = ({name: STANDARD[name] for name in names} for names in (("a", "b", "delta"), ("n0", "x0", "y0")))
    return sweep.load_config(
        {"model": model, "body": body, "friction": {"mu": 60.0}, "start": start, "integrator": integrator,
         "measure": ["reversals", "slid"]}
    )  # fmt: skip


def test_a_sum_over_steps_takes_a_method_that_takes_every_step() -> None:
    assert configured().integrator.method == PLAIN
    assert methods.automatic(MODELS["slip"], ["slid"]) == (PLAIN,)
    assert ADAMS.name in methods.automatic(MODELS["slip"], ["reversals"])
    with pytest.raises(sweep.InputError, match="cannot make all of reversals, slid on the slip model; choose dopri5"):
        configured(method="adams")


def test_a_method_in_other_states_than_those_that_are_read_is_refused(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(Slid, "every_step", False)
    assert ADAMS.name in methods.allowed(MODELS["slip"], ["slid"])
    monkeypatch.setattr(Slid, "reads", ("omega1",))
    assert ADAMS.name not in methods.allowed(MODELS["slip"], ["slid"])


def test_a_model_without_the_states_that_are_read_is_refused() -> None:
    expected = "slid cannot be measured on the noslip model; choose from reversals"
    with pytest.raises(sweep.InputError, match=expected) as raised:
        configured("noslip")
    assert len(raised.value.faults) == 1  # another method would not help


def test_a_value_that_goes_on_changing_keeps_a_run_to_its_end_unless_it_is_to_stop_early() -> None:
    assert (configured().integrator.stop_early, configured().integrator.t_end) == (False, 30_000)
    assert configured(stop_early=True).integrator.settles
    assert configured(t_end="settled").integrator.settles


def test_series_and_variables_have_names_of_their_own() -> None:
    assert not SERIES.keys() & VARIABLES.keys()
