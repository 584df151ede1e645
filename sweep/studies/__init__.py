"""Studies of a model beyond maps of counts."""

BOUNDARY_WIDTH = 1e-6
"""Relative distance of the two simulated cells between which a count changes."""

SPIN_WIDTH = 1e-3
"""Relative width down to which simulation brackets n_c2."""
