"""The slow equations against the full model: its eigenvalues, its counts, and its symmetries."""

from typing import Any

import numpy as np
import pytest
from support.kernels import default_measures

import sweep
from sweep.jit import compiled
from sweep.models.ladder import slip
from sweep.models.slow import elementary, follow
from sweep.models.slow import estimate as slow
from sweep.models.slow.exchange import RESONANT, SECOND, TERMS, THIRD, Body, coefficients, make_exchange
from sweep.models.stiff.modes import RATTLE
from sweep.models.theory import linear
from sweep.models.theory.modes import modes_at
from sweep.plots import quantities
from sweep.prediction import predict

MEASURE = [*default_measures("slip"), "estimate"]
MEASURE_SIGMA = [*default_measures("slip+viscous+sigma"), "estimate"]
LINE: dict[str, Any] = {"body": {"b": {"start": 1.5, "stop": 9.5, "num": 9}}, "friction": {"mu": [30, 80, 150]}}


def columns(**given: Any) -> dict[str, np.ndarray]:
    found = {"a": 10.0, "b": 3.0, "c": 1.0, "delta": 0.03, "mu": 100.0, "n0": 0.05, "x0": 0.01, "y0": 0.01} | given
    return {name: np.atleast_1d(np.asarray(value, float)) for name, value in found.items()}


def test_the_matrix_has_the_eigenvalues_of_the_full_model() -> None:
    """At spins between those through which its polynomials go, even where the modes nearly meet."""
    for b in (2.0, 5.0, 9.4):
        body = columns(b=b)
        p = slip.MODEL.constants.of(body)
        reach, (exchange, _), sums = 0.05, make_exchange(slip.MODEL), np.zeros((6, TERMS), complex)
        E = reach * modes_at(slip.MODEL, p, np.zeros(1)).of_unit_energy()[0]
        exchange(Body(type(p)(*(each[0] for each in p)), reach), E, np.linalg.inv(E), sums)
        table = coefficients(sums[None])[0][0]
        for x in (0.3, -0.8):
            C = (table[:, :4].T @ x ** np.arange(5)).reshape(2, 2)
            full = np.linalg.eigvals(linear.jacobian(slip.MODEL, p, np.array([x * reach])))[0]
            rocking = full[np.argsort(-full.imag)[:2]]
            np.testing.assert_allclose(np.sort_complex(np.linalg.eigvals(C)), np.sort_complex(rocking), rtol=2e-6)


@pytest.mark.parametrize(("n0", "share"), [(0.02, 1.0), (0.05, 0.85)])
def test_counts_are_those_of_the_full_model(n0: float, share: float) -> None:
    asked = LINE | {"start": {"n0": n0}, "measure": MEASURE}
    found = sweep.run(asked)
    right = (found.reversals == found.reversals_estimated).values
    assert right.mean() >= share
    assert right[found.estimate_certain.values == 1].all()
    assert found.estimate_certain.mean() > 0.4
    # The formula alone is right in a third of these.
    assert right.mean() > (found.reversals == found.reversals_predicted).mean() + 0.2
    assert found.reversals_estimated.identical(sweep.predict(asked).reversals_estimated)
    alone = sweep.run(LINE | {"start": {"n0": n0}, "model": "slow"})
    np.testing.assert_array_equal(alone.reversals, found.reversals_estimated)
    np.testing.assert_array_equal(alone.reversals_estimated, found.reversals_estimated)


@pytest.mark.parametrize(
    ("given", "what"),
    [
        ({"b": 6.4, "mu": 100, "n0": 0.05}, "the spin crosses zero with the beat of the modes, which does not count"),
        ({"a": 45.57635, "b": 4.04683, "c": 1.59376, "delta": 0.16211, "mu": 83.02952, "n0": 0.00733, "x0": 1.21098,
          "y0": -0.20595}, "one mode must not excite the other in steps that are longer than their beat"),
        ({"a": 6.58157, "b": 6.54843, "c": 1.60573, "delta": -0.11106, "mu": 2.1437, "n0": 0.06486, "x0": -0.30049,
          "y0": -0.26185}, "friction alone couples modes whose frequencies hardly differ"),
        ({"b": 8.6, "mu": 104, "n0": 0.1}, "one mode alone does not beat, though it changes its own frequency"),
        ({"b": 3.6, "mu": 88, "n0": 0.02}, "in the last, long step the decaying mode still turns the spin"),
    ],
)  # fmt: skip
def test_counts_of_hard_cells(given: dict[str, float], what: str) -> None:
    case = {name: values.tolist() for name, values in columns(**given).items()}
    found = sweep.run({"cases": case, "measure": MEASURE, "integrator": {"method": "auto"}})
    assert found.reversals_estimated == found.reversals, what


