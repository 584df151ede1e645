"""The regularity of reversals, against their times."""

import numpy as np
import pytest

import sweep


@pytest.mark.campaign
def test_cycles_are_those_of_the_reversal_times() -> None:
    scene = {
        "model": "noslip",
        "body": {"a": 3.0, "b": 2.0, "delta": 0.3},
        "start": {"n0": [0.05, 0.2, 0.4], "x0": 0.01, "y0": 0.01},
        "measure": ["reversals", {"reversal_times": 60}, "cycles"],
    }
    found = sweep.run(scene, t_end=2000)
    times = found.reversal_times.values
    assert (found.reversals <= 60).all()
    for row, mean, variation in zip(times, found.cycle_mean.values, found.cycle_variation.values, strict=True):
        known = row[np.isfinite(row)]
        lengths = known[2:] - known[:-2]
        if len(lengths):
            np.testing.assert_allclose(mean, lengths.mean(), rtol=1e-12)
        else:
            assert np.isnan(mean)
        if len(lengths) > 1:
            np.testing.assert_allclose(variation, lengths.std(ddof=1) / lengths.mean(), rtol=1e-6, atol=1e-9)
        else:
            assert np.isnan(variation)
    assert np.isnan(found.cycle_mean).any()
    assert (found.cycle_variation > 0.01).any()
