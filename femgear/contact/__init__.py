"""Contact: gears as elastic bodies, the contact problem of a planetary set, and its mesh cycle."""
