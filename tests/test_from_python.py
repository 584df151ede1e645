"""What Python may hand in, how it is refused, and what it gets back."""

import sys
import types
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
import pytest
import xarray as xr
from ruamel.yaml import YAML
from support import Write
from support.runs import same_numbers

import sweep
from sweep.config import InputError, load_config

TEXT = "name: quick\nmodel: averaged\nbody: {b: [2, 3]}\nfriction: {mu: [40, 60]}\nintegrator: {t_end: 40}\n"
SAID: dict[str, Any] = YAML(typ="safe").load(TEXT)
"""What `TEXT` says."""

AXES = {
    "list": [40, 60],
    "tuple": (40.0, 60),
    "range": range(40, 61, 20),
    "array": np.array([40, 60], np.int16),
    "numbers of an array": [np.float32(40), np.int64(60)],
    "DataArray": xr.DataArray([40, 60], dims="mu"),
    "Series": pd.Series([40.0, 60.0]),
    "mapping": {"start": np.int8(40), "stop": 60, "num": 2.0},
}


@pytest.mark.parametrize("axis", AXES.values(), ids=AXES)
def test_an_axis_may_be_any_sequence(axis: Any, write: Write) -> None:
    as_override, in_mapping = load_config(write(TEXT), {"mu": axis}), load_config({**SAID, "friction": {"mu": axis}})
    assert as_override.axes == in_mapping.axes == {"mu": (40, 60), "b": (2, 3)}
    assert all(type(number) is float for number in as_override.axes["mu"])


def test_a_mapping_a_path_and_a_config_are_one_configuration(write: Write) -> None:
    path = write(TEXT)
    given = [path, str(path), SAID, sweep.load_config(path), types.MappingProxyType(SAID)]
    assert len({load_config(each).fingerprint() for each in given}) == 1
    first, *others = [sweep.run(each) for each in given]
    for other in others:
        same_numbers(first, other)
    same_numbers(sweep.predict(SAID), sweep.predict(path))


WRONG: dict[str, tuple[dict[str, Any], str]] = {
    "a word": ({"mu": "x"}, "mu: must be a finite number >= 0 and < 1e+12, a list of numbers"),
    "an entry": ({"mu": [1, "x"]}, "mu[1]: must be a finite number >= 0 and < 1e+12, not 'x'"),
    "a key of a range": ({"mu": {"strat": 1, "stop": 2, "num": 3}}, "mu.strat: unknown key (did you mean start?)"),
    "by path": ({"friction.mu": -1}, "friction.mu: must be a finite number >= 0 and < 1e+12, not -1"),
}  # fmt: skip


@pytest.mark.parametrize("kind", WRONG)
@pytest.mark.parametrize("function", [sweep.run, load_config])
def test_a_wrong_argument_is_called_by_its_name(function: Callable[..., Any], kind: str, write: Write) -> None:
    arguments, said = WRONG[kind]
    for config in (write(TEXT), SAID, load_config(SAID)):
        with pytest.raises(InputError) as refusal:
            function(config, arguments) if function is load_config else function(config, **arguments)
        assert str(refusal.value).startswith(said)
        assert "\n" not in str(refusal.value)


OF_A_CONFIG = "config: must be the path of a YAML file, a mapping with its contents, or a Config, not "
OF_A_DATASET = "dataset: must be a dataset or the path of its file, not "

