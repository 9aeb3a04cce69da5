"""From sorted blocks to fast functions of numbers."""