@pytest.mark.parametrize("sigma", [1e-3, 1e-2, 0.1])
def test_counts_of_a_body_that_a_couple_slows(sigma: float) -> None:
    """It reverses less often the stronger the couple is."""
    friction = {"mu": [30, 80, 150], "sigma": sigma}
    found = sweep.run(LINE | {"friction": friction, "start": {"n0": 0.05}, "measure": MEASURE_SIGMA})
    certain, right = found.certain == 1, found.reversals == found.reversals_estimated
    assert float(right.where(certain).mean()) > 0.85
    assert float(right.where(certain & (found.estimate_certain == 1)).mean()) == 1
    assert float(found.estimate_certain.mean()) > 0.3


def test_a_count_whose_last_reversal_a_drag_may_prevent_is_not_sure() -> None:
    """Six by an independent integration too: the tiny mode that would turn the spin again grows back too early."""
    found = sweep.run({"body": {"b": 3.0}, "friction": {"mu": 160.0, "sigma": 9.9727e-4}, "start": {"n0": 0.05},
                       "measure": MEASURE_SIGMA})  # fmt: skip
    assert (found.reversals, found.reversals_estimated, found.estimate_certain) == (6, 7, 0)


def test_with_a_drag_a_mode_that_fell_far_makes_no_count_sure() -> None:
    """In the first body it falls below 1e-8; all other conditions hold for both.  Without a drag it does not matter."""
    for sigma, sure in ((1e-6, [False, True]), (0.0, [True, True])):
        config = sweep.load_config({"body": {"b": [3.0, 4.0]}, "friction": {"mu": 150.0, "sigma": sigma},
                                    "start": {"n0": 0.02}})  # fmt: skip
        assert slow.estimate(config.equations, config.grid.columns()).sure.tolist() == sure


def test_a_couple_makes_a_count_unsure_that_a_small_mode_decides() -> None:
    """The spin falls below the critical one while the mode that would reverse it is still tiny; it is estimated to."""
    found = sweep.run({"body": {"b": 4.2}, "friction": {"mu": 109.0909, "sigma": 1e-3}, "start": {"n0": 0.02},
                       "measure": MEASURE_SIGMA})  # fmt: skip
    assert (found.reversals, found.reversals_estimated, found.estimate_certain) == (2, 3, 0)


def test_a_cell_is_the_same_alone_and_mirrored() -> None:
    """Also next to a cell without energy, the last one."""
    b, mu, n0 = [1.6, 4.0, 7.0, 9.0, 9.0], [40.0, 60.0, 120.0, 90.0, 90.0], [0.05, -0.05, 0.08, 0.03, 0.0]
    some = columns(b=b, mu=mu, n0=n0, x0=[0.01] * 4 + [0.0], y0=[0.01] * 4 + [0.0])
    some = {name: np.broadcast_to(values, 5).copy() for name, values in some.items()}
    together = slow.estimate(slip.MODEL, some)
    mirrored = slow.estimate(slip.MODEL, some | {name: -some[name] for name in ("delta", "n0", "y0")})
    np.testing.assert_array_equal(together.reversals, mirrored.reversals)
    for i in range(5):
        one = slow.estimate(slip.MODEL, {name: values[i : i + 1] for name, values in some.items()})
        assert one.reversals[0] == together.reversals[i]
        assert one.sure[0] == together.sure[i]


