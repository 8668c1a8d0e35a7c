"""Gears: exact teeth, planetary sets, their kinematics, phases and deviations."""
