"""Effect of a unit's residual errors on navigation: alignment, and the error growth of a stationary system."""
