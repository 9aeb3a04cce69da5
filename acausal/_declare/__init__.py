"""What an author of components and models writes."""
