"""Hold every option in one table."""
