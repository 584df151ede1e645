"""The slow equations of a rattleback: two complex amplitudes and the spin, for counts that are estimated."""
