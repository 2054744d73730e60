"""How long a sweep will take: the pace of past runs, the cost of each, the plan shown before it starts."""
