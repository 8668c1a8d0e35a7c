"""femgear: planetary gear sets from tooth geometry to the vibration heard on the housing."""

__version__ = "0.1.0"
