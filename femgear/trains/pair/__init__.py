"""Two gears from their teeth: static contact, stresses, and vibration with contact loss."""
