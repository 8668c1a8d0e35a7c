"""The reference set without its steels, for tests that give limits of their own or none."""

NO_STEELS = {"material.treatment": None, "material.hardness": None, "ring.material": None}
"""Changes that leave nothing to rate."""
