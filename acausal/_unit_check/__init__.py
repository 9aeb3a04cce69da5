"""The pass that checks units: what dimension each equation of a model has, and whether its terms agree."""
