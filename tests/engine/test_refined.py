"""Refined runs: which nodes are simulated, what is inferred of the others, and the run around it."""

from collections import Counter
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import distributed
import numpy as np
import pytest
import xarray as xr
from hypothesis import given, settings
from hypothesis import strategies as st
from support import Write
from support.cli import invoke
from support.runs import in_sittings, same_numbers

import sweep
from sweep.engine import local, refinement
from sweep.engine.local import Done
from sweep.engine.refinement import UNKNOWN, Outcomes, search
from sweep.kernels.status import SETTLED
from sweep.results.dataset import STATUSES
from sweep.results.margins import Counts


def refine(
    full: np.ndarray, depth: int, margins: Callable[[int], np.ndarray] | None = None
) -> tuple[np.ndarray, np.ndarray]:
    """What a search that can look nodes up in `full` infers, and which it has looked up.

    `margins` gives the distances of all nodes from where a count begins; without it margins are not known.
    """
    size, reversals = full.size, full.ravel()
    known = Outcomes(np.zeros(size, np.int32), np.full(size, UNKNOWN))
    more, fewer = np.full((2, size), np.nan)
    for count in np.unique(reversals).tolist() if margins else []:
        here = reversals == count
        more[here], fewer[here] = -margins(count + 1).ravel()[here], margins(count).ravel()[here]
    while True:
        simulated = known.status != UNKNOWN
        own = [np.where(simulated, each, np.nan) for each in (more, fewer)]
        nodes, told = search(full.shape, known, Counts(known.reversals.astype(float), *own, simulated), depth)
        if not len(nodes):
            break
        assert (np.diff(nodes) > 0).all()
        assert (known.status[nodes] == UNKNOWN).all()  # nothing twice
        known.reversals[nodes], known.status[nodes] = reversals[nodes], SETTLED
    assert (told.status == SETTLED).all()
    assert (told.reversals[simulated] == reversals[simulated]).all()
    return told.reversals.reshape(full.shape), simulated.reshape(full.shape)


def lattice(shape: tuple[int, ...]) -> np.ndarray:
    """Places of the nodes, shape (axes, *shape)."""
    return np.stack(np.meshgrid(*map(np.arange, shape), indexing="ij")).astype(float)


@st.composite
def maps(draw: Any, axes: int, most: int) -> tuple[tuple[int, ...], int, np.ndarray]:
    """Shape, depth and a place on the map; each axis has a patch at least."""
    depth = draw(st.integers(1, 3))
    shape = tuple(draw(st.integers(2 ** (depth + 1) + 1, most)) for _ in range(axes))
    return shape, depth, np.array([draw(st.floats(0, n - 1)) for n in shape])


directions = st.floats(-1, 1).filter(lambda x: abs(x) > 1e-3)


@settings(max_examples=60)
@pytest.mark.parametrize(("axes", "most"), [(2, 60), (3, 17)])
@given(st.data(), st.lists(directions, min_size=3, max_size=3), st.booleans())
def test_half_spaces(axes: int, most: int, data: Any, normal: list[float], margins: bool) -> None:
    shape, depth, through = data.draw(maps(axes, most))
    away = lattice(shape) - np.expand_dims(through, tuple(range(1, axes + 1)))
    distance = np.tensordot(normal[:axes], away, 1)
    full = (distance > 0).astype(np.int32)
    of_level = (lambda level: distance - 1000.0 * (level - 1)) if margins else None
    np.testing.assert_array_equal(refine(full, depth, of_level)[0], full)


@settings(max_examples=60)
@pytest.mark.parametrize(("axes", "most", "off"), [(2, 60, 0.5), (3, 17, 0.75)])
@given(st.data(), st.floats(1.01, 2))
def test_balls_wider_than_the_largest_patches(axes: int, most: int, off: float, data: Any, radius: float) -> None:
    shape, depth, centre = data.draw(maps(axes, most))
    away = lattice(shape) - np.expand_dims(centre, tuple(range(1, axes + 1)))
    distance = np.linalg.norm(away, axis=0) - radius * 2**depth
    full = np.where(distance < 0, 7, 3)
    # Between two nodes outside the line may come in by 1/8 of its curvature times their distance squared.
    assert (abs(distance[refine(full, depth)[0] != full]) < off).all()


