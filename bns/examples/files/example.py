"""What is missing in the model of a robot, and how much better it predicts with it."""

import bns

log = "khepera-log.csv"  # read through khepera-log.csv.import.yaml beside it
model = bns.Model("khepera")

found = bns.diagnose(log, model)
print(found.summary())

mended = bns.add(log, found.effects, model)
print(mended.summary())

mended.model.save("mended.yaml")