@pytest.mark.parametrize("sigma", [0.0, 1e-3])
def test_a_cell_is_the_same_in_another_lane(sigma: float) -> None:
    """Of more cells than lanes, in the opposite order."""
    some = columns(b=np.tile(np.linspace(1.5, 9.5, 41), 2), mu=np.linspace(20, 150, 82))
    some = {name: np.broadcast_to(values, 82).copy() for name, values in some.items()}
    model = slip.MODEL
    if sigma:
        config = sweep.load_config({"friction": {"mu": 60.0, "sigma": sigma}})
        model, some = config.equations, some | {"sigma": np.full(82, sigma)}
    forward = slow.estimate(model, some)
    back = slow.estimate(model, {name: values[::-1].copy() for name, values in some.items()})
    np.testing.assert_array_equal(forward.reversals, back.reversals[::-1])
    np.testing.assert_array_equal(forward.sure, back.sure[::-1])
    assert np.unique(forward.reversals).size > 3


@pytest.mark.parametrize("size", [7.0, 10.0])
def test_a_round_body_does_not_beat(size: float) -> None:
    """Its frequencies are equal up to round-off, by which the beat would be divided."""
    offsets = [0.0, 1e-15, 1e-13, 1e-10]
    round_ones = columns(a=np.full(4, size), b=size * (1 - np.array(offsets)), mu=np.full(4, 60.0))
    round_ones = {name: np.broadcast_to(values, 4).copy() for name, values in round_ones.items()}
    assert not slow.estimate(slip.MODEL, round_ones).reversals.any()


def test_bodies_without_two_rocking_modes_are_not_sure() -> None:
    """One that cannot stand, also alone, one that hardly slips, and one that is nearly round."""
    some = columns(b=[0.5, 3.0, 1.00001], mu=[60.0, 1e-4, 60.0])
    found = slow.estimate(slip.MODEL, {name: np.broadcast_to(values, 3).copy() for name, values in some.items()})
    assert not found.sure.any()
    assert (found.reversals[:2] == 0).all()
    alone = slow.estimate(slip.MODEL, columns(b=0.5))
    assert (alone.reversals, alone.sure) == (0, False)


def test_a_count_that_the_start_spin_decides_is_not_sure() -> None:
    """Terms of higher order and steps leave it as it is, but 3 % more or less of the start spin does not."""
    case = {"mu": [140.0, 132.0], "b": [5.6, 6.0], "n0": [0.02, 0.05]}
    found = sweep.run({"cases": case, "measure": MEASURE})
    assert found.reversals.values.tolist() == [3, 8]
    assert found.reversals_estimated.values.tolist() == [4, 7]
    assert not found.estimate_certain.any()


def test_a_mode_that_harmonics_of_the_other_drive_is_not_sure() -> None:
    """Its frequency is five times that of the other: the full model reverses ten times."""
    body = {"a": 9.177403, "b": 0.899823, "c": 0.575785, "delta": -0.189866, "mu": 46.871297}
    found = slow.estimate(slip.MODEL, columns(**body, n0=-0.061097, x0=-0.502401, y0=-0.021362))
    assert found.reversals < 10
    assert not found.sure


def test_a_start_by_angles_and_rates_is_estimated() -> None:
    """The same motion as by n0, x0 and y0 where the body spins about the vertical; and another one that is pushed."""
    start = {"roll": 0.01, "pitch": 0.002, "omega3": [-0.05, 0.05], "omega1": [0.0, 0.01]}
    found = sweep.run(LINE | {"start": start, "measure": MEASURE})
    right, certain = (found.reversals == found.reversals_estimated).values, found.certain.values == 1
    assert right[certain].mean() > 0.8
    assert found.estimate_certain.values.any()
    assert right[certain & (found.estimate_certain.values == 1)].all()


def test_a_body_in_si_has_the_same_counts() -> None:
    """Given by lengths and times, with gravity, where the equations are those of another variant.

    The offset, which changes no number, makes it one that other tests compile.
    """
    paper = sweep.run(LINE | {"model": "slow"})
    length, gravity = 0.02, 9.80665
    rate = np.sqrt(gravity / length)
    b = np.linspace(1.5, 9.5, 9) * length
    asked = {
        "units": "SI",
        "body": {"a": 10 * length, "b": b.tolist(), "c": length, "delta": 0.03, "mass": 1.0, "offset": 1e-300},
        "friction": {"mu": [mu / (length * rate) for mu in (30, 80, 150)]},
        "start": {"n0": 0.05 * rate, "x0": 0.01 * length, "y0": 0.01 * length}, "measure": MEASURE,
    }  # fmt: skip
    np.testing.assert_array_equal(sweep.predict(asked).reversals_estimated.values, paper.reversals_estimated.values)