WRONG_TYPES: dict[str, tuple[Callable[[], Any], str]] = {
    "no configuration": (lambda: sweep.run(None), OF_A_CONFIG + "nothing"),
    "a list": (lambda: sweep.critical([1]), OF_A_CONFIG + r"\[1\]"),
    "bytes": (lambda: sweep.predict(b"quick.yaml"), OF_A_CONFIG + "b'quick.yaml'"),
    "to animate": (lambda: sweep.animate(3), OF_A_CONFIG + "3"),
    "to plot": (lambda: sweep.plot([1]), OF_A_DATASET + r"\[1\]"),
    "to open": (lambda: sweep.open_dataset(3), "path: must be the path of a file or a folder, not 3"),
    "output": (lambda: sweep.run(SAID, 3), "output: must be the path of a file or a folder, not 3"),
    "picture": (lambda: sweep.plot(sweep.predict(SAID), output=b"x.png"), "output: must be the path of a file"),
    "client": (lambda: sweep.run(SAID, client=3), "client: must be a distributed.Client or the address of a scheduler"),
    "progress": (lambda: sweep.run(SAID, progress=3), "progress: must be True, False or a function of a number and a"),
    "cells": (lambda: sweep.trajectory(SAID, at=[60]), "at: must be values by parameter, such as .*, not"),
    "stop": (lambda: sweep.trajectory(SAID, stop_early=300.0), "stop_early: must be True or False, not 300"),
    "film": (lambda: sweep.fit(SAID, 3, ["mu"]), "film: must be a Film or the path of a table, not 3"),
    "free": (lambda: sweep.fit(SAID, "film.csv", 3), "free: must be a name or a list of names, not 3"),
    "laws": (
        lambda: sweep.fit(SAID, "film.csv", "mu", laws=[1]),
        r"laws: must be a name or a list of names, not",
    ),
    "title": (lambda: sweep.plot(sweep.predict(SAID), title=False), "title: must be a text, or '' for none, not false"),
}  # type: ignore[arg-type, list-item]


@pytest.mark.parametrize("kind", WRONG_TYPES)
def test_a_wrong_type_is_refused_in_a_sentence(kind: str) -> None:
    call, said = WRONG_TYPES[kind]
    with pytest.raises(InputError, match=f"^{said}"):
        call()


@pytest.mark.browser
def test_only_a_dataset_can_be_explored() -> None:
    with pytest.raises(InputError, match=f"^{OF_A_DATASET}"):
        sweep.explore([SAID])  # type: ignore[arg-type]


def test_progress_may_be_a_function() -> None:
    """It hears every chunk, the share that is done, and messages; what it raises ends the run."""
    heard = list[tuple[float, str]]()
    sweep.run(SAID, progress=lambda share, text: heard.append((share, text)))
    assert heard[-1] == (1.0, "4 of 4 cells done, 0 failed")

    def stop(share: float, text: str) -> None:
        raise RuntimeError(f"{share}: {text}")

    with pytest.raises(RuntimeError, match=r"of 4 cells done"):
        sweep.run(SAID, progress=stop)


def test_a_wrong_cell_of_a_trajectory_is_called_by_its_name() -> None:
    with pytest.raises(InputError, match=r"^at: start point off the ellipsoid at x0=20"):
        sweep.trajectory(SAID, at={"x0": 20})
    with pytest.raises(InputError, match=r"^at\.mu\[1\]: must be a finite number"):
        sweep.trajectory(SAID, at={"mu": [40, -1]})


def test_overrides_of_a_config_act_as_on_its_file(write: Write) -> None:
    """Also on what was filled in by default, here the method."""
    path = write("friction: {mu: {start: 20, stop: 200, num: 600}}\n")
    config = load_config(path)
    assert config.integrator.method == "auto"
    for overrides in ({"step": 0.01}, {"model": "analytic"}, {"mu": 60}, {"friction.mu": [3, 4], "name": "x"}):
        assert load_config(config, overrides) == load_config(path, overrides)
    assert load_config(load_config(config, {"mu": 60}), {"b": 2}) == load_config(path, {"mu": 60, "b": 2})
    assert config == load_config(path)


def test_overrides_of_a_config_keep_its_table_and_what_was_changed(write: Write, tmp_path: Path) -> None:
    table = tmp_path / "cells.csv"
    table.write_text("mu\n40\n60\n", encoding="utf-8")
    config = load_config(write("cases: cells.csv\n"))
    changed = replace(config, max_failed_fraction=0.5)
    table.unlink()
    for each, fraction in ((config, 0.01), (changed, 0.5)):
        again = load_config(each, {"b": 2})
        assert (again.max_failed_fraction, again.cases) == (fraction, {"mu": (40.0, 60.0)})


