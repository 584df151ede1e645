"""What holds for both methods: the same bits in any company, exact rest and scale, tolerances, vector instructions."""

from typing import Any

import numpy as np
import pytest
from support import columns
from support.kernels import PAPER_FORM, finish, run, spin, started, threads
from support.kernels import kernel as make

from sweep.kernels.adams import start_up
from sweep.kernels.adams.step import HISTORY
from sweep.kernels.kernel import Kernel
from sweep.kernels.layout import LANES, PACK
from sweep.kernels.methods import METHODS, automatic_step
from sweep.kernels.status import DIVERGED, LIFT_OFF, PARADOX, SETTLED, TIME_LIMIT
from sweep.models import MODELS

KERNELS = {method: make(method) for method in METHODS}
each_method = pytest.mark.parametrize("kernel", KERNELS.values(), ids=KERNELS)

FLYING = np.arange(45) % 5 == 3


def mixed(kernel: Kernel) -> np.ndarray:
    """Cells that settle, reach the limit, lift off and diverge, at different steps."""
    cells: dict[str, Any] = {
        "step": np.linspace(0.05, 0.12, 45), "mu": np.linspace(20, 900, 45), "b": np.tile([1.5, 3.0, 5.0], 15),
        "n0": np.tile([0.05, -0.03, 0.002, 0.02, 3.0], 9),
    }  # fmt: skip
    if np.isfinite(kernel.stepper.real_stability):
        decay = np.linspace(300, 66, 45)  # shares of the stability limit, from below to beyond it
        cells = {
            "step": np.where(FLYING, 2e-5, kernel.stepper.stable_step(decay)),
            "mu": np.where(FLYING, 20.0, np.linspace(20, 90, 45)),
            "b": np.where(FLYING, 3.0, cells["b"]), "x0": np.where(FLYING, 1.0, 0.01),
            "n0": np.where(FLYING, 3.0, np.tile([0.05, -0.03, 0.01, 0.03, 0.02], 9)),
        }  # fmt: skip
    return started(kernel, t_end=900.0, settle=True, **cells)


@pytest.fixture(scope="module")
def expected() -> dict[str, np.ndarray]:
    return {method: finish(each, mixed(each)) for method, each in KERNELS.items()}


@each_method
def test_all_ends_are_among_the_mixed_cells(kernel: Kernel, expected: dict[str, np.ndarray]) -> None:
    ends = set(kernel.table(expected[kernel.method])["status"])
    assert {SETTLED, TIME_LIMIT, DIVERGED} <= ends
    assert ends & {LIFT_OFF, PARADOX}


@each_method
@pytest.mark.parametrize("number", [1, 2])
@pytest.mark.parametrize("chunk", [1, 7, 1000])
def test_bit_identical_for_threads_and_chunks(
    kernel: Kernel, number: int, chunk: int, expected: dict[str, np.ndarray]
) -> None:
    with threads(number):
        np.testing.assert_array_equal(finish(kernel, mixed(kernel), chunk_blocks=chunk), expected[kernel.method])


@each_method
def test_bit_identical_in_any_order_and_alone(kernel: Kernel, expected: dict[str, np.ndarray]) -> None:
    order = np.random.default_rng(1).permutation(45)
    np.testing.assert_array_equal(finish(kernel, mixed(kernel)[order]), expected[kernel.method][order])
    for i in (0, 3, 17, 44):
        np.testing.assert_array_equal(finish(kernel, mixed(kernel)[i : i + 1])[0], expected[kernel.method][i])


@each_method
def test_bit_identical_when_interrupted_and_resumed(kernel: Kernel, expected: dict[str, np.ndarray]) -> None:
    table, looks = mixed(kernel), 0

    def stop() -> None:
        nonlocal looks
        looks += 1
        if looks % 2:
            raise KeyboardInterrupt

    while (kernel.table(table)["status"] == 0).any():
        try:
            finish(kernel, table, chunk_blocks=5, after_chunk=stop)
        except KeyboardInterrupt:
            table = np.array(table.tolist())  # nothing but the numbers survives
    np.testing.assert_array_equal(table, expected[kernel.method])
    assert looks > 10


@each_method
def test_time_limit_is_met_exactly(kernel: Kernel) -> None:
    row = kernel.table(run(kernel, 0.03, 100.0))
    assert row["status"] == TIME_LIMIT
    assert row["done"] == row["goal"]
    begin = row["begin"] if "begin" in kernel.layout else 0.0
    assert begin + row["done"] * row["step"] == pytest.approx(100.0, rel=1e-14)
    assert row["step"] == 100 / np.ceil(100 / 0.03)
    assert kernel.times(row.rows, 100.0) == 100.0


