"""Jaxprs of known numbers: simplified, evaluated by NumPy, compiled in parts when that pays, and stored as data."""