def test_open_takes_what_sweep_wrote(tmp_path: Path) -> None:
    written = sweep.run(SAID, tmp_path)
    with sweep.open_dataset(str(tmp_path / "quick.nc"), load=False) as lazy:
        assert not lazy.reversals._in_memory
    opened = sweep.open_dataset(tmp_path / "quick.nc")
    (tmp_path / "quick.nc").unlink()  # all is in memory
    xr.testing.assert_identical(opened, written)


@pytest.mark.parametrize(
    ("shell", "asked", "shown"),
    [
        (None, {}, False),
        (None, {"progress": True}, True),
        ({"kernel": None}, {}, True),
        ({"kernel": None}, {"progress": False}, False),
        ({}, {}, False),
    ],
    ids=["plain", "plain, asked", "notebook", "notebook, declined", "prompt"],
)
def test_a_notebook_shows_progress_unasked_and_others_where_it_is_asked_for(
    shell: dict[str, None] | None, asked: dict[str, bool], shown: bool,
    monkeypatch: pytest.MonkeyPatch, capfd: pytest.CaptureFixture[str],
) -> None:  # fmt: skip
    """In a notebook whose kernel lacks ipywidgets; IPython's prompt is not a notebook."""
    if shell is not None:
        ipython = types.SimpleNamespace(get_ipython=lambda: types.SimpleNamespace(**shell))
        monkeypatch.setitem(sys.modules, "IPython", ipython)
    sweep.run(SAID, **asked)
    out, err = capfd.readouterr()
    assert (out, "4/4 cells" in err, bool(err)) == ("", shown, shown)


def test_parts_of_a_grid_are_combined_without_loss(tmp_path: Path) -> None:
    """By the call that `docs/how-to/python.md` shows; integers stay integers, also from files.

    No body depends on n0.
    """
    whole: dict[str, Any] = {"mu": [40, 60, 80], "n0": [0.02, 0.05, 0.1]}
    parts = [{"mu": mu, "n0": n0} for mu in ([40, 60], [80]) for n0 in ([0.02], [0.05, 0.1])]
    for i, part in enumerate(parts):
        sweep.run(SAID, tmp_path / str(i), **part)
    runs = [sweep.open_dataset(tmp_path / str(i) / "quick.nc") for i in range(len(parts))]
    combined = xr.combine_by_coords(runs[::-1], data_vars="minimal", compat="equals", combine_attrs="drop_conflicts")
    assert isinstance(combined, xr.Dataset)
    same_numbers(combined.transpose(*(wanted := sweep.run(SAID, **whole)).dims), wanted)
    assert (combined.reversals.dtype, combined.status.dtype) == (np.int16, np.int8)
    assert combined.attrs["Conventions"] == "CF-1.11"
    assert "wall_time" not in combined.attrs


def test_a_dataset_does_what_the_package_does_with_it(tmp_path: Path) -> None:
    maps = sweep.run(SAID, tmp_path, mu=[40, 60, 80, 100, 120])
    assert maps.sweep.plot("status", at={"b": 3}, width="85mm").get_figwidth() == pytest.approx(85 / 25.4)
    opened = sweep.open_dataset(tmp_path / "quick.nc")
    xr.testing.assert_equal(opened.sweep.trajectory(at={"mu": 60, "b": 3}), sweep.trajectory(SAID, mu=60, b=3))
    assert repr(opened.sweep).startswith(
        "<sweep: quick: reversals of a rattleback (averaged model)>\n10 cells (mu 5 × b 2)"
    )
    assert {"plot", "trajectory"} <= {*dir(opened.sweep)}
    xr.testing.assert_equal(
        maps[{"mu": 0, "b": 0}].sweep.trajectory(t_end=20), sweep.trajectory(SAID, mu=40, b=2, t_end=20)
    )


