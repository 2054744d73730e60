"""The guard of a robot's port: a process that outlives its trial and stops the robot; `client` is the trial's side of it."""
