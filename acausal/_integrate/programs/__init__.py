"""Compiled programs of runs, kept for later processes."""
