"""Results as sentences and tables: what the terminal prints and what a report shows, said once."""
