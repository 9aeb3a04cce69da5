"""Parameters from measurements: weighted least squares with confidence intervals."""
