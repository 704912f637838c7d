"""A job from settings to a proved folder: its stations, and what each writes."""
