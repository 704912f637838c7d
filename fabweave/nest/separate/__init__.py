"""Push pieces on a sheet apart, so that more find room."""