def test_counts_of_the_slow_equations_are_called_estimated() -> None:
    """They are not simulated; a run that measures both has simulated ones as well, and a formula's are predicted."""
    alone = sweep.run(LINE | {"model": "slow"})
    assert alone.reversals.attrs["long_name"] == alone.reversals_estimated.attrs["long_name"]
    formula = sweep.run(LINE | {"model": "analytic"})
    assert formula.reversals.attrs["description"] == "Spin reversals predicted by Takano (2011), cases (I) and (II)."
    both = sweep.run({"friction": {"mu": [60, 80]}, "measure": MEASURE})
    assert quantities.field(alone, "difference").attrs["long_name"] == "estimated − predicted"
    assert quantities.field(both, "difference").attrs["long_name"] == "simulated − predicted"


def test_counts_are_not_estimated_for_critical_spins_alone() -> None:
    config = sweep.load_config(LINE | {"model": "slow"})
    assert "reversals_estimated" not in predict(config.tier, config.grid).variables
    assert "reversals_estimated" in predict(config.tier, config.grid, config.measure).variables


@pytest.mark.parametrize("b", [3.0, 6.4])
def test_orders_of_the_corrections(b: float) -> None:
    """What the full equations leave over at rest falls as the third and fourth power of the amplitude without T and Q,
    and as the fifth and sixth with them.  The ripple and w are found here by fits to tiny amplitudes, mode by mode.
    """
    p = slip.MODEL.constants.of(columns(b=b))
    modes = modes_at(slip.MODEL, p, np.zeros(1))
    rates, E, p = modes.rates, modes.of_unit_energy()[0], type(p)(*(each[0] for each in p))
    inverse, exchange = np.linalg.inv(E), make_exchange(slip.MODEL)[0]
    energies = [(1, 0, 1, 0), (0, 1, 0, 1), (1, 0, 0, 1), (0, 1, 1, 0)]
    even = np.concatenate([SECOND, SECOND[:, [2, 3, 0, 1]], energies])
    odd = np.concatenate([THIRD, THIRD[:, [2, 3, 0, 1]], np.eye(4, dtype=int)])
    turning = np.array([*rates[0, :2], *rates[0, :2].conj()])
    unit = np.exp(2j * np.pi / 16 * np.array(np.divmod(np.arange(256), 16)))

    def products(powers: np.ndarray, a: np.ndarray) -> np.ndarray:
        return np.prod(np.concatenate([a, a.conj()]) ** powers[:, :, None], axis=1)

    def fitted(values: np.ndarray, powers: np.ndarray) -> np.ndarray:
        return np.linalg.lstsq(products(powers, tiny).T, values.T)[0].T

    def slopes(a: np.ndarray, q: np.ndarray, w: np.ndarray) -> np.ndarray:
        """Rates of the modes, and -n', shape (7, points)."""
        x = 2 * (E[:, :2] @ a + E @ w @ products(THIRD, a)).real
        found = slip.MODEL.rhs((*x[:4], 2 * (q @ products(SECOND, a)).real, *x[4:]), p)[0]
        return np.concatenate([inverse @ np.array(found)[list(RATTLE)], found[4:5]])

    tiny, none = 1e-4 * np.hstack([unit, unit * [[1], [0.5]], unit * [[0.5], [1]]]), np.zeros((6, len(THIRD)))
    turned = fitted(slopes(tiny, np.zeros(3), none)[6], even)
    q, n_rate = turned[:3] / (SECOND @ turning), -(turned[6:] @ products(even[6:], tiny)).real

    def bent(spin: float) -> np.ndarray:
        """1 + Y, for which the rocking modes at a spin are E (1 + Y)."""
        found = inverse @ np.linalg.eig(linear.jacobian(slip.MODEL, p, np.full(1, spin))[0])[1]
        rocking = found[:, np.argsort(-np.abs(found[:2]).sum(axis=0))[:2]]
        return rocking @ np.linalg.inv(rocking[:2])

    Y_rate = (bent(1e-4) - bent(-1e-4)) / 2e-4
    f = fitted(slopes(tiny, q, none)[:6] - Y_rate @ (n_rate * tiny), odd)[:, : len(THIRD)]
    f[:2, :RESONANT] = 0  # these are the terms of T
    at_rest = np.diag(inverse @ linear.jacobian(slip.MODEL, p, np.zeros(1))[0] @ E)
    w = f / (THIRD @ turning - at_rest[:, None])

    def left_over(size: float) -> np.ndarray:
        sums, a, reach = np.zeros((6, TERMS), complex), size * unit, 1.02 * np.sqrt(2) * size
        exchange(Body(p, reach), reach * E, inverse / reach, sums)
        (table,), (kappa,) = coefficients(sums[None])
        table /= reach ** np.repeat([0, 1, 2, 3], [4, 3, 12, 6])
        kappa /= reach**2
        terms = follow.Terms(*np.split(table[0], [4, 7, 13, 19]))
        e1, e2, beat, true = abs(a[0]) ** 2, abs(a[1]) ** 2, a[0] * a[1].conj(), slopes(a, q, w)
        found = []
        for share in (1e-12, 1.0):
            by = (1 + np.outer(kappa, e1 + e2)) / share
            each_by = zip(*by, zip(e1, e2, beat, strict=True), strict=True)
            C, turning = zip(
                *((follow._rates(terms, one, a), follow._turning(terms, other, a)) for one, other, a in each_by),
                strict=True,
            )
            C = np.transpose(C)
            rests = true[0] - C[0] * a[0] - C[1] * a[1], true[1] - C[2] * a[0] - C[3] * a[1]
            turned = true[6] + turning
            found.append([abs(np.mean(rest * each.conj())) for rest, each in zip(rests, unit, strict=True)])
            found[-1].append(abs(turned.mean()))
        return np.array(found)

    sizes = 0.04 / 2.0 ** np.arange(4)
    orders = np.log2(np.array([left_over(size) for size in sizes]))
    orders = orders[:-1] - orders[1:]
    print(f"b = {b}\n{orders.round(2)}")
    np.testing.assert_allclose(orders[-1], [[3, 3, 4], [5, 5, 6]], atol=0.15)


