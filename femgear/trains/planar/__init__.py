"""Planetary set of rigid bodies in their plane, with play, bearing clearance and weight."""
