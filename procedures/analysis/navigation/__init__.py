"""What residual errors of a unit do to navigation: alignment, and the growth of errors of a stationary system."""
