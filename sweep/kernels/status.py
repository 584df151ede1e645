"""The status of a trajectory: running, or how it ended."""

from __future__ import annotations

# Running, and the ends of a trajectory; `results.dataset` has their names for the user.
RUNNING, SETTLED, TIME_LIMIT, LIFT_OFF, DIVERGED, PARADOX, TOPPLED = range(7)

# Not an end: the rattle is so small that the kernel's `carry` may be able to do without steps.
QUIET = 7

IMPOSSIBLE = 8
"""Not run: an impossible body, or one that does not stand upright at rest (`Model.impossible`)."""

FAILURES = (LIFT_OFF, DIVERGED, PARADOX, TOPPLED)
"""Ends before the time limit.  A kernel gives the first three as first impressions, from the stages of a step that may
have been too long; `sweep.kernels.failure` and `sweep.engine.failures` find out what really happened."""
