"""Check what reports and tables, the viewer and the manual state against the plan."""
