"""Settings, options and numbers of a run, and its vector field."""
