"""The interface for authors of components and models."""