@each_method
def test_equilibrium_stays_exactly(kernel: Kernel) -> None:
    table = started(kernel, 0.02, 500.0, x0=0.0, y0=0.0, n0=[0.0, 0.05, -0.3])
    before = table[:, :7].copy()
    finish(kernel, table)
    np.testing.assert_array_equal(table[:, :7], before)
    assert not kernel.table(table)["reversals"].any()


@each_method
def test_a_rattle_of_1e_30_grows_as_one_of_1e_20(kernel: Kernel) -> None:
    small, large = (run(kernel, 0.02, 400.0, x0=x, y0=x)[0, [0, 1, 2, 3, 5, 6]] for x in (1e-30, 1e-20))
    np.testing.assert_allclose(large, small * 1e10, rtol=1e-9)


@pytest.mark.parametrize(
    ("method", "parameters", "tolerance"),
    [
        *(("dopri5", body, 1e-8) for body in ({"mu": 60.0}, {"mu": 20.0, "n0": 0.1}, {"mu": 200.0, "b": 6.0})),
        *(("adams", body, tolerance) for tolerance in (1e-5, 1e-6, 1e-8)
          for body in ({"mu": 20.0}, {"mu": 60.0}, {"mu": 1000.0}, {"n0": 0.1, "mu": 200.0}, {"x0": 2.0, "mu": 200.0},
                       {"b": 1.5}, {"b": 8.0, "mu": 200.0})),
    ],
)  # fmt: skip
def test_automatic_step_is_about_that_of_the_tolerance(
    method: str, parameters: dict[str, float], tolerance: float
) -> None:
    """`tests/engine/test_errors.py` has what a run makes of it, which knows its error."""
    step, _ = automatic_step(method, MODELS["slip"], columns(**parameters), tolerance)
    coarse, fine = (spin(KERNELS[method], run(KERNELS[method], h, 400.0, **parameters))[0] for h in (step, step / 3))
    assert abs(coarse - fine) < (2 * tolerance if method == "dopri5" else 3 * tolerance)


def test_bodies_on_and_beyond_the_edge_of_standing_have_steps() -> None:
    """A body that leans from unstable rest has less energy than at rest; in a sphere at rest nothing moves."""
    body = columns(a=[0.5, 1.0, 1.0, 3.0, 1.0], b=[0.5, 0.9, 3.0, 0.5, 1.0], n0=0.0)
    for method, ends in (("dopri5", 5), ("adams", 4)):
        assert np.isfinite(automatic_step(method, MODELS["slip"], body)[0]).sum() == ends
    assert start_up.count_levels(np.array([100.0]), np.array([np.inf]))[0] < 60


@pytest.mark.parametrize(
    ("method", "steps", "low", "high"), [("dopri5", (0.016, 0.008), 25, 80), ("adams", (0.1, 0.05), 10, 1e3)]
)
def test_energy_error_falls_with_the_step(method: str, steps: tuple[float, float], low: float, high: float) -> None:
    """As the fifth power with dopri5; with adams the work is summed to fourth order."""
    coarse, fine = (KERNELS[method].table(run(KERNELS[method], h, 300.0)) for h in steps)
    assert low < coarse["violation"] / fine["violation"] < high
    assert coarse["violation"] < 1e-4 * coarse["energy_start"]


def assembly(function: Any, *arguments: Any) -> str:
    function(*arguments)
    return str(next(iter(function.inspect_asm().values())))


@pytest.mark.x86
@pytest.mark.parametrize(
    ("method", "model"),
    [("dopri5", "slip"), *(pytest.param("adams", model, marks=pytest.mark.campaign)
                           for model in ("slip", "slip+viscous+sigma+offset+skew+gravity"))],
)  # fmt: skip
def test_the_loop_over_lanes_is_vector_instructions(method: str, model: str) -> None:
    made: Any = make(method, model)
    found = assembly(made.stepper.body(made), np.zeros(len(made.layout.names) * LANES), LANES // PACK)
    # Twelve square roots and divisions a step of dopri5; the stiff method has a scalar loop as well, for a history that
    # overlaps the group, which it never does.
    divisions, roots = (12, 12) if method == "dopri5" else (3, 2)
    assert found.count("divpd") >= divisions
    assert found.count("sqrtpd") >= roots
    assert method != "dopri5" or found.count("divsd") + found.count("sqrtsd") == 0


@pytest.mark.x86
def test_the_loop_over_lanes_of_start_up_is_vector_instructions() -> None:
    group = np.zeros(len(start_up.layout(PAPER_FORM).names) * LANES)
    points = np.zeros((HISTORY + 1) * start_up._POINT_SIZE)
    found = assembly(start_up._make_advance(PAPER_FORM), group, points, 1.0)
    assert found.count("divpd") >= 3
    assert found.count("sqrtpd") >= 2
