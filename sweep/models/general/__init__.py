"""Any rigid body: its inertia, surface, law of friction and couples, and the equations put together from them."""
