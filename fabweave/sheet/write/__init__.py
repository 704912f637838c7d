"""Write drawings as DXF, SVG, pictures and templates."""
