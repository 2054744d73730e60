"""The five screens, a file each: what they show of a tab, and what a click does to it."""
