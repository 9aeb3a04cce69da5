"""Choices among catalogues: all combinations of discrete alternatives."""
