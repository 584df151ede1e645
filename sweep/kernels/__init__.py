"""Integrates many trajectories side by side; imports numpy and numba alone.

From the bottom up: `layout` says where numbers are kept and `codegen` generates source; `measures/` has one file per
measurement; `lanes` and `kernel` are the machinery that all methods share; `runge_kutta` and `adams/` are the
methods, and `methods` lists them.
"""
