"""The equations in variables in which only the slip is stiff, and what is known of a small rattle in them."""
