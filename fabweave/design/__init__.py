"""Try designs of one model, from coarse to fine, and choose between them."""
