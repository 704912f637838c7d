"""Hold what every room needs: arrays, errors, units, messages, arc paths."""
