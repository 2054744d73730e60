"""Which effects belong in the model: stepwise selection, plausibility, sets that cannot be distinguished."""
