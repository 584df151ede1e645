"""Counts of bodies that a dataset does not have: estimated as by `predict`, and in the end those of a run."""

from dataclasses import replace
from typing import Any

import numpy as np
import pytest

import sweep
from sweep.explorer import bodies, state
from sweep.explorer.bodies import COUNT
from sweep.explorer.setup import Setup, usable
from sweep.explorer.slices import Source
from sweep.kernels.status import IMPOSSIBLE

RUN: dict[str, Any] = {
    "body": {"b": [0.5, 2.0, 3.0, 4.0, 5.0]}, "friction": {"mu": [30, 50, 70, 90, 110]}, "start": {"n0": 0.05},
    "integrator": {"t_end": 1500},
}  # fmt: skip


def a_source(**more: Any) -> tuple[Source, Setup]:
    source = Source(sweep.run(RUN | more))
    return source, Setup(source)


@pytest.mark.parametrize("drag", [{}, {"sigma": 1e-3}], ids=["", "with a drag"])
def test_counts_are_estimated_and_then_simulated(drag: dict[str, float]) -> None:
    friction = {"friction": RUN["friction"] | drag}
    source, setup = a_source(**friction)
    shown = replace(state.first(source), changed={"delta": 0.05})
    coarse, fine, *_, last = found = list(dict.fromkeys(bodies.counts(setup, source, shown)))
    other = RUN | {"body": {"b": RUN["body"]["b"], "delta": 0.05}} | friction
    estimated = sweep.predict(other | {"measure": ["reversals", "estimate"]})[COUNT].transpose(
        *last.dataset[COUNT].dims
    )
    np.testing.assert_array_equal(fine.dataset[COUNT], estimated)
    np.testing.assert_array_equal(coarse.dataset[COUNT], estimated[[0, 0, 0, 0, 4]][:, [0, 0, 0, 0, 4]])
    for name, of_run in ((COUNT, "reversals"), ("status", "status")):
        simulated = sweep.run(other)[of_run].transpose(*last.dataset[name].dims)
        np.testing.assert_array_equal(last.dataset[name], simulated, name)
    assert (last.dataset["status"].sel(b=0.5) == IMPOSSIBLE).all()
    assert [each.whole for each in found] == [*[False] * (len(found) - 1), True]
    assert fine.dataset[COUNT].attrs["long_name"] == "spin reversals, estimated, δ = 0.05 rad"
    assert last.dataset[COUNT].attrs["long_name"] == "spin reversals, simulated, δ = 0.05 rad"


def test_a_size_of_a_solid_with_weights_can_be_changed() -> None:
    weights = [{"mass": "5 g", "at": at} for at in (["4 cm", "1 cm", "-2 mm"], ["-4 cm", "-1 cm", "-2 mm"])]
    body = {"solid": "half_ellipsoid", "length": "12 cm", "width": ["36 mm", "40 mm"], "height": "16 mm",
            "mass": "52 g", "weights": weights}  # fmt: skip
    scene = {"units": "SI", "body": body, "friction": {"mu": 100},
             "start": {"n0": [3, 5], "x0": "1 mm", "y0": "0.3 mm"}, "integrator": {"t_end": 20}}  # fmt: skip
    source = Source(sweep.run(scene))
    setup = Setup(source)
    assert {"length", "height", "mass"} <= bodies.can_change(setup, source).keys()
    *_, last = bodies.counts(setup, source, replace(state.first(source), changed={"mass": 0.1}))
    expected = sweep.run(scene | {"body": body | {"mass": 0.1}})["reversals"]
    np.testing.assert_array_equal(last.dataset[COUNT], expected.transpose(*last.dataset[COUNT].dims))


def test_a_value_represents_its_neighbours_on_a_long_axis() -> None:
    source, setup = a_source(friction={"mu": {"start": 20, "stop": 120, "num": 130}}, body={"b": 3})
    shown = replace(state.first(source), changed={"a": 11.0})
    _, fine, *_, last = dict.fromkeys(bodies.counts(setup, source, shown))
    values = fine.dataset[COUNT].values
    assert values.shape == last.dataset[COUNT].shape == (130,)
    np.testing.assert_array_equal(values[1::3], values[:-1:3])
    assert np.unique(values).size > 1


@pytest.mark.browser
def test_counts_of_another_body_have_a_scale_for_both_bodies() -> None:
    """Its colours mean the same counts as those of the dataset's own map, which keeps its scale."""
    from sweep.explorer import figure

    source, setup = a_source()
    first = state.first(source)
    shown, scales = figure.MapFigure(source, first.x, first.y), []
    for changed in ({}, {"delta": 0.06}, {"delta": 0.02}, {}):
        there = replace(first, changed=changed)
        counts = next(bodies.counts(setup, source, there)) if changed else None
        scales.append(shown.show(there, counts.dataset if counts else None)[1].ticks)
    own, higher, lower, again = scales
    assert own == again
    assert own.items() < higher.items()
    assert own.items() <= lower.items()


def test_what_can_be_changed() -> None:
    """What is constant and has a scale, where two modes make the count; nothing in a table of cases."""
    source, setup = a_source(start={"n0": 0.05, "x0": 0.0})
    assert bodies.can_change(setup, source).keys() == {"a", "c", "delta", "n0", "y0"}
    assert "sigma" in bodies.can_change(*reversed(a_source(friction=RUN["friction"] | {"sigma": 1e-3})))
    assert bodies.can_change(None, source) == {}
    for more in ({"model": "averaged"}, {"body": {}, "cases": {"b": [2.0, 3.0]}, "friction": {"mu": 60}}):
        source = Source(sweep.run(RUN | {"body": {"b": [2.0, 3.0]}} | more))
        assert bodies.can_change(usable(source), source) == {}


@pytest.mark.parametrize(("text", "fault"), [("delta:0.05", ""), ("delta:x", "delta has to be"), ("q:1", "q is not a")])
def test_an_address_names_another_body(text: str, fault: str, source: Source, setup: Setup) -> None:
    found, faults = state.read({"with": [text]}, source, setup.base)
    assert found.changed == ({} if fault else {"delta": 0.05})
    assert fault in "".join(faults)
    again, faults = state.read({"with": ["delta:0.05,mu:7"]}, source, setup.base)
    assert again.changed == {"delta": 0.05}
    assert faults == ["with: mu varies in this file; only constant parameters can be changed"]
    assert "with=delta:0.05" in state.write(again, source, setup.base)
