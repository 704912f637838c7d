"""Check the sheets: what is drawn, cut and engraved on them, where, and in what order."""
