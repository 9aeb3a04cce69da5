"""Search for consistent start values."""
