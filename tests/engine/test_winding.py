"""Rattles that roll round and round, as those of nearly round bodies do."""

import numpy as np
import pytest
from support import columns
from support.runs import run_cells

import sweep
from sweep.config import load_config
from sweep.engine import executor
from sweep.engine.over import whole_blocks
from sweep.engine.plan import plan
from sweep.kernels.status import RUNNING
from sweep.models.ladder import slip
from sweep.models.stiff.precession import vertical_spin
from sweep.models.stiff.slip import form_of

FORM = form_of(slip.MODEL)


def test_a_pause_between_blocks_changes_no_bit() -> None:
    """Within a block the history of adams would go on without the state."""
    (part,) = plan(load_config({"name": "round", "cases": columns(b=9.8), "integrator": {"method": "adams"}})).parts
    kernel, paused, rows = part.kernel, part.start(), part.start()
    for steps in (100.0, 1000.0, 5000.0):
        table = kernel.table(paused)
        table["goal"], table["status"] = whole_blocks(np.full(1, steps)), RUNNING
        executor.execute(kernel, paused)
    kernel.table(rows)["goal"] = table["goal"]
    executor.execute(kernel, rows)
    # When to look for a skip depends on how many steps are left.
    same = [name for name in kernel.layout.names if name != "quiet_after"]
    np.testing.assert_array_equal(table.columns(same), kernel.table(rows).columns(same))


def test_a_rolling_rattle_turns_the_vertical_spin_by_its_product_of_inertia_alone() -> None:
    """d (M·u)/dt = A12 (ω1² - ω2²) - (A11 - A22) ω1 ω2, to the third power of the rattle."""
    body, size = columns(b=8.0, delta=[0.3] * 3), 1e-4 * np.array([1.0, 0.5, 0.25])
    p = FORM.model.constants.of(body)
    states = np.array([0.3 * size, -0.7 * size, 5.0 * size, 2.0 * size, np.zeros(3), 0.0 * size, 0.0 * size])
    later, _ = FORM.nonstiff(*states, p)
    after = states.copy()
    after[:5] += 1e-6 * np.array(later)
    afterwards, before = (vertical_spin(each, *FORM.model.energy(each, p))[0] for each in (after, states))
    gain = (afterwards - before) * p.J33 / 1e-6
    w1, w2 = states[2] / (p.J11 + body["c"] ** 2), states[3] / (p.J22 + body["c"] ** 2)
    np.testing.assert_allclose(gain, p.A12 * (w1**2 - w2**2) - (p.A11 - p.A22) * w1 * w2, rtol=1e-3)


def test_upright_spin_has_nothing_to_lose() -> None:
    spin = np.array([0.05, -0.02])
    p = FORM.model.constants.of(columns(n0=spin))
    states = np.zeros((7, 2))
    states[4] = -p.J33 * spin
    left, total = vertical_spin(states, *FORM.model.energy(states, p))
    np.testing.assert_allclose(left, spin)
    np.testing.assert_allclose(total, spin**2)


@pytest.mark.parametrize("stop_early", [500.0, 950.0, 2000.0])
def test_no_run_goes_beyond_its_end(stop_early: float) -> None:
    """The rattles of the first two wind down slowly; t_end comes before it is known how."""
    found = run_cells([{"b": 9.7}, {"b": 9.9}, {"b": 3.0}], t_end=1000.0, stop_early=stop_early)
    assert (found.t_stop <= 1000.0).all()


@pytest.mark.campaign
def test_what_has_wound_down_reverses_no_more() -> None:
    """Bodies by which nothing was chosen, followed to t = 10⁶ whatever their rattle does."""
    random = np.random.default_rng(20261124)
    ranges = {"a": (5, 15), "roundness": (0.85, 0.99), "delta": (0.01, 0.1), "mu": (20, 200), "n0": (0.03, 0.1)}
    cells = {name: random.uniform(*ends, 32) for name, ends in ranges.items()}
    cells["b"] = cells["a"] * cells.pop("roundness")
    scene = {"name": "fresh", "cases": cells, "start": {"x0": 0.01, "y0": 0.01}, "integrator": {"method": "adams"}}
    found = sweep.run(scene, estimate_errors=False)
    far = sweep.run(scene, estimate_errors=False, stop_early=False, t_end=1e6)
    settled = found.sweep.settled.values
    assert settled.mean() > 0.9
    assert (found.t_stop.values[settled] < 20_000).sum() > 3
    np.testing.assert_array_equal(found.reversals[settled], far.reversals[settled])
