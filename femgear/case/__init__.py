"""Case file: keys with units and windows, checks, estimates, and messages about mistakes."""
