"""What the comparisons share: the machine's name, measured processes, charts, results folders."""
