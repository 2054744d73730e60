"""What a model, or networks, say the robot should have done."""
