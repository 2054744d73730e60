"""Bodies on joints in MuJoCo, with effects: what the diagnosis needs of a robot whose joints are told positions."""