@given(st.integers(1, 4), st.lists(st.integers(1, 40), min_size=1, max_size=5))
def test_stretches_longer_than_the_largest_patches(depth: int, lengths: list[int]) -> None:
    full = np.repeat(np.arange(len(lengths)), [2 ** (depth + 1) + n for n in lengths])
    inferred, simulated = refine(full, depth)
    np.testing.assert_array_equal(inferred, full)
    # Around each change a patch is halved, and both of its halves where the change is beside their common node.
    assert simulated.sum() <= len(full) / 2**depth + 4 + (len(lengths) - 1) * (4 * depth + 2)


@settings(max_examples=60)
@given(st.tuples(st.floats(8, 56), st.floats(8, 56)), st.floats(1, 6), st.booleans())
def test_islands_between_the_nodes_are_found_by_their_margins(
    centre: tuple[float, float], radius: float, margins: bool
) -> None:
    x, y = lattice((65, 65))
    high = radius**2 - (x - centre[0]) ** 2 - (y - centre[1]) ** 2
    full = (high > 0).astype(np.int32)
    inferred, simulated = refine(full, 3, (lambda level: high - 1e6 * (level - 1)) if margins else None)
    met = full[::8, ::8].any()
    assert ((inferred == full).all()) == (margins or met)
    assert simulated.mean() < 0.3


@given(maps(2, 60), st.integers(1, 4))
def test_where_all_nodes_differ_all_are_simulated(case: tuple[tuple[int, ...], int, np.ndarray], blocks: int) -> None:
    shape, depth, place = case
    first = [min(int(p), n - 2**depth) for p, n in zip(place, shape, strict=True)]  # so that a coarse node is in it
    speckle = tuple(slice(i, i + blocks * 2**depth) for i in first)
    full = np.zeros(shape, np.int32)
    full[speckle] = 1 + np.arange(full[speckle].size).reshape(full[speckle].shape)
    inferred, simulated = refine(full, depth)
    assert simulated[speckle].all()
    np.testing.assert_array_equal(inferred, full)


def test_one_outcome_is_known_from_the_coarse_nodes() -> None:
    _, simulated = refine(np.zeros((70, 33), np.int32), 4)
    assert simulated.sum() == 8 * 3  # 0, 16 … 64, 37, 53, 69 × 0, 16, 32
    assert simulated[::16, ::16].all()
    assert simulated[-1, ::16].all()


@pytest.mark.parametrize("slope", [0.22, 0.47, 0.8])
def test_a_strip_that_becomes_thinner_than_a_node_is_followed(slope: float, monkeypatch: pytest.MonkeyPatch) -> None:
    x, y = lattice((129, 129))
    full = (np.abs(x - 10 - slope * y) < np.maximum(6 - 0.1 * y, 0.25)).astype(np.int32)
    inferred, simulated = refine(full, 3)
    np.testing.assert_array_equal(inferred, full)
    assert simulated.mean() < 0.3
    monkeypatch.setattr(refinement, "_AROUND", 0)
    assert (refine(full, 3)[0] != full).sum() > 10


def test_a_change_that_shows_late_halves_the_patches_it_reaches() -> None:
    # A finger that no coarse node sees but where it starts.
    full = np.zeros((65, 65), np.int32)
    full[16:19, 5:] = 1
    inferred, simulated = refine(full, 4)
    np.testing.assert_array_equal(inferred, full)
    assert simulated.mean() < 0.4


