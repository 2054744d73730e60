"""The one style of all figures, and the process that draws them."""
