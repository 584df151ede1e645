"""The status of a trajectory: running, or how it ended; and reasons to doubt its results."""

from __future__ import annotations

from enum import IntFlag

# Running, and the ends of a trajectory; `results.dataset` has their names for the user.
RUNNING, SETTLED, TIME_LIMIT, LIFT_OFF, DIVERGED, PARADOX, TOPPLED = range(7)

# Not an end: the rattle is so small that the stepper's `between` may be able to do without steps.
QUIET = 7

IMPOSSIBLE = 8
"""Not run: an impossible body, or one that does not stand upright at rest (`Model.impossible`)."""

FAILURES = (LIFT_OFF, DIVERGED, PARADOX, TOPPLED)
"""Ends before the time limit.  A kernel gives the first three as first impressions, from the stages of a step that may
have been too long; `sweep.kernels.failure` and `sweep.engine.failures` find out what really happened."""


class Doubt(IntFlag):
    """Reasons to doubt the results of a trajectory that did not fail; `results.dataset` explains them to the user."""

    TIME_LIMIT = 1
    STEP = 2
    WINDOWS = 4
    PARITY = 8
    MARGIN = 16
    ROUND_OFF = 32
    TOLERANCE = 64


COUNT_DOUBTS = Doubt.TIME_LIMIT | Doubt.STEP | Doubt.WINDOWS | Doubt.PARITY | Doubt.MARGIN
"""Reasons against the count; the others concern times and the final spin."""
