"""From a declared model to sorted blocks of equations: structure, without numbers."""
