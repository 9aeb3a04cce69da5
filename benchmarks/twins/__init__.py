"""Circuits made twice: of our components, and of the classes of the Modelica Standard Library."""
