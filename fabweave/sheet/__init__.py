"""Draw sheets for the cutter: marks, lettering, DXF, SVG and previews."""
