"""Solutions, and the quantities derived from them."""
