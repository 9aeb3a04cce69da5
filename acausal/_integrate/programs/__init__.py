"""Compiled programs of runs, stored on disk for later processes."""