@pytest.mark.parametrize(
    "several", [{"mu": [40, 60], "b": [2, 3]}, {"cases": {"mu": [40, 40, 60, 60], "b": [2, 3, 2, 3]}}]
)
def test_a_selected_cell_is_the_one_that_is_followed(several: dict[str, Any]) -> None:
    """Also one of a table, of part of an axis, and of a dataset of trajectories."""
    cells = sweep.run({"model": "averaged", "integrator": {"t_end": 20}}, **several)
    one, kept = ({"case": -1}, {"case": [-1]}) if "cases" in several else ({"mu": 1, "b": 1}, {"mu": [1], "b": [1]})
    expected = sweep.trajectory({"model": "averaged", "friction": {"mu": 60}, "integrator": {"t_end": 20}}, b=3)
    for selected in (cells.isel(one), cells.isel(kept)):
        followed = selected.sweep.trajectory()
        assert followed.status.dims == selected.status.dims
        np.testing.assert_array_equal(followed.spin.squeeze(), expected.spin)
        same_numbers(followed.sweep.trajectory(), followed)
    everything = cells.sweep.trajectory()
    assert everything.spin.dims == (*cells.status.dims, "time")
    np.testing.assert_array_equal(everything.isel(one).spin, expected.spin)


@pytest.mark.parametrize("name", ["cells.csv", "a name with spaces so long that YAML folds it, onto one more line.csv"])
def test_a_dataset_needs_no_other_file_for_its_trajectories(tmp_path: Path, name: str) -> None:
    (tmp_path / name).write_text("mu,n0\n60,0.05\n70,0.06\n", encoding="utf-8")
    config = tmp_path / "table.yaml"
    config.write_text(f"model: averaged\ncases: {name}\nintegrator: {{t_end: 20}}\n", encoding="utf-8")
    dataset = sweep.run(config)
    (tmp_path / name).unlink()
    assert dataset.sweep.trajectory().spin.dims == ("case", "time")
    at_both = dataset.sweep.trajectory(at={"n0": 0.06})
    assert (at_both.mu.values.tolist(), float(at_both.n0)) == ([60, 70], 0.06)
    one = {"model": "averaged", "friction": {"mu": 60}, "integrator": {"t_end": 20}}
    np.testing.assert_allclose(at_both.spin[0], sweep.trajectory(one, n0=0.06).spin, rtol=1e-12)


@pytest.mark.parametrize("text", ["configs/mu.yaml", "5", "[1]", "a: ["])
def test_the_configuration_in_a_dataset_has_to_be_one(text: str) -> None:
    dataset = sweep.predict(SAID)
    dataset.attrs["config"] = text
    with pytest.raises(InputError, match="config"):
        dataset.sweep.trajectory()


def test_a_dataset_does_not_run_the_code_of_another(tmp_path: Path) -> None:
    (tmp_path / "evil.py").write_text("raise SystemExit\n", encoding="utf-8")
    dataset = sweep.predict(SAID)
    with pytest.raises(ValueError, match="contains no configuration; call"):
        dataset.drop_attrs().sweep.trajectory()
    dataset.attrs["config"] = f"model: {tmp_path / 'evil.py'}"
    with pytest.raises(InputError, match="refusing to run user code named inside a dataset"):
        dataset.sweep.trajectory()


def test_a_configuration_can_be_read() -> None:
    config = load_config(SAID, {"b": [2, 3, 4]})
    assert repr(config) == f"<Config quick>\n{config.label()}"
    shown = config._repr_html_()
    assert "<caption>quick: averaged</caption>" in shown
    assert "<th>b<td>2 … 4<td>3 values<td>short semi-axis b<td>c" in shown
    assert "<th>n0<td>" in shown
