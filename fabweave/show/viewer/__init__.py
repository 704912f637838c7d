"""Write the page that shows a job in a browser."""
