"""Results of a model with their derivatives: one design at a time, on all cores, with progress shown."""
