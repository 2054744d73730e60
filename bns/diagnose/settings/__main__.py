"""`python -m bns.diagnose.settings` prints the page of the documentation."""

from bns.diagnose.settings.page import page

print(page(), end="")
