"""The status of a trajectory: running, or how it ended."""

from __future__ import annotations

# Running, and the ends of a trajectory; `results.dataset` has their names for the user.
RUNNING, SETTLED, TIME_LIMIT, LIFT_OFF, DIVERGED, PARADOX = range(6)

FAILURES = (LIFT_OFF, DIVERGED, PARADOX)

# Not an end: the rattle is so small that the kernel's `carry` may be able to do without steps.
QUIET = 6
