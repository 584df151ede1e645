"""Late reversals, which round-off makes come too early: rescaled by adams, and said of a cell where it does."""

import numpy as np
import pytest
from support import columns
from support.kernels import PAPER_FORM, kernel, run, started
from support.physics import turned_inertia

import sweep
from sweep.kernels.adams import skips
from sweep.kernels.measures import noise
from sweep.kernels.methods import automatic_step
from sweep.kernels.status import QUIET, RUNNING, Doubt
from sweep.models import MODELS
from sweep.models.general import rigid_body
from sweep.models.ladder import slip
from sweep.models.theory.modes import modes_at

ADAMS, DOPRI = kernel("adams"), kernel("dopri5")

# Time and number of the last reversal at b = 3, n0 = 0.05, in double-double arithmetic.
LAST = {200.0: (9, 12914.14), 188.0: (9, 18719.15), 180.0: (9, 29032.53), 176.0: (9, 41315.4), 140.0: (7, 15880.39)}
FIRM = {60.0: (3, 2379.9), 130.0: (6, 7412.95)}


@pytest.mark.parametrize("tolerance", [1e-8, 1e-6])
def test_late_reversals_come_at_the_reference_times(tolerance: float) -> None:
    cases = LAST | FIRM
    step, _ = automatic_step("adams", MODELS["slip"], columns(mu=list(cases)), tolerance)
    table = run(kernel("adams", tolerance=tolerance), step, 45_000.0, settle=True, mu=list(cases))
    assert [(n, pytest.approx(t, rel=1e-3)) for n, t in cases.values()] == list(
        zip(ADAMS.table(table)["reversals"], ADAMS.table(table)["last_reversal"], strict=True)
    )
    assert not ADAMS.table(table)["round_off"].any()


@pytest.mark.campaign
def test_a_real_body_does_so_too() -> None:
    """The same body in SI, by its moments of inertia.

    The offset, which changes no number, makes its model one that other tests compile.
    """
    length, gravity, mass = 0.02, 9.81, 0.3
    time, cos, sin = np.sqrt(length / gravity), np.cos(0.03), np.sin(0.03)
    principal = (mass * length**2 * float(each[0]) for each in rigid_body.homogeneous(columns()))
    body = {"a": 10 * length, "b": 3 * length, "c": length, "offset": 1e-300, "mass": mass}
    body |= turned_inertia(*principal, 0.03)
    start = {"n0": 0.05 / time, "x0": 0.01 * (cos - sin) * length, "y0": 0.01 * (sin + cos) * length}
    found = sweep.run(
        {"units": "SI", "gravity": gravity, "body": body, "start": start},
        mu=[mu * time / length for mu in LAST | FIRM], method="adams", t_end=45_000 * time, estimate_errors=False,
    )  # fmt: skip
    assert list(found.reversals) == [n for n, _ in (LAST | FIRM).values()]
    np.testing.assert_allclose(found.t_last_reversal / time, [t for _, t in (LAST | FIRM).values()], rtol=1e-3)
    assert not (found.doubts & Doubt.ROUND_OFF).any()


def test_dopri5_flags_reversals_that_round_off_moved() -> None:
    mu = [200.0, 188.0, 180.0, 176.0, 60.0, 130.0]
    step, _ = automatic_step("dopri5", MODELS["slip"], columns(mu=mu))
    table = run(DOPRI, step, 30_000.0, settle=True, mu=mu)
    assert list(DOPRI.table(table)["round_off"]) == [1, 1, 1, 1, 0, 0]
    assert list(DOPRI.table(table)["reversals"]) == [9, 9, 9, 9, 3, 6]
    last, true = DOPRI.table(table)["last_reversal"], np.array([(LAST | FIRM)[m][1] for m in mu])
    np.testing.assert_allclose(last[4:], true[4:], rtol=1e-3)
    # The others are off: else there would be nothing to say.
    assert (last[:4] < 0.97 * true[:4]).all()


def test_a_mode_that_sank_is_flagged_only_once_it_has_grown_back() -> None:
    """Nothing has come of the round-off yet at t = 9000; at 12 000 a rattle has, though no reversal."""
    step, _ = automatic_step("dopri5", MODELS["slip"], columns(mu=200.0))
    for t_end, flag in ((9_000.0, 0), (12_000.0, 1)):
        table = run(DOPRI, step, t_end, settle=True, mu=200.0)
        assert DOPRI.table(table)["reversals"][0] == 8
        assert table[0, [DOPRI.layout.index("depth0"), DOPRI.layout.index("depth1")]].min() < np.log(noise.DEPTH)
        assert DOPRI.table(table)["round_off"][0] == flag


def test_a_mode_let_down_too_late_is_flagged() -> None:
    table = started(ADAMS, 0.05, 9000.0, n0=[0.05, 0.01])
    table[:, [ADAMS.layout.index(name) for name in skips.SCALES]] = 12.0
    ADAMS.table(table)["status"] = QUIET
    ADAMS.stepper.between(ADAMS, table)
    assert (ADAMS.table(table)["status"] == RUNNING).all()
    assert list(ADAMS.table(table)["round_off"]) == [0, 1]
    assert list(ADAMS.table(table)["scale0"]) == [12, 0]


def test_growth_is_that_of_the_model() -> None:
    body = columns(b=[1.5, 3.0, 6.0], mu=[60.0, 200.0, 400.0], n0=[0.05, -0.1, 0.08])
    c = noise.growth_coefficients(slip.MODEL, body)
    constants = PAPER_FORM.model.constants.of(body)
    for share in (-1.0, -0.4, 0.1, 0.7):
        spin = share * body["n0"]
        rates = modes_at(slip.MODEL, constants, spin).rates[:, :2]
        largest = np.abs(c[:, 1] * body["n0"]).max()
        fitted = (c * spin ** np.arange(c.shape[1])[:, None]).sum(axis=1)
        np.testing.assert_allclose(fitted, rates.real.T, atol=0.03 * largest)
