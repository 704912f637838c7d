"""Offer the stations of a job to Python users, one value after another."""
