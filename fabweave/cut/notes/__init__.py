"""Draw what stands on a sheet for people and is not cut."""
