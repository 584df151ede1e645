"""A user's model: a rattle that decays as exp(-2 t) in energy, below a spin that it could change by its root."""

# ruff: noqa: ARG001  (the functions of a model have one signature each)

from typing import Any, NamedTuple

from sweep.jit import inline
from sweep.models.model import Model, Offer
from sweep.parameters import Parameter


class Constants(NamedTuple):
    damping: Any

    @classmethod
    def of(cls, columns: Any) -> "Constants":
        return cls(columns["damping"])


def start(columns: Any) -> Any:
    if columns["torque"].max() > 1.1 and len(columns["torque"]) > 2:
        raise ValueError("too much")
    return columns["angle"], columns["torque"], 0 * columns["angle"]


@inline
def rhs(y: Any, p: Any) -> Any:
    angle, rate, phase = y
    return (-angle * (1 + rate**2), 0.0, -phase), (rate, 0.0, 1.0, 1.0)


@inline
def energy(y: Any, p: Any) -> Any:
    return y[1], 0.5 * y[0] * y[0], 1.0


@inline
def upright(spin: Any) -> Any:
    return 0.0, spin, 0.0


MODEL = Model(
    name="rolling",
    summary="a rattle that decays below a constant spin",
    own_parameters=(
        Parameter("damping", "body", "sqrt(g/length)", "damping", 0.5, at_least=0, below=10),
        Parameter("torque", "drive", "m g length", "spin at the start", 1.0, at_least=0, below=10),
        Parameter("angle", "start", "radian", "start angle", 1.0, above=-3.15, below=3.15),
    ),
    offers=frozenset({Offer.COUNT, Offer.SPIN, Offer.LINEAR}),
    states=("angle", "rate", "phase"),
    spin_state=1,
    constants=Constants,
    start=start,
    rhs=rhs,
    energy=energy,
    upright=upright,
    slower_period=lambda columns: 0.5 + 0 * columns["angle"],
    fastest_motion=lambda columns: 2 + columns["torque"],
)
