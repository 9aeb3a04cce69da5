"""Optimal control: the signals that drive a model to a target."""
