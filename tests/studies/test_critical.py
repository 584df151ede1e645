"""Critical spins by simulation, against the eigenvalues and against runs."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import xarray as xr
from click.testing import CliRunner
from support import wide_bodies
from support.kernels import kernel

import sweep
from sweep.cli import main
from sweep.kernels.kernel import Kernel
from sweep.models import MODELS
from sweep.models.theory import linear, stability
from sweep.results.dataset import REASONS
from sweep.results.memory import Memory
from sweep.results.store import Running
from sweep.studies import growth, rounds
from sweep.studies.critical import critical, remarks
from sweep.studies.growth import simulated_growth
from sweep.studies.rounds import Rounds

Write = Callable[..., Path]
STANDARD = "name: standard\nfriction: {mu: 75}\nintegrator: {t_end: 12000}\n"
NAMES = ("n_c1_plus", "n_c1_minus", "n_c2_plus", "n_c2_minus")


def reasons(spins: xr.Dataset, name: str) -> list[str]:
    return [REASONS[code] for code in np.atleast_1d(spins[f"{name}_reason"].values)]


def agree_with_eigenvalues(spins: xr.Dataset, width: float) -> None:
    """Every n_c1 is that of the eigenvalues within the width, and every n_c2 lies beyond it or has a reason."""
    for side in ("plus", "minus"):
        assert set(reasons(spins, f"n_c1_{side}")) == {"exists"}
        inner, outer, linear = (
            np.abs(spins[f"n_c1_{side}_{name}"]) for name in ("simulated_inner", "simulated_outer", "linear")
        )
        assert (outer - inner <= width * outer).all()
        assert (inner * (1 - width) <= linear).all()
        assert (linear <= outer * (1 + width)).all()
        n_c2, exists = np.abs(spins[f"n_c2_{side}_simulated"]), spins[f"n_c2_{side}_reason"] == 0
        np.testing.assert_array_equal(np.isfinite(n_c2), exists)
        assert (n_c2.where(exists, np.inf) > outer).all()


@pytest.mark.parametrize("number", [8, pytest.param(200, marks=pytest.mark.campaign)])
def test_wide_bodies_agree_with_their_eigenvalues(number: int, write: Write) -> None:
    bodies = wide_bodies(number)
    config = sweep.load_config(write(STANDARD), {"t_end": 10.0})
    named = {name: tuple(bodies[name].tolist()) for name in ("a", "b", "c", "delta", "mu")}
    rest = {name: values for name, values in config.parameters.items() if name not in named}
    spins = critical(replace(config, parameters=rest, cases=named))
    assert spins.sizes == {"case": number}
    agree_with_eigenvalues(spins, 1e-3)


@pytest.mark.parametrize(
    ("parameters", "minus"),
    [({"mu": 200.0}, -0.00435), ({"mu": 160.0}, -0.00544), ({"mu": 75.0, "model": "averaged"}, -0.01003)],
)
def test_growth_that_turns_the_spin_does_not_hide_n_c1(parameters: dict[str, Any], minus: float, write: Write) -> None:
    """In these bodies a rattle above n_c2 had turned the spin, and no longer grew, when its growth was measured."""
    spins = critical(sweep.load_config(write(STANDARD), {**parameters, "t_end": 3000.0}))
    agree_with_eigenvalues(spins, 1e-3)
    assert float(spins.n_c1_minus_simulated) == pytest.approx(minus, rel=1.5e-3)
    assert spins.n_c2_minus_simulated_outer < spins.n_c1_minus_simulated_outer < 0


def test_a_tiny_rattle_grows_at_the_rate_of_its_eigenvalue() -> None:
    """At rest, below and at n_c1, and far beyond n_c2."""
    bodies = wide_bodies(40)
    n_c1, _ = stability.critical_spins(MODELS["slip"], bodies)
    constants = MODELS["slip"].constants.of(bodies)
    at_rest = linear.growth_rate(MODELS["slip"], constants, np.zeros(40))
    for share in (0, 0.5, 1, 1.25, 4):
        simulated = simulated_growth(kernel("dopri5", "slip"), bodies, share * n_c1, Rounds(Memory()))
        exact = linear.growth_rate(MODELS["slip"], constants, share * n_c1)
        assert (np.abs(simulated - exact) < 2e-5 * np.maximum(np.abs(at_rest), np.abs(exact))).all()


@pytest.mark.campaign
def test_brackets_are_as_narrow_as_asked(write: Write) -> None:
    spins = critical(sweep.load_config(write(STANDARD), {"mu": [60.0, 75.0]}), width=1e-5)
    assert spins.n_c1_plus_simulated.dims == ("mu",)
    assert "n0" not in spins.coords
    assert (spins.critical_reason == 0).all()
    for name in NAMES:
        inner, outer = spins[f"{name}_simulated_inner"], spins[f"{name}_simulated_outer"]
        assert (np.abs(outer / inner - 1) < 1.01e-5).all()
    for side in ("plus", "minus"):
        np.testing.assert_allclose(spins[f"n_c1_{side}_simulated"], spins[f"n_c1_{side}_linear"], rtol=1e-5)
        ratio = spins[f"n_c2_{side}_simulated"] / spins[f"n_c1_{side}_linear"]
        assert ((ratio > 1.9) & (ratio < 2.1)).all()


def test_runs_reverse_on_one_side_of_n_c2(write: Write) -> None:
    config = sweep.load_config(write(STANDARD), {"mu": 60.0})
    spins = critical(config, width=0.01)
    for side in ("plus", "minus"):
        ends = [float(spins[f"n_c2_{side}_simulated_{end}"]) for end in ("inner", "outer")]
        counts = [int(sweep.run(write(STANDARD), mu=60.0, n0=end).reversals) for end in ends]
        assert counts[0] == 0 < counts[1]


def test_a_disagreement_is_a_reason_and_a_line(write: Write, monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    """Growth is measured at a spin 1 % too low, so that n_c1 comes out 1 % too large, ten times the width."""
    monkeypatch.setattr(
        growth, "simulated_growth", lambda k, bodies, n, rounds: simulated_growth(k, bodies, 0.99 * n, rounds)
    )
    out = tmp_path / "o"
    settings = ["--set", "mu=[60,75]", "--set", "t_end=100"]
    command = ["critical", str(write(STANDARD)), *settings, "--output", str(out)]
    result = CliRunner().invoke(main, command)
    assert result.exit_code == 0
    said = "n_c1_minus: 2 disagree with the eigenvalues, of 2\n"
    assert said in result.stdout
    quiet = CliRunner().invoke(main, [*command, "--fresh", "--quiet"])
    assert (quiet.stdout, said in quiet.stderr) == ("", True)
    spins = xr.load_dataset(out / "standard_critical.nc")
    assert reasons(spins, "n_c1_plus") == reasons(spins, "n_c1_minus") == ["disagrees"] * 2
    assert [REASONS[code] for code in spins.critical_reason.values] == ["disagrees"] * 2
    assert np.isfinite(spins.n_c1_plus_simulated).all()


def test_spins_that_are_not_critical_have_a_reason(write: Write) -> None:
    for settings, reason in (
        ({"mu": 0.0}, "no_friction"),
        ({"model": "noslip"}, "no_friction"),
        ({"model": "averaged", "delta": 0.0}, "no_coupling"),
    ):
        spins = critical(sweep.load_config(write(STANDARD), settings))
        for name in NAMES:
            assert reasons(spins, name) == [reason]
            assert np.isnan(spins[f"{name}_simulated"])
        assert remarks(spins)[0] == f"n_c1_plus: 1 {reason.replace('no_', 'without ')}, of 1"
        meanings = spins.critical_reason.attrs["flag_meanings"].split()
        assert dict(zip(spins.critical_reason.attrs["flag_values"], meanings, strict=True)) == REASONS


def test_friction_alone_makes_a_rattle_grow_at_a_fast_spin(write: Write) -> None:
    """Without the angle δ nothing tells right from left, and nothing reverses, but upright spin is not stable."""
    spins = critical(sweep.load_config(write(STANDARD), {"delta": 0.0, "t_end": 100.0}), width=0.01)
    assert float(spins.n_c1_plus_simulated) == pytest.approx(0.0798, rel=0.01)
    assert float(spins.n_c1_minus_simulated) == pytest.approx(-0.0798, rel=0.01)
    assert "exists" not in reasons(spins, "n_c2_plus")


@pytest.mark.parametrize(
    ("settings", "reason"),
    [({"x0": 1.0, "y0": 1.0}, "reverses_at_n_c1"), ({"t_end": 30.0}, "undecided"), ({"step": 0.5}, "failed")],
)
def test_n_c2_that_is_not_known_has_a_reason(settings: dict[str, float], reason: str, write: Write) -> None:
    """A large rattle turns a slow spin by itself; trajectories are too short; their steps are far too long."""
    spins = critical(sweep.load_config(write(STANDARD), settings), width=0.01)
    assert reasons(spins, "n_c1_plus") == ["exists"]
    assert reasons(spins, "n_c2_plus") == [reason]
    assert np.isnan(spins.n_c2_plus_simulated)
    assert REASONS[int(spins.critical_reason)] == reason


def test_where_n_c2_is_undecided_its_upper_bound_is_told(write: Write) -> None:
    """With this t_end only trajectories from well above n_c2 have reversed in time, and the others have not settled."""
    short, long = (
        critical(sweep.load_config(write(STANDARD), {"t_end": t_end}), width=0.01) for t_end in (2000.0, 12_000.0)
    )
    assert (reasons(short, "n_c2_plus"), reasons(long, "n_c2_plus")) == (["undecided"], ["exists"])
    assert np.isnan(short.n_c2_plus_simulated)
    assert np.isnan(short.n_c2_plus_simulated_inner)
    assert short.n_c2_plus_simulated_outer > 1.1 * long.n_c2_plus_simulated_outer


def test_critical_command(write: Write, tmp_path: Path) -> None:
    command = ["critical", write(STANDARD), "--set", "mu=[60,75]", "--set", "model=averaged", "--width", "0.01"]
    result = CliRunner().invoke(main, [*map(str, command), "--output", str(tmp_path / "o")], catch_exceptions=False)
    assert result.exit_code == 0
    assert result.stdout.startswith("wrote ")
    stored = xr.load_dataset(tmp_path / "o" / "standard_critical.nc")
    np.testing.assert_allclose(stored.n_c1_plus_simulated, stored.n_c1_plus, rtol=0.01)
    np.testing.assert_allclose(stored.n_c2_plus_simulated, 2 * stored.n_c1_plus, rtol=0.1)
    assert (tmp_path / "o" / "standard_critical.png").exists()


def test_a_fixed_step_is_taken_by_its_own_method_alone(write: Write, monkeypatch: pytest.MonkeyPatch) -> None:
    """With an automatic step the way outwards is simulated with the cheapest method; the ends of brackets never are."""
    used = set[str]()
    execute = rounds.executor.execute

    def noted(kernel: Kernel, images: np.ndarray, **options: Any) -> None:
        used.add(type(kernel).__name__)
        execute(kernel, images, **options)

    monkeypatch.setattr("sweep.studies.rounds.executor.execute", noted)
    for step, kernels in ((0.02, {"RungeKuttaKernel"}), ("auto", {"RungeKuttaKernel", "AdamsKernel"})):
        used.clear()
        critical(sweep.load_config(write(STANDARD), {"mu": 20.0, "t_end": 500.0, "step": step}), width=0.1)
        assert used == kernels


def test_images_of_another_round_are_left_alone() -> None:
    """As they are found after the answers to an earlier round were lost to damage."""
    bodies, dopri5 = wide_bodies(4), kernel("dopri5", "slip")
    shape = 4 * 6, len(dopri5.layout.names)  # each of six components is disturbed by itself

    class Damaged(Memory):
        def load_running(self) -> Running:
            return Running([7], {"dopri5": np.zeros(shape)}, 1.0)

    whole, again = (simulated_growth(dopri5, bodies, np.zeros(4), Rounds(store)) for store in (Memory(), Damaged()))
    np.testing.assert_array_equal(again, whole)
