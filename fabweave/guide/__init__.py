"""The guide: one Markdown page for each topic, which comes with the package."""
