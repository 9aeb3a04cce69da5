"""Modelica models as components."""
