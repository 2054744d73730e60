"""What every function of the front door shares: how results are shown, and what they were made from."""
