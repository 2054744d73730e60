"""Does the diagnosis name what is missing? Generated worlds with hidden effects, and the judge of the answers.

`python -m tests.hidden_effects` (`make hidden-effects`) asks the product, through its command line, about every world.
Nothing here imports the product's physics or diagnosis: equations of motion, effects and camera are written a second time,
integrated by other means and in finer steps, so that no model ever meets its own image.
"""
