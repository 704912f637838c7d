"""Make many jobs, each a proved folder, and nest those of one material on shared sheets."""
