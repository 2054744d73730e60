"""A diagnosis as text, figures, tables and one page."""
