"""Studies of a model beyond maps of counts."""

BOUNDARY_WIDTH = 1e-6
"""Relative distance of the two simulated cells between which a count changes."""

BOUNDARY_DEVIATION = 1e-2
"""How far a boundary may be from the smooth curve in the middle between two points, relative to the axes' lengths."""

SPIN_WIDTH = 1e-3
"""Relative width down to which simulation brackets n_c2."""

WIDTHS, DEVIATIONS = (1e-12, 0.5), (1e-9, 1.0)
"""The least and the largest width of brackets, and deviation of curves, that can be asked for."""