def test_elementary_functions_are_those_of_numpy() -> None:
    small = np.logspace(-15, 2.8, 300)
    x = np.concatenate([-small, [0.0], small])
    for exp in (elementary.exp, compiled(lambda x: elementary.exp(x))):
        np.testing.assert_allclose([exp(each) for each in x], np.exp(x), rtol=1e-12)
    np.testing.assert_allclose([elementary.exp(each) - 1.0 for each in small[:50]], np.expm1(small[:50]), atol=3e-16)
    np.testing.assert_allclose([elementary.turn_by(each) for each in x], np.exp(1j * x), atol=1e-13)
    y = np.concatenate([-np.logspace(-12, -1e-9, 300), np.logspace(-12, 300, 300)])
    np.testing.assert_allclose([elementary.log1p(each) for each in y], np.log1p(y), rtol=0.01)


@pytest.mark.x86
@pytest.mark.campaign
def test_the_steps_are_vector_instructions() -> None:
    made = compiled(follow.make_follow())
    made.compile(slow.compiled_follow()._types)
    (assembly,) = made.inspect_asm().values()
    # There are scalar loops as well, for arrays that overlap, which they never do.
    assert assembly.count("divpd") > 44
    assert assembly.count("sqrtpd") > 11


def test_the_model_draws_what_it_estimates_and_measures_counts_alone() -> None:
    asked: dict[str, Any] = {"model": "slow", "friction": {"mu": 60}}
    assert sweep.load_config(asked | {"picture": ["estimate_certain"]}).picture == ("estimate_certain",)
    with pytest.raises(sweep.InputError, match=r"margin cannot be measured .*; choose from reversals$"):
        sweep.load_config(asked | {"measure": ["reversals", "margin"]})
