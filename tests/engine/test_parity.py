"""The parity of a count is that of the signs of the spin at the start and at the end."""

import numpy as np
import pytest
import xarray as xr

import sweep
from sweep.models.theory import rocking

NEARLY_ROUND = {
    "body": {"a": 10.0, "b": (1 + np.logspace(-6, -2, 5)).tolist(), "delta": 0.03},
    "friction": {"mu": 100.0},
    "start": {"n0": 0.05, "x0": 0.01, "y0": 0.01},
    "measure": ["reversals", "margin"],
}

TOO_EARLY = {
    (47.2841434079, 15.8501878478, 0.911245356655, 0.267442320328, 0.207115063054,
     -0.164575311323, -2.21633302516, -1.27952228851): 1686.95,
    (42.483166, 15.700788, 0.78415991, 0.13288258, 0.21073119, -0.18987983, 1.7206681, 1.5158422): 2411.47,
    (41.067662, 20.796681, 1.8073354, 0.19627002, 1.2663982, -0.16939016, 4.0267689, -1.8686359): 238.84,
}  # fmt: skip
"""Bodies with little friction that settled before their spin reversed, and when it does (heyoka.py, Taylor series)."""


def contradictions(found: xr.Dataset, start: xr.DataArray) -> int:
    """Count the decided cells whose count has another parity than the signs of the spin."""
    turned = np.sign(start) * np.sign(found.spin_final)
    return int(((turned != (-1.0) ** found.reversals) & (found.decided == 1)).sum())


def test_the_spin_of_a_nearly_round_body_reverses_once() -> None:
    """Its slower mode has a period that outlasts the motion."""
    found = sweep.run(NEARLY_ROUND, b=NEARLY_ROUND["body"]["b"][:4])
    assert found.reversals.values.tolist() == [1, 1, 1, 1]
    assert (found.spin_final < 0).all()
    assert (found.decided == 1).all()


def test_a_count_of_the_wrong_parity_is_not_decided(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(rocking, "LONGEST", np.inf)
    found = sweep.run(NEARLY_ROUND, b=1.00001)
    assert (found.reversals.item(), found.spin_final.item() < 0, found.decided.item()) == (0, True, 0)


@pytest.mark.campaign
@pytest.mark.parametrize(("cell", "reverses"), TOO_EARLY.items())
def test_a_rattle_that_hardly_decays_does_not_settle(cell: tuple[float, ...], reverses: float) -> None:
    values = dict(zip(("a", "b", "c", "delta", "mu", "n0", "x0", "y0"), cell, strict=True))
    found = sweep.run({"measure": ["reversals", "margin"]}, **values)
    assert found.reversals.item() == 1
    assert found.t_last_reversal.item() == pytest.approx(reverses, rel=0.01)


@pytest.mark.campaign
@pytest.mark.parametrize("name", ["b", "mu", "quick"])
def test_no_decided_count_contradicts_the_spin(name: str) -> None:
    found = sweep.run(f"configs/{name}.yaml", measure=["reversals", "margin"])
    assert contradictions(found, found.n0) == 0
    assert (found.decided == 1).sum() > 20
