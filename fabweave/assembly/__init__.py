"""Say what crosses what: the crossing map."""
