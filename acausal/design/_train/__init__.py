"""Training of laws with many weights."""
