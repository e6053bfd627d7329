"""The complete attitude system: sensor pins in, attitude out."""
