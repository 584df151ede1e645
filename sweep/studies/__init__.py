"""Studies of a model beyond maps of counts."""

BOUNDARY_WIDTH = 1e-6
"""Default relative distance between the two simulated cells on either side of a boundary."""

BOUNDARY_DEVIATION = 1e-2
"""Default largest distance of a boundary from the curve halfway between two points, relative to the axes' lengths."""

SPIN_WIDTH = 1e-3
"""Default relative width of the brackets of n_c2."""

WIDTHS, DEVIATIONS = (1e-12, 0.5), (1e-9, 1.0)
"""Permitted ranges of the width of brackets and of the deviation of curves."""
