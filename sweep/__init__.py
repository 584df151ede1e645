"""Parameter sweeps for the reversals of a rattleback.  The public names stand in `sweep.api`."""

from sweep.api import *  # noqa: F403
from sweep.api import __all__ as __all__
