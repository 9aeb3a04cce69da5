"""Solutions, and what is read from them."""
