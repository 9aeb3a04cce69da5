"""The exceptions of the library: each message names the component's path and the remedy."""


class ModelError(Exception):
    """A model that is declared or connected wrongly; raised before any number is computed."""


class StructureError(ModelError):
    """A system of equations that has no unique solution for structural reasons."""


class ParameterError(ModelError, ValueError):
    """A parameter outside its admissible range."""


class SimulationError(RuntimeError):
    """A run that failed numerically, or never met its stop condition."""
