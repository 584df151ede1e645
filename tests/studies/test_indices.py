"""Sobol indices: of a function whose indices are published, by SciPy's own estimate, and by brute force of a scene."""

from pathlib import Path

import numpy as np
import pytest
import scipy
from support import Write
from support.cli import invoke, refused

import sweep
from sweep.studies.indices import designed, estimated

SCENE = """\
name: scene
model: averaged
body: {a: 10, b: 3, delta: 0.03}
friction: {mu: {lognormal: [60, 0.15]}}
start: {n0: {normal: [0.05, 0.01]}, x0: {uniform: [0.002, 0.02]}, y0: 0.01}
samples: 256
integrator: {t_end: 1500}
measure: [reversals]
"""


def ishigami(seed: int) -> np.ndarray:
    """The function of Ishigami and Homma (1990) at the samples of our design, shape (5, 1024)."""
    unit = {name: {"uniform": [0, 1]} for name in ("n0", "x0", "y0")}
    config = sweep.load_config({"friction": {"mu": 60}, "start": unit, "samples": 1000, "seed": seed})
    x, y, z = (np.pi * (2 * np.array(column) - 1) for column in designed(config).cases.values())
    return np.reshape(np.sin(x) + 7 * np.sin(y) ** 2 + 0.1 * z**4 * np.sin(x), (5, 1024))


def test_indices_of_ishigami_are_the_published_ones() -> None:
    """The variances of its parts are known: first-order 0.3139, 0.4424, 0; total 0.5576, 0.4424, 0.2437."""
    expected = np.array([[0.3139, 0.4424, 0], [0.5576, 0.4424, 0.2437]])
    inside = []
    for seed in range(20):
        found = estimated(ishigami(seed)[None], seed)
        index, low, high = (
            np.array([found[f"{order}{end}"][0] for order in ("first_order", "total_order")])
            for end in ("", "_low", "_high")
        )
        np.testing.assert_allclose(index, expected, atol=0.06)
        inside.append((low <= expected) & (expected <= high))
    assert np.mean(inside) > 0.9


def test_a_quantity_that_is_unknown_or_constant_has_no_index() -> None:
    values = np.stack([ishigami(0), np.ones((5, 1024)), ishigami(0)])
    values[2, 1, 3] = np.nan
    found = estimated(values, 0)
    alone = estimated(values[:1], 0)
    for name, each in found.items():
        assert np.isnan(each[1:]).all()
        np.testing.assert_array_equal(each[0], alone[name][0])


def test_indices_of_a_scene_are_those_of_a_grid_of_quantiles(write: Write) -> None:
    found = sweep.indices(write(SCENE))
    chance = (np.arange(16) + 0.5) / 16
    grid = sweep.run(
        write(SCENE),
        mu=scipy.stats.lognorm(0.15, scale=60).ppf(chance),
        n0=scipy.stats.norm(0.05, 0.01).ppf(chance),
        x0=0.002 + 0.018 * chance,
        samples=None,
    )["reversals"].astype(float)
    here = found.sel(quantity="reversals")
    for name in ("mu", "n0", "x0"):
        others = [each for each in grid.dims if each != name]
        alone = float(grid.mean(others).var() / grid.var())
        total = float(grid.var(name).mean() / grid.var())
        one = here.sel(parameter=name)
        for index, expected in (("first_order", alone), ("total_order", total)):
            half = (one[f"{index}_high"] - one[f"{index}_low"]).item() / 2
            assert one[index].item() == pytest.approx(expected, abs=1.5 * half + 0.02), (name, index)


def test_the_command_resumes_and_says_what_it_found(write: Write, tmp_path: Path) -> None:
    out = tmp_path / "out"
    said = invoke("indices", write(SCENE), "--output", out)
    assert said.exit_code == 0, said.output
    assert "by 1280 trajectories" in said.stdout
    assert "reversals" in said.stdout
    assert invoke("indices", write(SCENE), "--output", out).stderr.count("already complete") == 1
    file = out / "scene_indices.nc"
    assert file.with_suffix(".png").exists()
    assert invoke("info", file).exit_code == invoke("plot", file).exit_code == 0
    refused(invoke("plot", file, "--var", "first_order"), "not for a figure of Sobol indices")


@pytest.mark.parametrize(
    ("old", "new", "words"),
    [
        ("b: 3", "b: [3, 4]", "body.b: cannot be an axis of indices; give one number"),
        ("model: averaged", "model: analytic", "is not simulated"),
        (SCENE, "friction: {mu: 60}\n", "no parameter is a distribution; give one"),
        ("measure: [reversals]", "measure: []", "measure: has no quantity that indices are computed of; add reversals"),
    ],
)
def test_what_has_no_indices_is_refused(write: Write, old: str, new: str, words: str) -> None:
    refused(invoke("indices", write(SCENE.replace(old, new))), words)
