"""Comparison of models with published reference results."""
