"""What a job costs: time of the machine, hours of hands, and money; each a range."""
