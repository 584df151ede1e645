"""What a dry run promises: every run of every cell is counted, and compiling."""

import re
from typing import Any
from unittest.mock import patch

import pytest
from support import STANDARD

import sweep
from sweep.engine.estimate import estimate
from sweep.jit import Cached
from sweep.kernels.measures import MEASURES


def seconds(what: str, **settings: Any) -> float:
    """Return the seconds that are estimated for `what`."""
    cells = {"body": {"b": [2.0, 3.0]}, "friction": {"mu": STANDARD["mu"]}, "start": {"n0": 0.05}}
    integrator = {"t_end": 3e6, "method": "dopri5", "estimate_errors": settings.pop("estimate_errors", False)}
    with patch("sweep.engine.estimate.duration", str):
        said = estimate(sweep.load_config(cells | {"integrator": integrator, **settings}))
    found = re.search(rf"([\d.e+-]+) to {what}", said)
    assert found
    return float(found[1])


@pytest.mark.parametrize("name", MEASURES)
def test_every_measurement_is_counted(name: str, monkeypatch: pytest.MonkeyPatch) -> None:
    measure = [*MEASURES[name].needs, name]
    for each in (*MEASURES[name].needs, name):
        monkeypatch.setattr(MEASURES[each], "cost", 1.0)
    alone = seconds("compute", measure=measure)
    monkeypatch.setattr(MEASURES[name], "cost", 10.0)
    assert seconds("compute", measure=measure) == pytest.approx(10 * alone, rel=0.1)


@pytest.mark.parametrize(
    ("settings", "runs"),
    [
        ({"estimate_errors": True}, 1 + 1 / 1.5),
        ({"body": {"b": [2.0, 3.0], "offset": 0.1}}, 1.4),
    ],
    ids=["errors", "general"],
)
def test_what_runs_again_or_longer_is_counted(settings: dict[str, Any], runs: float) -> None:
    assert seconds("compute", **settings) == pytest.approx(runs * seconds("compute", measure=["reversals"]), rel=0.1)


def test_compiling_is_counted_where_the_cache_lacks_it(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(Cached, "is_missing", lambda self: True)  # noqa: ARG005
    assert seconds("compile") > 5
    monkeypatch.setattr(Cached, "is_missing", lambda self: False)  # noqa: ARG005
    assert seconds("compile") == 0