@settings(max_examples=40)
@given(st.integers(1, 3), st.floats(0.1, 0.9), st.booleans())
def test_lines_one_cell_wide_are_followed(depth: int, slope: float, upright: bool) -> None:
    columns = np.arange(65)
    at = np.round(slope * columns).astype(int)
    full = np.zeros((65, 65), np.int32)
    full[at, columns] = full[at[1:], columns[:-1]] = 1  # from a coarse node on, without diagonal gaps
    full = full.T if upright else full
    np.testing.assert_array_equal(refine(full, depth)[0], full)


def test_a_strip_beside_another_is_found() -> None:
    """No first node meets the second; a patch that the first one contradicts is looked at more closely."""
    columns = np.arange(17, 60)
    at = 16 + np.round(0.3 * (columns - 16)).astype(int)
    full = np.zeros((65, 65), np.int32)
    full[16, 16] = full[at, columns] = full[at[1:], columns[:-1]] = 1
    full[at[20:] + 3, columns[20:]] = full[at[21:] + 3, columns[20:-1]] = 2
    np.testing.assert_array_equal(refine(full, 4)[0], full)


def test_a_boundary_that_waves_costs_little_more_than_the_nodes_on_its_sides() -> None:
    """What parabolas cannot follow is simulated at once: to correct it later takes 1263 nodes."""
    x, y = lattice((257, 257))
    distance = 8 * np.sin(x / 9) - (y - 128.3)
    full = (distance > 0).astype(np.int32)
    inferred, simulated = refine(full, 4, lambda level: distance - 1000 * (level - 1))
    np.testing.assert_array_equal(inferred, full)
    assert simulated.sum() < 1150


@pytest.mark.parametrize("slope", [0, 0.37, 1])
def test_with_margins_a_line_costs_the_nodes_on_its_sides(slope: float) -> None:
    x, y = lattice((257, 257))
    distance = x - 101 + slope * (y - 128) - 0.05
    full = (distance > 0).astype(np.int32)
    inferred, simulated = refine(full, 4, lambda level: distance - 1000 * (level - 1))
    np.testing.assert_array_equal(inferred, full)
    beside = np.zeros(full.shape, bool)
    for axis in (0, 1):
        changes = np.diff(full, axis=axis) != 0
        beside |= np.pad(changes, [(int(i == axis), 0) for i in (0, 1)])
        beside |= np.pad(changes, [(0, int(i == axis)) for i in (0, 1)])
    beside[::16, ::16] = True
    np.testing.assert_array_equal(simulated, beside)
    assert refine(full, 4)[1].sum() > 2 * beside.sum()  # without them


MAP = """\
name: map
body: {a: 10.0, b: {start: 1.5, stop: 5, num: 11}, delta: 0.03}
friction: {mu: {start: 20, stop: 80, num: 14}}
start: {n0: [0.02, 0.05], x0: 0.01, y0: 0.01}
integrator: {method: dopri5, t_end: 1000}
refine: 2
"""


@pytest.fixture(scope="module")
def file(kept: Write) -> Path:
    return kept(MAP, "map.yaml")


def counted(patch: pytest.MonkeyPatch) -> Counter[int]:
    """How often each tile is simulated from now on."""
    ran, run_batch = Counter[int](), local.run_batch

    def count(*arguments: Any, **options: Any) -> Iterator[Done]:
        for done in run_batch(*arguments, **options):
            ran[done[0]] += 1
            yield done

    patch.setattr(local, "run_batch", count)
    return ran


@pytest.fixture(scope="module")
def refined(file: Path) -> xr.Dataset:
    with pytest.MonkeyPatch.context() as patch:
        ran = counted(patch)
        found = sweep.run(file)
    assert len(ran) > 1
    assert set(ran.values()) == {1}
    return found


@pytest.fixture(scope="module")
def full(file: Path) -> xr.Dataset:
    return sweep.run(file, refine=0)


