"""Derive what follows from a model without running it: linear theory, rocking, ripple, the paper's coefficients."""
