"""First- and second-order conditions of an optimum, for any objective and constraints with gradients."""
