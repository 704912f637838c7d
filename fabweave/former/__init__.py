"""A former: slotted plates of a model's inside, on which strips are laid, and how it comes out."""
