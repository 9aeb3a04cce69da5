"""Numbers, settings and options of a run, and the vector field."""
