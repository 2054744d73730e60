"""What approaches share: simulators with physics or networks, evolution on each, Pareto ranking."""
