"""Integrate many trajectories side by side, with numpy and numba alone.

From the bottom up: `layout` defines where numbers are kept and `codegen` generates source; `measures/` has one file per
measurement; `lanes` and `kernel` are the machinery that all methods share; `runge_kutta` and `adams/` are the
methods, and `methods` lists them.
"""
