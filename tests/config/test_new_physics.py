"""A new surface or law of friction is its record alone: what the configuration and labels know stands there."""

from support.processes import python

PROGRAM = """
from dataclasses import replace

import numpy as np

from sweep.models.general.laws import LAWS
from sweep.models.general.surfaces import PARABOLOID, SURFACES

SURFACES["dish"] = replace(
    PARABOLOID, name="dish", meanings={"a": {"long_name": "hollow"}}, required=frozenset({"b"}),
    off=lambda columns, x, y: x > 3, outline="x <= 3",
)
LAWS["coulomb-round"] = replace(LAWS["coulomb-cubic"], name="coulomb-round")
LAWS["smear"] = replace(LAWS["coulomb-tanh"], name="smear", parameters=("mu", "speed", "mu_viscous"))

from sweep import ConfigError, load_config
from sweep.config.schema import PATHS, SETTINGS
from sweep.grid import Grid

INERTIA = {"Ixx": 2.0, "Iyy": 20.0, "Izz": 21.0, "Ixy": -0.3}


def config(surface, law, **more):
    body = {"surface": surface, "a": 0.05, "b": 0.3, **INERTIA}
    return load_config({"body": body, "friction": {"mu": 0.2, "speed": 0.01, **law}, "start": {"x0": 0.1} | more})


def slope(found):
    model, columns = found.equations, found.grid.columns()
    states = tuple(column + 0.01 * i for i, column in enumerate(model.start(columns)))
    return np.ravel(model.rhs(states, model.constants.of(columns))[0])


def refused(call, words):
    try:
        call()
    except ConfigError as error:
        assert words in str(error), error
    else:
        raise AssertionError(words)


for law, twin in (
    ({"law": "coulomb", "regularisation": "round"}, {"law": "coulomb", "regularisation": "cubic"}),
    ({"law": "smear"}, {"law": "coulomb", "regularisation": "tanh"}),
):
    made = config("dish", law)
    assert made.equations.name.endswith("+dish"), made.equations.name
    assert load_config(made.document()) == made
    assert (slope(made) == slope(config("paraboloid", twin))).all()
assert "smear" in SETTINGS["friction.law"].annotation.__args__
assert made.described("a")["long_name"] == "hollow"
assert "units" not in made.described("mu")
refused(lambda: config("dish", {"law": "smear"}, x0=4), "start point off the dish at x0=4")
refused(lambda: config("dish", {"law": "smear", "regularisation": "tanh"}), "the law smear needs no regularisation")
refused(lambda: config("dish", {"law": "smear", "mu_static": 1}), "does not belong to the law smear")
refused(lambda: config("plate", {"law": "smear"}), "must be ellipsoid, paraboloid or dish, not 'plate'")
refused(lambda: load_config({"body": {"surface": "dish", **INERTIA}, "friction": {"mu": 1}}), "body.b: missing")
"""


def test_a_new_surface_and_a_new_law_are_their_records_alone() -> None:
    python("-c", PROGRAM)
