"""Weave other twills and satins, where warp and weft exist."""
