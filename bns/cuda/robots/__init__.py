"""Robots on a GPU, one module each, found by the robot's name.

A module has these, for `bns.cuda.batch` and the kernels it makes:

- ``scored(w, commands, length, goals, own, luck)``: device function: fitness of a controller, goals reached, commands that count.
- ``bred(parents, lengths, order, cdf, children, child_lengths, pair, own, step)``: device function: both children of a pair are
  made; how many of them were cut at the bound.
- ``draw(luck, own, step, thread, threads)``: device function: the threads of a block fill luck (``DRAWS``,) float64, which is the
  same for every controller of a generation.
- ``drive``: kernel: the substitute world, what is judged there (``DRIVEN``), and what is learnt; ``driving_grid(runs)``: its
  blocks and threads; ``STEPS``: patterns that one command leaves at most.

``own`` is the run's record of `bns.cuda.settings`, ``step`` the number of the generation.
"""
