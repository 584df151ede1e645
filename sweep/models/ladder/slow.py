"""The slow equations: two amplitudes and the spin, without the oscillations.

The rattle is a sum of two rocking modes.  Their amplitudes and phases, and how they turn the spin, follow from the full
model, to third order in the amplitudes, and to fourth order for the spin (`sweep.models.slow.exchange`).  Nothing is
simulated: `sweep.models.slow.estimate` gives the count.
"""

from __future__ import annotations

from sweep.models.ladder import slip
from sweep.models.model import Offer, Tier

MODEL = Tier(
    name="slow",
    summary="the count by slow equations of two amplitudes and the spin, without oscillations",
    parameters=slip.MODEL.parameters,
    positive=frozenset({"mu"}),
    offers=frozenset({Offer.COUNT, Offer.FORMULAS}),
    counts="reversals_estimated",
    impossible=slip.MODEL.impossible,
)
