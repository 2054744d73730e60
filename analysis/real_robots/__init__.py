"""What is missing in a plain model of two wheels, on logs of real robots: numbers, pages of words, figures."""
