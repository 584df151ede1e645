"""The stiff method: Adams formulas for the slow variables, BDF for the slip."""
