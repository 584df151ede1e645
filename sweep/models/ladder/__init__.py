"""The paper's ladder of models, one file each: slip, noslip, effective, averaged, slow, and the formulas."""
