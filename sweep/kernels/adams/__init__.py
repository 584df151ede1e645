"""The stiff method: Adams formulas for the slow variables (u, M), BDF for the slip."""
