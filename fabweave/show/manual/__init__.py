"""Write the manual to print."""
