"""What no listed effect explains: along which variables, when, in which form."""
