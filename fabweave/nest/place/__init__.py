"""Place pieces on a sheet, one after another."""
