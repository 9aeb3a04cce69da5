"""Translation of a flat Modelica model to a component."""
