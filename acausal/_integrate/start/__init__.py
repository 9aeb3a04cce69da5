"""Searches for consistent start values."""
