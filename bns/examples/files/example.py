"""Name the effect that the model of a robot lacks, add it, and show the error before and after."""

import bns

log = "khepera-log.csv"  # read through khepera-log.csv.import.yaml next to it
model = bns.Model("khepera")

found = bns.diagnose(log, model)
print(found.summary())

added = bns.add(log, found.effects, model)
print(added.summary())

added.model.save("extended.yaml")
