"""The stiff method: Adams formulas for the nonstiff variables (u, M), BDF for the slip."""
