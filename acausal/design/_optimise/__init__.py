"""Optimal designs and Pareto fronts, each with its certificate."""
