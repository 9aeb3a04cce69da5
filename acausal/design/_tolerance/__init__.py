"""Scatter of results caused by scatter of parameters."""