def test_simulated_cells_are_those_of_the_full_run(refined: xr.Dataset, full: xr.Dataset) -> None:
    simulated = refined.inferred == 0
    assert 0.1 < float(simulated.mean()) == refined.attrs["simulated_share"] < 0.9
    assert set(full.data_vars) - set(refined.data_vars) == {
        "decided", "noise_limited", "sensitive", "step_rule", "window_dependent"
    }  # fmt: skip
    assert set(refined.data_vars) - set(full.data_vars) == {"inferred"}
    assert refined.inferred.attrs["flag_meanings"] == "simulated inferred"
    assert "inferred" not in full
    for name in set(refined.data_vars) - {"inferred"}:
        here = simulated if "n0" in refined[name].dims else simulated.any("n0")
        everywhere = name in ("reversals", "status") or ("linear" not in name and "n0" not in refined[name].dims)
        if everywhere or name == "reversals_predicted":
            xr.testing.assert_equal(refined[name], full[name])
        else:
            xr.testing.assert_equal(refined[name], full[name].where(here))
        assert refined[name].dtype == full[name].dtype
        assert "long_name" in refined[name].attrs


def test_each_value_of_an_unrefined_axis_is_a_map_of_its_own(file: Path, refined: xr.Dataset) -> None:
    for n0 in (0.02, 0.05):
        alone, together = sweep.run(file, n0=n0), refined.sel(n0=n0)
        for name in ("inferred", "reversals", "status", "margin_more"):
            np.testing.assert_array_equal(alone[name], together[name].transpose(*alone[name].dims))


def test_failures_are_outcomes_too(write: Write) -> None:
    text = MAP.replace("[0.02, 0.05]", "{start: 0.05, stop: 3, num: 40}").replace("x0: 0.01", "x0: 1")
    settings = {"mu": 20.0, "b": 3.0, "t_end": 5.0}
    refined = sweep.run(write(text), **settings)
    full = sweep.run(write(text), **settings, refine=0)
    assert refined.attrs["simulated_share"] < 0.9
    assert {STATUSES[int(i)] for i in full.status} == {"time_limit", "lift_off"}
    xr.testing.assert_equal(refined.status, full.status)


def test_lists_and_short_ranges_are_simulated_as_they_are(write: Write) -> None:
    listed = sweep.run(write(MAP), mu=[20.0, 30.0, 40.0, 50.0, 60.0, 70.0], t_end=50.0)
    assert (listed.inferred == 0).any("b").all()
    short = sweep.run(write(MAP), refine=4, t_end=50.0)
    assert (short.inferred == 0).all()
    assert "inferred" not in sweep.run(write(MAP), mu=20.0, b=3.0, n0=0.02, t_end=50.0)


def test_resumes_and_recomputes_nothing(
    file: Path, refined: xr.Dataset, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    ran = counted(monkeypatch)
    monkeypatch.setattr(local, "BATCH", 20)
    monkeypatch.setattr("sweep.engine.whole.tile_size", lambda cells: 20)  # noqa: ARG005
    result, interruptions, last = in_sittings(12, file, tmp_path / "out")
    assert interruptions > 3
    assert len(ran) > 5
    assert set(ran.values()) == {1}
    same_numbers(result, refined)
    assert {path.name for path in (tmp_path / "out").iterdir()} == {"map.nc", "map.png"}
    assert last.seen[-1].done == last.seen[-1].cells == int((refined.inferred == 0).sum())
    assert last.seen[-1].done_before > 0


def test_command_tells_the_share(file: Path, refined: xr.Dataset, tmp_path: Path) -> None:
    result = invoke("run", file, "--output", tmp_path / "out")
    assert result.exit_code == 0
    assert f"simulated: {refined.attrs['simulated_share']:.1%} of the cells" in result.stdout
    same_numbers(xr.load_dataset(tmp_path / "out" / "map.nc"), refined)
    assert invoke("plot", tmp_path / "out" / "map.nc", "--var", "inferred").exit_code == 0


def test_in_other_processes(file: Path, refined: xr.Dataset, client: distributed.Client) -> None:
    same_numbers(sweep.run(file, client=client), refined)
