"""Gear pair with backlash and given stiffness: impacts, sweeps and chaos."""
